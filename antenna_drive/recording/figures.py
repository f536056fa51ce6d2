# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The figures of a recording that tell how the torque bias did its work.

Every sample counts until the next one of its signal, so that uneven sampling does not bias a
share of time. Docstrings define the figures; docs/recording.md lists them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from antenna_drive.readings import NAMED
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import Sensors
import numpy as np
from simgap.logs.channel import Channel, NANOSECONDS

MOTORS = ('motor_1', 'motor_2')
# A reading within this many standard deviations of its noise counts as zero.
NOISE_WIDTH = 3.0


@dataclass(frozen=True)
class BiasStatistics:
    """The bias voltage."""

    # the lowest and the highest
    minimum_V: float
    maximum_V: float
    at_zero: float  # share of time at or below `zero_V`, within which the motors do not counteract
    zero_V: float  # what counts as zero: 0, or the noise and resolution that the test sheet tells


@dataclass(frozen=True)
class MotorStatistics:
    """One motor; None where its signal was not recorded."""

    # greatest current either way, with its sign; the ammeter's where the current itself was not
    # recorded [article A]
    current_peak_A: float | None = None
    current_peak_s: float | None = None  # when it flowed
    current_rms_A: float | None = None  # root mean square [article A]
    stick: float | None = None  # share of time that the rotor stands still
    # rate that counts as standing still: 0, or noise and resolution of the sheet
    still_rad_s: float | None = None
    # how often the teeth changed from one flank to the other: changes of the sign of the gear
    # torque, the zeros in the gap between left out
    backlash_crossings: int | None = None


@dataclass(frozen=True)
class Statistics:
    """The figures of a recording; None where a signal was not recorded."""

    # span of the samples [s]
    start_s: float
    end_s: float
    bias: BiasStatistics | None  # the bias voltage
    motors: Mapping[str, MotorStatistics]  # 'motor_1' and 'motor_2' -> the motor's figures
    # share of time that the axis stands still, its rate being exactly zero
    axis_stick: float | None


def share_of_time(channel: Channel, holds: Any) -> float:
    """Return the share of time for which `holds`, an array of shape (n,), is true."""
    if len(channel) < 2:
        return float(np.mean(holds))
    width = np.diff(channel.time_ns)
    return float(width[holds[:-1]].sum() / width.sum())


def crossings(torque: Any) -> int:
    """Return how often the sign of `torque`, shape (n,), changes, zeros left out."""
    signs = np.sign(torque[torque != 0.0])
    return int(np.count_nonzero(signs[1:] != signs[:-1]))


def statistics(recording: Recording) -> Statistics:
    """Return the figures of a recording."""
    sensors = recording.sheet.sensors or Sensors()
    bias = None
    channel = _channel(recording, NAMED['bias_voltage'].signal)
    if channel:
        zero = _limit(sensors.bias_noise_V, sensors.bias_step_V)
        bias = BiasStatistics(float(channel.values.min()), float(channel.values.max()),
                              share_of_time(channel, channel.values <= zero), zero)
    still = _limit(sensors.tach_noise_rad_s, sensors.tach_step_rad_s)
    axis = _channel(recording, 'plant/axis_rate')
    return Statistics(
        recording.start_ns / NANOSECONDS, recording.end_ns / NANOSECONDS, bias,
        {motor: _motor(recording, motor, m, still) for m, motor in enumerate(MOTORS, 1)},
        share_of_time(axis, axis.values == 0.0) if axis else None)


def _motor(recording: Recording, motor: str, m: int, still: float) -> MotorStatistics:
    figures: dict[str, Any] = {}
    ammeter = NAMED[f'current_{m}']
    current = _channel(recording, ammeter.instead) or _channel(recording, ammeter.signal)
    if current:
        peak = int(np.argmax(np.abs(current.values)))
        width = np.append(np.diff(current.time_ns), 0.0) if len(current) > 1 else np.ones(1)
        figures.update(
            current_peak_A=float(current.values[peak]),
            current_peak_s=int(current.time_ns[peak]) / NANOSECONDS,
            current_rms_A=float(np.sqrt((width * current.values**2).sum() / width.sum())))
    rate = _channel(recording, NAMED[f'tach_{m}'].signal)
    if rate:
        figures.update(stick=share_of_time(rate, np.abs(rate.values) <= still), still_rad_s=still)
    torque = _channel(recording, f'{motor}/gear_torque')
    if torque:
        figures.update(backlash_crossings=crossings(torque.values))
    return MotorStatistics(**figures)


def _channel(recording: Recording, name: str) -> Channel | None:
    return recording[name] if name in recording and len(recording[name]) else None


def _limit(noise: float | None, step: float | None) -> float:
    return max(NOISE_WIDTH * (noise or 0.0), step or 0.0)
