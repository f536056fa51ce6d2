# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of what a drive is commanded."""

from dataclasses import dataclass, field

from antenna_drive.parameters.declaring import Choice, effect, option
from simgap.inputs.schema import Entry

# The greatest numbers of sines in a multisine, and of points of a signal of straight lines.
SINES_LIMIT = 32
KNOTS_LIMIT = 64

WAVEFORMS = ('zero', 'square', 'saw_tooth', 'saw_tooth_jump', 'step', 'sine', 'chirp', 'multisine',
             'prbs', 'external', 'knots')


@dataclass(frozen=True, kw_only=True)
class Waveform:
    """A test signal over time; amplitude in the unit of what it commands."""

    waveform: Choice = option('zero', Entry(
        '', description='shape of the signal', live=True, choices=WAVEFORMS))
    amplitude: float = option(0.0, Entry(
        'SI', -1e9, 1e9, 'greatest value, rad/s or N m', live=True))
    offset: float = option(0.0, Entry('SI', -1e9, 1e9, 'added to the waveform', live=True))
    period: float = option(5.0, Entry('s', 0.01, 1e5, 'period', live=True))
    phase: float = option(0.0, Entry('1', -1.0, 1.0, 'start within the period', live=True))
    start_after: float = option(0.0, Entry(
        's', 0.0, 1e6, 'time before which the signal is zero', live=True))
    sweep_from: float = option(0.1, Entry('Hz', 0.0, 500.0, 'first frequency', live=True))
    sweep_to: float = option(5.0, Entry('Hz', 0.0, 500.0, 'last frequency', live=True))
    sweep_time: float = option(30.0, Entry('s', 0.01, 1e5, 'time of one sweep', live=True))
    frequencies: tuple[float, ...] = option((0.3, 0.7, 1.5), Entry(
        'Hz', 0.0, 500.0, 'frequencies of a multisine', live=True, lengths=(1, SINES_LIMIT)))
    weights: tuple[float, ...] = option((0.4, 0.3, 0.3), Entry(
        '1', -100.0, 100.0, 'weights of a multisine', live=True, lengths=(1, SINES_LIMIT)))
    phases: tuple[float, ...] = option((0.0, 0.0, 0.0), Entry(
        'rad', -100.0, 100.0, 'phases of a multisine', live=True, lengths=(1, SINES_LIMIT)))
    bit_time: float = option(0.2, Entry('s', 1e-3, 1e3, 'time of one bit of a PRBS', live=True))
    external: float = option(0.0, Entry(
        'SI', -1e9, 1e9, 'value commanded from outside', live=True))
    knot_times: tuple[float, ...] = option((0.0, 1.0), Entry(
        's', 0.0, 1e6, 'times of the points of straight lines, two alike for a jump', live=True,
        lengths=(1, KNOTS_LIMIT)))
    knot_values: tuple[float, ...] = option((0.0, 1.0), Entry(
        '1', -1.0, 1.0, 'values there, as shares of the amplitude', live=True,
        lengths=(1, KNOTS_LIMIT)))

    @property
    def frequencies_count(self) -> int:
        """Return the number of sines of a multisine."""
        return len(self.frequencies)

    @property
    def knot_times_count(self) -> int:
        """Return the number of points of straight lines."""
        return len(self.knot_times)


@dataclass(frozen=True, kw_only=True)
class TestSignal:
    """What the drive is commanded: a rate [rad/s], and a torque on the axis [N m]."""

    __test__ = False  # not a test case, whatever its name suggests to pytest

    rate: Waveform = field(default_factory=Waveform)
    torque: Waveform = field(default_factory=Waveform)
    delay: float = effect(0.0, 's', 0.0, 1.0, 'time by which the command comes late')
