# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
One recording of a drive: named signals, each with a unit and its own time stamps.

A run of the emulator, a bag of the recorder node, a field test in a CSV and a servo's log are
all a `Recording`; article/, machines/ and notebooks read nothing else. Signals are named
'unit/signal' as in emulator/wiring.py. Nothing here can be changed after it was made; every
operation gives a new recording.

Time is kept in whole nanoseconds, as in ROS 2 and MCAP, so that stamps survive every file
format exactly and equal stamps compare equal; `time_s` gives seconds for computing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.errors import one_line, UserError
from antenna_drive.parameters.schema import nearest
from antenna_drive.recording.plain import freeze, PlainDataError, thaw
from antenna_drive.recording.sheet import TestSheet
import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Method = Literal['linear', 'hold', 'nearest']

NANOSECONDS = 1_000_000_000
METHODS: Mapping[Method, str] = MappingProxyType({
    'linear': 'straight line between the neighbouring samples',
    'hold': 'the last sample before (zero-order hold)',
    'nearest': 'the nearest sample, the later one in the middle',
})


class RecordingError(UserError, ValueError):
    """A recording cannot be made, read or written as asked; one line says where and why."""


class RecordingWarning(UserWarning):
    """A recording was read, but something about it must be known; one line says what."""


def unit_of(name: str) -> str:
    """Return the SI unit of one of the drive's own signals, '' for any other name."""
    unit, _, signal_name = name.partition('/')
    for signal in OUTPUTS.get(unit, ()):
        if signal.name == signal_name:
            return signal.unit
    return ''


def nanoseconds(seconds: ArrayLike) -> Any:
    """
    Return seconds as whole nanoseconds, rounded to the nearest.

    Raises
    ------
    RecordingError : not finite, or beyond the 292 years that 64 bits hold

    """
    scaled = np.asarray(seconds, dtype=np.float64)
    # whole seconds and the rest apart: one product would lose bits of long stamps
    if not np.all(np.isfinite(scaled)) or np.any(np.abs(scaled) > 9.2e9):
        raise RecordingError('a time is not finite or beyond 9.2e9 s')
    whole = np.floor(scaled)
    result = whole.astype(np.int64) * NANOSECONDS + np.rint(
        (scaled - whole) * NANOSECONDS).astype(np.int64)
    return int(result) if result.ndim == 0 else result


def _frozen(array: ArrayLike, dtype: Any) -> Any:
    given = np.asarray(array)
    if given.dtype == dtype and given.base is None and not given.flags.writeable:
        return given
    copy = np.array(given, dtype=dtype)
    copy.flags.writeable = False
    return copy


