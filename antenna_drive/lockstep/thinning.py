# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Every n-th step of some units, put together from frames that are taken in bulk.

This is what a reader needs that nobody waits for and that publishes at a lower rate than that of
the steps. Nothing here needs ROS.
"""

from collections.abc import Sequence
from typing import NamedTuple

from antenna_drive.lockstep.frame import HEADER, LARGEST_RUN, NO_RUN, SENDER
from antenna_drive.physics.arrays import FloatArray
import numpy as np

# Units are a few steps apart. More steps than this that lack a unit are not genuine.
_MOST_INCOMPLETE = 4096


class Thinned(NamedTuple):
    """One step of all units that are read."""

    run: int
    step: int  # its number
    step_s: float  # macro-step [s]
    values: dict[str, FloatArray]  # by unit, the value of each of its signals, shape (signals,)

    @property
    def time_ns(self) -> int:
        """Return the simulated time of the step [ns], rounded as on `clock`."""
        return round(self.step * self.step_s * 1e9)


class Thinning:
    """Takes the frames of units in any portions; returns the steps that are due."""

    def __init__(self, units: Sequence[str], rate_hz: float) -> None:
        """
        Begin with no step.

        units : whose frames make a step complete
        rate_hz : how many steps for each simulated second; the nearest that the macro-step allows,
            and at most every step
        """
        self._units = tuple(units)
        self._rate_hz = rate_hz
        self._incomplete: dict[tuple[int, int], dict[str, FloatArray]] = {}
        self._senders: dict[tuple[str, int], float] = {}
        self._last = (0, -1)

    def take(self, unit: str, frames: FloatArray) -> None:
        """
        Take frames of a unit.

        unit : that sent them
        frames : rows of a `FrameLayout`; rows that are no frame of a run are left out, and those
            of a second node of the unit's name
        """
        frames = frames[np.isfinite(frames).all(axis=1)]
        run, step, step_s, _ = frames[:, :len(HEADER)].T
        frames = frames[(run > NO_RUN) & (run < LARGEST_RUN) & (run % 1.0 == 0.0)
                        & (step >= 0.0) & (step < LARGEST_RUN) & (step_s > 0.0)]
        _, step, step_s, _ = frames[:, :len(HEADER)].T
        every = np.maximum(1.0, np.round(1.0 / (self._rate_hz * step_s)))
        for frame in frames[step % every == 0.0]:
            key = int(frame[0]), int(frame[1])
            sender = self._senders.setdefault((unit, key[0]), float(frame[SENDER]))
            if key > self._last and sender == frame[SENDER]:
                self._incomplete.setdefault(key, {}).setdefault(unit, frame)
        for key in sorted(self._incomplete)[:-_MOST_INCOMPLETE]:
            del self._incomplete[key]
        for known in list(self._senders)[:-_MOST_INCOMPLETE]:
            del self._senders[known]

    def complete(self) -> list[Thinned]:
        """Return the steps that are complete now, each once and in order."""
        found = []
        for key in sorted(self._incomplete):
            frames = self._incomplete[key]
            if len(frames) == len(self._units):
                step_s = float(frames[self._units[0]][HEADER.index('step_s')])
                found.append(Thinned(*key, step_s, {
                    unit: frame[len(HEADER)::2] for unit, frame in frames.items()}))
                self._last = key
        # each unit sends in order: what lacks a unit before a complete step stays so
        self._incomplete = {key: frames for key, frames in self._incomplete.items()
                            if key > self._last}
        return found
