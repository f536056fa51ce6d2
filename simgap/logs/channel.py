# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The samples of one signal, each with its own time stamp in whole nanoseconds, as in MCAP."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from simgap.errors import one_line, UserError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
NANOSECONDS = 1_000_000_000


class RecordingError(UserError, ValueError):
    """A recording cannot be made, read or written as asked; one line says where and why."""


class RecordingWarning(UserWarning):
    """A recording was read, but something about it must be known; one line says what."""


def nanoseconds(seconds: ArrayLike) -> Any:
    """Return seconds as nanoseconds; RecordingError if not finite or beyond 64 bits."""
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
    """The samples of one signal: time_ns rises, values are finite, or RecordingError is raised."""

    unit: str  # SI unit; '' if unknown
    time_ns: IntArray  # shape (n,), int64 [ns]
    values: FloatArray  # shape (n,), float64 [unit]

    def __post_init__(self) -> None:
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
        return len(self.values)

    def __eq__(self, other: object) -> bool:
        """Compare to the last bit: 0.0 and -0.0 differ."""
        return (isinstance(other, Channel) and self.unit == other.unit
                and np.array_equal(self.time_ns, other.time_ns)
                and self.values.tobytes() == other.values.tobytes())

    @property
    def time_s(self) -> FloatArray:
        """Return the time stamps in seconds, each the nearest double; shape (n,)."""
        return self.time_ns / NANOSECONDS

    def at(self, time_ns: IntArray) -> FloatArray:
        """Return values [unit] on straight lines at times [ns], (m,); RecordingError outside."""
        if len(time_ns) == 0:
            return np.empty(0)
        if not len(self) or time_ns.min() < self.time_ns[0] or time_ns.max() > self.time_ns[-1]:
            raise RecordingError('a time lies outside the samples; nothing is extrapolated')
        before = np.searchsorted(self.time_ns, time_ns, side='right') - 1
        after = np.minimum(before + 1, len(self) - 1)
        # differences of whole nanoseconds are exact however large the stamps are
        past = (time_ns - self.time_ns[before]).astype(np.float64)
        width = (self.time_ns[after] - self.time_ns[before]).astype(np.float64)
        share = np.divide(past, width, out=np.zeros_like(past), where=width > 0)
        return (1.0 - share) * self.values[before] + share * self.values[after]


def check_name(name: str) -> None:
    """Raise RecordingError if a name cannot be a ROS 2 topic: words, slashes between them."""
    parts = name.split('/') if isinstance(name, str) else []
    if not parts or not all(part.isascii() and part.isidentifier() for part in parts):
        raise RecordingError(f'{one_line(repr(name))}: no name of a signal, such as '
                             "'motor/current', of letters, digits and underscores")


def make_channel(name: str, unit: str, time_ns: ArrayLike, values: ArrayLike) -> Channel:
    """Make a channel; RecordingError, as of Channel, begins with its name."""
    try:
        return Channel(unit, time_ns, values)  # type: ignore[arg-type]
    except (RecordingError, TypeError, ValueError) as error:
        raise RecordingError(f'{one_line(name)}: {error}') from None
