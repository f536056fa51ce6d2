# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
One recording of a drive: named signals, each with a unit and its own time stamps.

A run of the emulator, a bag of the recorder node and a field test in a CSV are
all a `Recording`; article/, diagnosis/ and notebooks read nothing else. Signals are named
'unit/signal' as in emulator/wiring.py. Nothing here can be changed after it was made; every
operation gives a new recording.

Time is kept in whole nanoseconds, as in ROS 2 and MCAP, so that stamps survive every file
format exactly and equal stamps compare equal; `time_s` gives seconds for computing.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from types import MappingProxyType
from typing import Any, NamedTuple

from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.recording.plain import freeze, thaw
from antenna_drive.recording.sheet import TestSheet
import numpy as np
from numpy.typing import ArrayLike
from simgap.errors import one_line
from simgap.inputs.plain import PlainDataError
from simgap.inputs.schema import nearest
from simgap.logs.channel import (
    Channel, check_name, FloatArray, IntArray, make_channel, NANOSECONDS, nanoseconds,
    RecordingError,
)


_BLOCK = 65536  # stamps that are looked at together


def unit_of(name: str) -> str:
    """Return the SI unit of one of the drive's own signals, '' for any other name."""
    unit, _, signal_name = name.partition('/')
    for signal in OUTPUTS.get(unit, ()):
        if signal.name == signal_name:
            return signal.unit
    return ''


def _named(name: str, channel: Channel) -> Channel:
    """Return a current of the drive in article amperes, where only A was written."""
    if channel.unit == 'A' and unit_of(name) == 'article A':
        return Channel('article A', channel.time_ns, channel.values)
    return channel


class Change(NamedTuple):
    """Tuning parameters that changed while the drive ran: they acted from `step` on."""

    step: int
    unit: str
    values: Mapping[str, Any]


def all_stamps(channels: Sequence[Channel]) -> IntArray:
    """Return every time stamp of the channels once, in order, shape (n,) [ns]."""
    return np.unique(np.concatenate([np.empty(0, np.int64), *(c.time_ns for c in channels)]))


def in_rows(channels: Sequence[Channel]) -> Iterator[tuple[IntArray, FloatArray]]:
    """
    Yield the samples in the order of time, many stamps together.

    Each time the stamps [ns], shape (n,), and the values of the channels at them, shape (n,
    channels), NaN where there is no sample.
    """
    stamps = all_stamps(channels)
    for first in range(0, len(stamps), _BLOCK):
        block = stamps[first:first + _BLOCK]
        table = np.full((len(block), len(channels)), np.nan)
        for column, channel in enumerate(channels):
            low, high = np.searchsorted(channel.time_ns, [block[0], block[-1] + 1])
            places = np.searchsorted(block, channel.time_ns[low:high])
            table[places, column] = channel.values[low:high]
        yield block, table


