# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""When each step of a run is due: k times real time, or as soon as possible."""

from antenna_drive.lockstep.delays import Delays

# No one at a screen sees a drive ahead of the clock by so much [s]; a process that has to wait
# for a core mostly waits less.
LEAD_S = 0.02


class Pace:
    """
    The timetable of a run on a clock that the caller reads.

    It begins with the first step that is noted: how long the nodes took to get there is no
    lateness. Step k is due at start + k * step_s / factor: nothing adds up, so nothing drifts. It
    may be made `lead_s` earlier, so that a process which has to wait for the machine makes none
    late. A step that comes late is counted and made all the same; the next ones catch up.

    begun : whether the timetable has begun
    factor : how many times faster than real time; 0 for as fast as possible
    lead_s : how long before it is due a step may be made [s]
    late_steps : steps of this run that came more than one step's time after they were due
    worst_s : how long after it was due the latest of them came [s]
    delays : of each step of this run, from when it may be made until it is made
    """

    def __init__(self, factor: float, lead_s: float = 0.0) -> None:
        self.factor = factor
        self.lead_s = lead_s
        self.delays = Delays()
        self.begin()

    def begin(self) -> None:
        """Begin a run: its timetable begins with the next step that is noted."""
        self.late_steps = 0
        self.worst_s = 0.0
        self.delays.clear()
        self.begun = False
        self._start = 0.0
        self._first_step = 0

    def change(self, factor: float, now: float, step: int) -> None:
        """Go on at another pace from `step`, which is made at `now` [s]."""
        self.factor = factor
        if self.begun:
            self._anchor(step, now)

    def _anchor(self, step: int, now: float) -> None:
        self.begun = True
        self._start = now
        self._first_step = step

    @property
    def timetable(self) -> tuple[float, int]:
        """Return when the timetable began on the caller's clock [s], and with which step."""
        return self._start, self._first_step

    def due(self, step: int, step_s: float) -> float:
        """Return when `step` is due at this pace, which is not 0, on the caller's clock [s]."""
        return self._start + (step - self._first_step) * step_s / self.factor

    def remaining(self, step: int, step_s: float, now: float) -> float:
        """Return how long it is until `step` may be made [s], zero or less if it may."""
        if self.factor == 0.0 or not self.begun:
            return 0.0
        return self.due(step, step_s) - self.lead_s - now

    def note(self, step: int, step_s: float, now: float) -> None:
        """Note that `step` was made at `now`: the first begins the timetable, late ones count."""
        if not self.begun:
            self._anchor(step, now)
        elif self.factor > 0.0:
            after_s = now - self.due(step, step_s)
            self.delays.note(after_s + self.lead_s)
            if after_s > step_s / self.factor:
                self.add_late(1, after_s)

    def add_late(self, steps: int, worst_s: float) -> None:
        """Count steps that came late, the latest of them by so much [s]."""
        self.late_steps += steps
        self.worst_s = max(self.worst_s, worst_s)

    def summary(self) -> str:
        """Say in words how the steps of this run kept the timetable, '' if they had none."""
        if not str(self.delays):
            return ''
        late = f'{self.late_steps} late'
        if self.late_steps:
            late += f' by up to {1e3 * self.worst_s:.3g} ms'
        return f'delay of a step {self.delays}; {late}'
