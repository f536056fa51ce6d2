# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The parts of a recording that a diagnosis looks at.

A diagnosis simulates a test thousands of times, so it looks at half a minute of each. Which half
minute is decided by what it tells: a handful of effects is put into the configured drive, and the
part in which their responses stand out most from the sensors' noise is taken. A part from the
start of the motion is preferred, because the drive stood still before. The state in the middle of
a motion is not known; such a part is simulated for a while before it is compared.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import math

from antenna_drive.diagnosis.excitation import Bias, Longest, schedule
from antenna_drive.diagnosis.field_recording import FieldRecording, SOUGHT_S
from antenna_drive.diagnosis.sensors import SensorModel
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import place_of, record_of
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import READINGS
import numpy as np
from simgap.machine.contract import FloatArray

# A recording of up to this length is taken whole [s] ...
WHOLE_S = 35.0
# ... if its motion begins this soon [s].
_SOON_S = 2.0
# Time that is compared of a longer one, in one window or in two together [s].
_COMPARED_S = 30.0
# The comparison begins this long before the motion [s]: the rest tells the zeros of the sensors.
_BEFORE_S = 1.0
# A rest of up to this length is simulated from its beginning [s]. Of a longer one, this much
# before the comparison: the bias closes the gaps within four seconds of either circuit.
_REST_S, _REST_LEFT_S = 12.0, 5.0
# In the middle of a motion the slowest states, integrators of the amplifiers that work against
# each other, are forgotten to a few standard deviations within this time [s].
_SETTLING_S = 15.0
# Windows in the middle of a motion begin at multiples of this [s].
_GRID_S = 1.0
# A later window that begins this soon is simulated from the start, where the state is known [s].
_FROM_START_S = 60.0
# What a window costs, in the mean logarithm of an effect's energy that it must tell more: a state
# that is not known, and each second that is simulated and not compared. (Of 25 long recordings of
# practice, those whose bias steps in the middle gain 1.1 to 2.1 by a later window, the others up
# to 0.6.)
_UNKNOWN_COST, _COST_PER_S = 0.5, 0.015
# Runs that weigh windows: longest step and spacing of samples [s].
_STEP_S, _SAMPLE_S = 5.3e-3, 0.04
# Responses beyond this many standard deviations tell no more.
_MOST = 30.0
# The reading of a counter is an integral: its response shows in the tachometers.
_COMPARED = [not reading.sensor.is_counter for reading in READINGS]
# Effects that a window should tell, at sizes that matter to a crew: numbers of the configuration
# and the factors to their values.
_EFFECTS = (
    {'motor_1.motor.coulomb_torque': 1.5}, {'motor_1.motor.torque_constant': 1.06},
    {'motor_1.amplifier.rate_gain': 1.06}, {'motor_1.motor.current_limit': 0.9},
    {'motor_1.gearbox.half_gap': 1.15}, {'motor_1.gearbox.stiffness': 1.08},
    {'torque_share.circuit.bias_pot': 1.07}, {'torque_share.circuit.fade_out_voltage': 1.1},
    {'torque_share.circuit.k_3': 1.12}, {'torque_share.filter_1.gain': 1.12},
    {'torque_share.filter_1.pole': 1.12}, {'plant.axis.coulomb_torque': 1.07},
    {'plant.axis.inertia_hub': 1.08}, {'plant.axis.mode_frequencies.0': 1.06},
    {'plant.axis.mode_damping_ratios.0': 1.4, 'plant.axis.mode_damping_ratios.1': 1.4},
)


@dataclass(frozen=True)
class Window:
    """A part of a recording."""

    begin: float = 0.0  # of the simulation [s]
    compared: float = 0.0  # from this time on readings are compared [s]
    end: float = math.inf  # of the window [s]
    known_start: bool = True  # the drive stood still until `begin`


def windows(recording: FieldRecording, drive: Drive, bias: Bias, most: int) -> list[Window]:
    """Return the windows of a recording that tell most, at most so many, in the order of time."""
    first = first_window(recording)
    if recording.end <= first.end:
        return [first]
    energy = _energy(recording, drive, bias)
    choices = [[first], *([window] for window in _later(recording, first, _COMPARED_S))]
    if most > 1:
        short = replace(first, end=first.compared + 0.5 * _COMPARED_S)
        choices += [[short, window] for window in _later(recording, first, 0.5 * _COMPARED_S)
                    if window.compared >= short.end]
    return max(choices, key=lambda choice: _worth(energy, choice))


def first_window(recording: FieldRecording) -> Window:
    """Return the window at the start of the motion."""
    joined = float(recording.time[0])
    if recording.onset - joined <= _SOON_S:
        short = recording.end - joined <= WHOLE_S
        return Window(end=math.inf if short else joined + _COMPARED_S)
    compared = recording.onset - _BEFORE_S
    begin = 0.0 if compared <= _REST_S else compared - _REST_LEFT_S
    return Window(begin, compared, compared + _COMPARED_S)


def _later(recording: FieldRecording, first: Window, length: float) -> Iterator[Window]:
    """Yield the windows after the first one that compare this much time [s]."""
    last = min(recording.end, SOUGHT_S) - length
    for compared in np.arange(math.ceil(recording.onset) + _SETTLING_S, last, _GRID_S).tolist():
        known = compared - first.begin <= _FROM_START_S
        yield Window(first.begin if known else compared - _SETTLING_S, compared,
                     compared + length, known)


def _energy(recording: FieldRecording, drive: Drive, bias: Bias) -> FloatArray:
    """Return the energy of the responses to m effects up to n samples, shape (n + 1, m) [1]."""
    samples = np.arange(0.0, min(recording.end, SOUGHT_S), _SAMPLE_S)
    plan = schedule(recording.command, bias, samples, Longest(_STEP_S))
    plain = batch.run(record_of(drive), plan)
    noise = SensorModel.of(recording.sheet.sensors).noise(
        plain[:, :, 0], plain[:, :, 1], 0.01 * recording.period)
    energy = np.zeros((samples.size + 1, len(_EFFECTS)))
    for i, effect in enumerate(_EFFECTS):
        record = record_of(drive)
        for path, factor in effect.items():
            record.view(np.float64)[place_of(record.dtype, path)] *= factor
        response = (batch.run(record, plan)[:, :, 0] - plain[:, :, 0]) / noise
        response = np.clip(np.compress(_COMPARED, response, axis=1), -_MOST, _MOST)
        energy[1:, i] = np.sum(np.nan_to_num(response) ** 2, axis=1)
    return np.cumsum(energy, axis=0)


def _worth(energy: FloatArray, choice: Sequence[Window]) -> float:
    """Return the mean logarithm of the energy of each effect in windows, less what they cost."""
    total, cost = np.zeros(len(_EFFECTS)), 0.0
    for window in choice:
        first, last = np.clip(np.array([window.compared, window.end]) / _SAMPLE_S, 0,
                              len(energy) - 1).astype(int)
        total += energy[last] - energy[first]
        cost += (_COST_PER_S * (window.compared - window.begin)
                 + (0.0 if window.known_start else _UNKNOWN_COST))
    return float(np.mean(np.log1p(total))) - cost