@dataclass(frozen=True)
class Recording:
    """
    Named signals with units and uneven time, and what is known of how they came about.

    Raises RecordingError: no such kind of content; the message names the signal or the key.

    >>> recording = Recording.from_arrays(
    ...     [0.0, 0.5, 1.0], {'motor_1/current': [0.0, 1.0, 4.0]})
    >>> recording['motor_1/current'].unit
    'article A'
    >>> recording.between(0.5)['motor_1/current'].time_s.tolist()
    [0.5, 1.0]
    """

    channels: Mapping[str, Channel]  # 'unit/signal' -> Channel, in the order given
    # the configuration in force at the start, plain data; empty if unknown
    configuration: Mapping[str, Any] = field(default_factory=dict)
    # live changes of tuning parameters, in the order of their steps
    changes: tuple[Change, ...] = ()
    sheet: TestSheet = TestSheet()  # the test sheet; empty if there is none
    # anything else that is known, plain data (source, payload ...)
    notes: Mapping[str, Any] = field(default_factory=dict)

    __hash__ = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        for name in self.channels:
            check_name(name)
        object.__setattr__(self, 'channels', MappingProxyType(
            {name: _named(name, channel) for name, channel in self.channels.items()}))
        try:
            object.__setattr__(self, 'configuration', freeze(dict(self.configuration)))
            object.__setattr__(self, 'notes', freeze(dict(self.notes)))
            object.__setattr__(self, 'changes', tuple(
                Change(int(step), str(unit), freeze(values))
                for step, unit, values in self.changes))
        except PlainDataError as error:
            raise RecordingError(str(error)) from None

    def __reduce__(self) -> tuple[Any, ...]:
        """Give another process plain data; read-only views cannot be sent."""
        changes = tuple(Change(step, unit, thaw(values)) for step, unit, values in self.changes)
        return Recording, (dict(self.channels), thaw(self.configuration), changes, self.sheet,
                           thaw(self.notes))

    def __repr__(self) -> str:
        """Return two lines instead of the arrays: how much there is, and the signals."""
        count = sum(map(len, self.channels.values()))
        parts = [f'{len(self.channels)} signals, {count} samples']
        if count:
            parts.append(f'{self.start_ns / NANOSECONDS:g} to {self.end_ns / NANOSECONDS:g} s')
        if self.changes:
            parts.append(f'live changes: {len(self.changes)}')
        known = [name for name, there in (('configuration', self.configuration),
                                          ('test sheet', self.sheet)) if there]
        if known:
            parts.append('with ' + ' and '.join(known))
        return f'Recording: {", ".join(parts)}\n  {one_line(", ".join(self.channels), 96)}'

    # -- making one ---------------------------------------------------------------------------

    @classmethod
    def from_arrays(cls, time_s: ArrayLike, signals: Mapping[str, ArrayLike],
                    units: Mapping[str, str] | None = None, **known: Any) -> 'Recording':
        """
        Make a recording of arrays that share one time axis, such as those of a run.

        time_s : shape (n,) [s]; rounded to whole nanoseconds
        signals : name -> values, shape (n,)
        units : name -> unit, for signals that the drive does not have
        known : configuration, changes, sheet and notes

        Raises RecordingError: see Channel and Recording; the message names the signal.
        """
        stamps = nanoseconds(np.atleast_1d(np.asarray(time_s, dtype=np.float64)))
        channels = {}
        for name, values in signals.items():
            unit = (units or {}).get(name, unit_of(name))
            channels[name] = make_channel(name, unit, stamps, values)
        return cls(channels, **known)

    # -- looking at it ------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Channel:
        """Return one signal; RecordingError names the nearest one if it is not there."""
        try:
            return self.channels[name]
        except KeyError:
            raise RecordingError(f'{name}: no such signal in this recording'
                                 f'{nearest(name, self.channels)}') from None

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the signals, in the order given."""
        return tuple(self.channels)

    @property
    def start_ns(self) -> int:
        """Return the first time stamp of any signal [ns], 0 if there is no sample."""
        return min((int(c.time_ns[0]) for c in self.channels.values() if len(c)), default=0)

    @property
    def end_ns(self) -> int:
        """Return the last time stamp of any signal [ns], 0 if there is no sample."""
        return max((int(c.time_ns[-1]) for c in self.channels.values() if len(c)), default=0)

    @property
    def duration_s(self) -> float:
        """Return the time from the first to the last sample of any signal [s]."""
        return (self.end_ns - self.start_ns) / NANOSECONDS

    # -- cutting ------------------------------------------------------------------------------

    def between(self, start_s: float = -math.inf, end_s: float = math.inf) -> 'Recording':
        """Return the samples of start_s <= t < end_s, with their time stamps."""
        low = -2**63 if start_s < -9.2e9 else nanoseconds(start_s)
        high = 2**63 - 1 if end_s > 9.2e9 else nanoseconds(end_s)
        cut = {}
        for name, channel in self.channels.items():
            first, last = np.searchsorted(channel.time_ns, [low, high])
            cut[name] = Channel(channel.unit, channel.time_ns[first:last],
                                channel.values[first:last])
        return replace(self, channels=cut)

    def shift_ns(self, offset_ns: int) -> 'Recording':
        """Return the recording with `offset_ns` added to all time stamps."""
        return replace(self, channels={
            name: Channel(channel.unit, channel.time_ns + offset_ns, channel.values)
            for name, channel in self.channels.items()})
