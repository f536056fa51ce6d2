# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Which signals people look at together, and in which units: degrees here, SI everywhere else.

The report, the pictures and the layouts for plotting programs all show these panels. Currents are
in article amperes; here they also come in real ones, as a clamp meter shows them.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
import math
from typing import NamedTuple

from antenna_drive.readings import (
    AMMETER, ENCODER, of, RATE_COMMAND, Sensor, TACHOMETER, VOLTMETER,
)
from antenna_drive.recording.recording import Recording
from simgap.logs.channel import Channel, RecordingError

_DEGREES = 180.0 / math.pi
ARTICLE, REAL = 'article A', 'real A'


class Panel(NamedTuple):
    """Signals that share an axis: a title, the unit shown and how many of it are one SI unit."""

    title: str
    unit: str
    factor: float
    names: tuple[str, ...]


def _read_by(sensor: Sensor) -> tuple[str, ...]:
    return tuple(reading.signal for reading in of(sensor))


PANELS = (
    Panel('Axis rate', 'deg/s', _DEGREES, (RATE_COMMAND, 'plant/axis_rate')),
    Panel('Motor current', ARTICLE, 1.0, ('motor_1/current', 'motor_2/current')),
    Panel('Ammeter', ARTICLE, 1.0, _read_by(AMMETER)),
    Panel('Motor rate', 'deg/s', _DEGREES, (*_read_by(TACHOMETER), 'plant/pinion_rate')),
    Panel('Torque bias', 'V', 1.0, (*_read_by(VOLTMETER), 'torque_share/counter_torque')),
    Panel('Gear torque', 'N m', 1.0, ('motor_1/gear_torque', 'motor_2/gear_torque')),
    Panel('Axis angle', 'deg', _DEGREES, (*_read_by(ENCODER), 'plant/axis_angle')),
    Panel('Pointing error', 'mdeg', 1000.0 * _DEGREES,
          ('plant/pointing_error_elevation', 'plant/pointing_error_cross_elevation')),
    Panel('External torque', 'kN m', 1e-3, ('test_signal/external_torque',)),
    Panel('Missed impulse of the gear torque', 'N m s', 1.0,
          ('motor_1/missed_impulse', 'motor_2/missed_impulse')),
)


def chosen(recording: Recording, patterns: Sequence[str] | None) -> tuple[str, ...]:
    """
    Return the signals whose names fit any of the patterns, such as 'motor_*/current'.

    Raises RecordingError: a pattern fits no signal; the message names the nearest one.
    """
    if not patterns:
        return tuple(name for name in recording if len(recording[name]))
    names: dict[str, None] = {}
    for pattern in patterns:
        found = [name for name in recording if fnmatchcase(name, pattern)]
        names.update(dict.fromkeys(found or [pattern]))
    for name in names:
        recording[name]  # says which one was meant
    if not any(len(recording[name]) for name in names):
        raise RecordingError(f'{", ".join(names)}: no sample')
    return tuple(names)


def panels_of(recording: Recording, patterns: Sequence[str] | None = None) -> tuple[Panel, ...]:
    """
    Return the panels that show a recording: the drive's own first, then one for each other signal.

    recording : what is to be looked at
    patterns : the signals, see `chosen`; if not given, panels that tell nothing are left out: an
        external torque of zero, ammeters that read the currents, and the lock-step's own signal

    Raises RecordingError: a pattern fits no signal, or there is no sample at all.
    """
    names = chosen(recording, patterns)
    if not names:
        raise RecordingError('there is no sample to draw')
    panels = []
    rest = dict.fromkeys(names)
    for panel in PANELS:
        shown = tuple(name for name in panel.names if name in rest)
        for name in shown:
            del rest[name]
        if shown and (patterns or not all(_idle(recording, name) for name in shown)):
            panels.append(panel._replace(names=shown))
    for name in rest:
        panels.append(Panel(name, recording[name].unit or '1', 1.0, (name,)))
    return tuple(panels)


def _idle(recording: Recording, name: str) -> bool:
    signal = name.partition('/')[2]
    if signal == 'external_torque':
        return not recording[name].values.any()
    for ammeter in of(AMMETER):
        if name == ammeter.signal:
            return recording.channels.get(ammeter.instead) == recording[name]
    return signal == 'missed_impulse'


def real_amperes(recording: Recording) -> float | None:
    """Return how many real amperes one article ampere is, None if the recording tells nothing."""
    name = 'armature.physical_amperes_per_article_ampere'
    told = (configured(recording, motor, name) for motor in ('motor_1', 'motor_2'))
    return next((ratio for ratio in told if ratio is not None), None)


def configured(recording: Recording, unit: str, name: str) -> float | None:
    """Return a number of a recording's configuration, None if that does not tell it."""
    try:
        value = recording.configuration[unit][name]
    except (KeyError, TypeError):
        return None
    return value if isinstance(value, float) else None


def with_real_amperes(recording: Recording, names: Iterable[str]) -> Recording:
    """
    Return the signals of these names, and each current among them once more in real amperes.

    A current `motor_1/current` is followed by `motor_1/real_current`.

    Raises RecordingError: the recording does not tell how many real amperes an article ampere is,
    or there is no current.
    """
    kappa = real_amperes(recording)
    if kappa is None:
        raise RecordingError('the recording does not tell how many real amperes an article '
                             'ampere is: it has no configuration; one of antenna-drive record '
                             'has')
    channels = {}
    for name in names:
        channel = channels[name] = recording[name]
        if channel.unit == ARTICLE:
            unit, _, signal = name.partition('/')
            channels[f'{unit}/real_{signal}'] = Channel(
                REAL, channel.time_ns, kappa * channel.values)
    if not any(channel.unit == REAL for channel in channels.values()):
        raise RecordingError('there is no current among the signals')
    return replace(recording, channels=channels)