@dataclass(frozen=True, eq=False)
class Channel:
    """
    The samples of one signal.

    Attributes
    ----------
    unit : SI unit, as in emulator/wiring.py; '' if unknown
    time_ns : array of shape (n,), int64 [ns]; strictly increasing, spacing as uneven as it was
    values : array of shape (n,), float64 [unit]; finite: where there is no sample there is none

    Raises
    ------
    RecordingError : the shapes differ, a time stamp is not later than the one before, or a
        value is not finite

    """

    unit: str
    time_ns: IntArray
    values: FloatArray

    def __post_init__(self) -> None:
        """Check the samples, and keep read-only copies of them."""
        if np.asarray(self.time_ns).dtype.kind not in 'iu' and len(self.time_ns):
            raise RecordingError('time stamps must be whole nanoseconds')
        object.__setattr__(self, 'time_ns', _frozen(self.time_ns, np.int64))
        object.__setattr__(self, 'values', _frozen(self.values, np.float64))
        if self.time_ns.ndim != 1 or self.time_ns.shape != self.values.shape:
            raise RecordingError(f'time stamps of shape {self.time_ns.shape} for values of shape '
                                 f'{self.values.shape}')
        early = np.flatnonzero(self.time_ns[1:] <= self.time_ns[:-1])
        if len(early):
            k = int(early[0])
            raise RecordingError(
                f'sample {k + 1} at {self.time_ns[k + 1] / NANOSECONDS:.9f} s is not later than '
                f'the one before at {self.time_ns[k] / NANOSECONDS:.9f} s')
        broken = np.flatnonzero(~np.isfinite(self.values))
        if len(broken):
            k = int(broken[0])
            raise RecordingError(f'sample {k} at {self.time_ns[k] / NANOSECONDS:.9f} s is '
                                 f'{self.values[k]}, no finite number')

    def __repr__(self) -> str:
        """Return a line instead of the arrays."""
        unit = f' [{self.unit}]' if self.unit else ''
        if not len(self):
            return f'Channel{unit}: no sample'
        first, last = self.time_ns[0] / NANOSECONDS, self.time_ns[-1] / NANOSECONDS
        return (f'Channel{unit}: {len(self)} samples from {first:g} to {last:g} s, '
                f'{self.values.min():g} to {self.values.max():g}')

    def __reduce__(self) -> tuple[Any, ...]:
        """Give another process what is checked and kept read-only there, too."""
        return Channel, (self.unit, self.time_ns, self.values)

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.values)

    def __eq__(self, other: object) -> bool:
        """Compare to the last bit: 0.0 and -0.0 differ."""
        return (isinstance(other, Channel) and self.unit == other.unit
                and np.array_equal(self.time_ns, other.time_ns)
                and self.values.tobytes() == other.values.tobytes())

    @property
    def time_s(self) -> FloatArray:
        """Return the time stamps in seconds, each the nearest double; shape (n,)."""
        result: FloatArray = self.time_ns / NANOSECONDS
        return result

    def at(self, time_ns: IntArray, method: Method = 'linear') -> FloatArray:
        """
        Return the values at other times; see METHODS for what each method does.

        Parameters
        ----------
        time_ns
            array of shape (m,), int64 [ns]; inside the span of the samples
        method
            one of METHODS

        Returns
        -------
        array of shape (m,) [unit]

        Raises
        ------
        RecordingError : no such method, or a time outside the span: nothing is extrapolated

        """
        if method not in METHODS:
            raise RecordingError(f'no method {method!r}: choose one of {", ".join(METHODS)}')
        if len(time_ns) == 0:
            return np.empty(0)
        if not len(self) or time_ns.min() < self.time_ns[0] or time_ns.max() > self.time_ns[-1]:
            raise RecordingError('a time lies outside the samples; nothing is extrapolated')
        before = np.searchsorted(self.time_ns, time_ns, side='right') - 1
        if method == 'hold':
            return self.values[before]
        after = np.minimum(before + 1, len(self) - 1)
        # differences of whole nanoseconds are exact however large the stamps are
        past = (time_ns - self.time_ns[before]).astype(np.float64)
        width = (self.time_ns[after] - self.time_ns[before]).astype(np.float64)
        share = np.divide(past, width, out=np.zeros_like(past), where=width > 0)
        if method == 'nearest':
            return self.values[np.where(share >= 0.5, after, before)]
        result: FloatArray = (1.0 - share) * self.values[before] + share * self.values[after]
        return result


class Change(NamedTuple):
    """Tuning parameters that changed while the drive ran: they acted from `step` on."""

    step: int
    unit: str
    values: Mapping[str, Any]


class Aligned(NamedTuple):
    """
    Several signals on common time stamps.

    Attributes
    ----------
    time_s : array of shape (n,) [s]
    values : array of shape (n, m), one column for each name
    names, units : m texts each
    method : one sentence that says how the values were found
    longest_gap_s : for each name the widest distance between neighbouring samples used [s]

    """

    time_s: FloatArray
    values: FloatArray
    names: tuple[str, ...]
    units: tuple[str, ...]
    method: str
    longest_gap_s: tuple[float, ...]


@dataclass(frozen=True)
class Recording:
    """
    Named signals with units and uneven time, and what is known of how they came about.

    Attributes
    ----------
    channels : 'unit/signal' -> Channel, in the order given
    configuration : the configuration in force at the start, plain data; empty if unknown
    changes : live changes of tuning parameters, in the order of their steps
    sheet : the test sheet; empty if there is none
    notes : anything else that is known, plain data (source, method of resampling, payload ...)

    Raises
    ------
    RecordingError : no such kind of content; the message names the signal or the key

    Examples
    --------
    >>> recording = Recording.from_arrays(
    ...     [0.0, 0.5, 1.0], {'motor_1/current': [0.0, 1.0, 4.0]})
    >>> recording['motor_1/current'].unit
    'A'
    >>> recording.resample(4.0).align().values[:, 0].tolist()
    [0.0, 0.5, 1.0, 2.5, 4.0]

    """

    channels: Mapping[str, Channel]
    configuration: Mapping[str, Any] = field(default_factory=dict)
    changes: tuple[Change, ...] = ()
    sheet: TestSheet = TestSheet()
    notes: Mapping[str, Any] = field(default_factory=dict)

    __hash__ = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        """Check and freeze everything."""
        for name in self.channels:
            check_name(name)
        object.__setattr__(self, 'channels', MappingProxyType(dict(self.channels)))
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
                    units: Mapping[str, str] | None = None, **known: Any) -> Recording:
        """
        Make a recording of arrays that share one time axis, such as those of a run.

        Parameters
        ----------
        time_s
            shape (n,) [s]; rounded to whole nanoseconds
        signals
            name -> values, shape (n,)
        units
            name -> unit, for signals that the drive does not have
        known
            configuration, changes, sheet and notes

        Raises
        ------
        RecordingError : see Channel and Recording; the message names the signal

        """
        stamps = nanoseconds(np.atleast_1d(np.asarray(time_s, dtype=np.float64)))
        channels = {}
        for name, values in signals.items():
            unit = (units or {}).get(name, unit_of(name))
            channels[name] = make_channel(name, unit, stamps, values)
        return cls(channels, **known)

    @classmethod
    def concatenate(cls, parts: Sequence[Recording], period_s: float) -> Recording:
        """
        Lay recordings one after the other, part i at i * period_s: the repeats of an excitation.

        The first part's configuration, sheet and notes are kept; live changes are dropped,
        because their steps would no longer count from the start.

        Raises
        ------
        RecordingError : no part, or a part reaches outside [0, period_s)

        """
        if not parts:
            raise RecordingError('nothing to concatenate')
        period_ns = nanoseconds(period_s)
        for i, part in enumerate(parts):
            if any(len(c) and (c.time_ns[0] < 0 or c.time_ns[-1] >= period_ns)
                   for c in part.channels.values()):
                raise RecordingError(f'part {i} reaches outside its period of {period_s:g} s')
        joined = {}
        for name in parts[0].channels:
            pieces = [(i, part[name]) for i, part in enumerate(parts)]
            joined[name] = Channel(
                pieces[0][1].unit,
                np.concatenate([c.time_ns + i * period_ns for i, c in pieces]),
                np.concatenate([c.values for _, c in pieces]))
        return replace(parts[0], channels=joined, changes=())

    # -- looking at it ------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Channel:
        """
        Return one signal.

        Raises
        ------
        RecordingError : there is no such signal; the message names the nearest one

        """
        try:
            return self.channels[name]
        except KeyError:
            raise RecordingError(f'{name}: no such signal in this recording'
                                 f'{nearest(name, self.channels)}') from None

    def __contains__(self, name: object) -> bool:
        """Tell whether the signal was recorded."""
        return name in self.channels

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the signals."""
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

    def select(self, names: Sequence[str]) -> Recording:
        """
        Return the recording with these signals only, in this order.

        Raises
        ------
        RecordingError : there is no such signal

        """
        return replace(self, channels={name: self[name] for name in names})

    def between(self, start_s: float = -math.inf, end_s: float = math.inf) -> Recording:
        """Return the samples of start_s <= t < end_s, with their time stamps."""
        low = -2**63 if start_s < -9.2e9 else nanoseconds(start_s)
        high = 2**63 - 1 if end_s > 9.2e9 else nanoseconds(end_s)
        return self._cut(low, high)

    def _cut(self, low: int, high: int) -> Recording:
        cut = {}
        for name, channel in self.channels.items():
            first, last = np.searchsorted(channel.time_ns, [low, high])
            cut[name] = Channel(channel.unit, channel.time_ns[first:last],
                                channel.values[first:last])
        return replace(self, channels=cut)

    def shift(self, offset_s: float, names: Sequence[str] | None = None) -> Recording:
        """
        Return the recording with `offset_s` added to the time stamps of `names`, or of all.

        Raises
        ------
        RecordingError : there is no such signal

        """
        return self.shift_ns(nanoseconds(offset_s), names)

    def shift_ns(self, offset_ns: int, names: Sequence[str] | None = None) -> Recording:
        """
        Do as `shift`, by whole nanoseconds: exact where stamps are too long for a double.

        Raises
        ------
        RecordingError : there is no such signal

        """
        moved = dict(self.channels)
        for name in self.names if names is None else names:
            channel = self[name]
            moved[name] = Channel(channel.unit, channel.time_ns + offset_ns, channel.values)
        return replace(self, channels=moved)

    def periods(self, period_s: float, start_s: float = 0.0) -> tuple[Recording, ...]:
        """
        Cut into the whole periods of a repeated excitation, each with its own time from zero.

        Parameters
        ----------
        period_s
            length of a period [s]
        start_s
            where the first period begins [s]; what lies before is left out

        Returns
        -------
        as many recordings as whole periods fit before the last sample

        Raises
        ------
        RecordingError : the period is not positive

        """
        period_ns, start_ns = nanoseconds(period_s), nanoseconds(start_s)
        if period_ns <= 0:
            raise RecordingError(f'a period of {period_s:g} s is not positive')
        # a period sampled at its start and every h after ends one h before the next period
        longest = max((int(np.diff(c.time_ns[-2:])[0]) for c in self.channels.values()
                       if len(c) > 1), default=0)
        count = max(0, (self.end_ns + longest - start_ns) // period_ns)
        begins = [start_ns + i * period_ns for i in range(count)]
        return tuple(self._cut(begin, begin + period_ns).shift_ns(-begin) for begin in begins)

    def repeat(self, count: int, period_s: float) -> Recording:
        """Return this one period `count` times over, see `concatenate`."""
        return Recording.concatenate([self] * count, period_s)

    # -- onto other time stamps ---------------------------------------------------------------

    def common_span_ns(self, names: Sequence[str]) -> tuple[int, int]:
        """
        Return the first and last time at which all of `names` have samples around [ns].

        Raises
        ------
        RecordingError : there is no such signal, it has no sample, or there is no common time

        """
        channels = {name: self[name] for name in names}
        for name, channel in channels.items():
            if not len(channel):
                raise RecordingError(f'{name}: no sample')
        first = max((int(c.time_ns[0]) for c in channels.values()), default=0)
        last = min((int(c.time_ns[-1]) for c in channels.values()), default=-1)
        if last < first:
            raise RecordingError(f'{", ".join(names) or "no signal"}: no common time')
        return first, last

    def align(self, names: Sequence[str] | None = None, onto: str | ArrayLike | None = None,
              method: Method = 'linear') -> Aligned:
        """
        Return several signals on common time stamps.

        Nothing is filtered: thinning to fewer samples folds faster contents down. Nothing is
        extrapolated: only times at which all of `names` have samples around are used.

        Parameters
        ----------
        names
            the signals wanted; all if not given
        onto
            a signal, whose time stamps are used, or an array of times [s]; the first of
            `names` if not given
        method
            one of METHODS

        Raises
        ------
        RecordingError : there is no such signal or method, no common time, or a time given in
            `onto` lies outside the common time

        """
        wanted = tuple(self.names if names is None else names)
        first, last = self.common_span_ns(wanted)
        if onto is None or isinstance(onto, str):
            target = onto if isinstance(onto, str) else wanted[0]
            stamps = self[target].time_ns
            stamps = stamps[(stamps >= first) & (stamps <= last)]
            where = f'the time stamps of {target}'
        else:
            stamps = nanoseconds(np.atleast_1d(np.asarray(onto, dtype=np.float64)))
            where = f'{len(stamps)} given times'
        columns = [self[name].at(stamps, method) for name in wanted]
        gaps = []
        for name in wanted:
            own = self[name].time_ns
            used = own[(own >= first) & (own <= last)]
            gaps.append(float(np.diff(used).max(initial=0)) / NANOSECONDS)
        return Aligned(
            stamps / NANOSECONDS, np.column_stack(columns), wanted,
            tuple(self[name].unit for name in wanted),
            f'{METHODS[method]}, at {where}, unfiltered', tuple(gaps))

    def resample(self, rate_hz: float, method: Method = 'linear',
                 names: Sequence[str] | None = None) -> Recording:
        """
        Return the recording at an even rate, over the time that all its signals share.

        The notes of the result say how it was done, under 'resampled'. Unfiltered, see `align`.

        Raises
        ------
        RecordingError : the rate is not positive or above 1e9 Hz, or see `align`

        """
        if not 0.0 < rate_hz <= 1e9:
            raise RecordingError(f'a rate of {rate_hz:g} Hz is not above 0 and at most 1e9')
        wanted = tuple(self.names if names is None else names)
        first, last = self.common_span_ns(wanted)
        count = int((last - first) / NANOSECONDS * rate_hz + 1e-6) + 1
        stamps = first + np.rint(np.arange(count) * (NANOSECONDS / rate_hz)).astype(np.int64)
        stamps = stamps[stamps <= last]
        channels = {name: Channel(self[name].unit, stamps, self[name].at(stamps, method))
                    for name in wanted}
        how = f'{METHODS[method]}, every 1/{rate_hz:g} s, unfiltered'
        return replace(self, channels=channels, notes={**self.notes, 'resampled': how})


def check_name(name: str) -> None:
    """
    Check that a name can be a ROS 2 topic; the drive's own read 'unit/signal'.

    Raises
    ------
    RecordingError : it cannot

    """
    parts = name.split('/') if isinstance(name, str) else []
    if not parts or not all(part.isascii() and part.isidentifier() for part in parts):
        raise RecordingError(f'{one_line(repr(name))}: no name of a signal, such as '
                             "'motor_1/current', of letters, digits and underscores")


def make_channel(name: str, unit: str, time_ns: ArrayLike, values: ArrayLike) -> Channel:
    """
    Make a channel, and name the signal when its samples are refused.

    Raises
    ------
    RecordingError : see Channel; the message begins with `name`

    """
    try:
        return Channel(unit, time_ns, values)  # type: ignore[arg-type]
    except (RecordingError, TypeError, ValueError) as error:
        raise RecordingError(f'{one_line(name)}: {error}') from None
