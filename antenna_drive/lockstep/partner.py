# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A partner that does not wait: a controller or an amplifier with a clock of its own.

The drive keeps lock-step and the partner does not. A unit of the drive stands in for it: it puts
out the partner's last answer, held, and every answer that it takes is a change at a step. A run
therefore replays from its record, whatever the partner's timing was. Nothing here needs ROS.
"""

from collections.abc import Mapping, Sequence
import math

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.lockstep.delays import Delays
import numpy as np
from simgap.inputs.schema import Entry, Value

# What the outputs do while an answer is overdue.
HOLD, ZERO, STOP = ON_MISS = ('hold', 'zero', 'stop')

ANSWER = 'answer'

# The step that stands in an answer which nobody gave.
NO_STEP = -1

# Steps of which the time of sending is remembered, to measure round trips.
_REMEMBERED = 1024


class PartnerUnit(Unit):
    """
    Stands in the drive for a partner outside of it: puts out its last answer, held.

    Its one setting, `answer`, is the step that was answered and a value of each output.

    seen : what it read in its last step, shape (len(inputs), 2)
    """

    def __init__(self, name: str, outputs: Sequence[Signal], reads: Sequence[str] = ()) -> None:
        """
        Stand in for a unit.

        name, outputs : of the unit that the partner takes the place of
        reads : the signals that the partner is told, 'unit/signal'
        """
        super().__init__(name)
        self.inputs = tuple(reads)  # type: ignore[misc]
        self.outputs = tuple(outputs)  # type: ignore[misc]
        self.seen = np.zeros((len(self.inputs), 2))
        length = 1 + len(self.outputs)
        self._entry = Entry('', description='the step that was answered, a value of each output',
                            live=True, lengths=(length, length))
        self._y = np.zeros((len(self.outputs), 2))
        self._of_step = NO_STEP

    def settings(self) -> Mapping[str, tuple[Entry, Value]]:
        """Return the answer in force."""
        return {ANSWER: (self._entry, (float(self._of_step), *self._y[:, 0].tolist()))}

    def tune(self, changes: Mapping[str, Value]) -> None:
        """Take an answer; see `Unit.tune`."""
        self.check(changes)
        if ANSWER in changes:
            answer = self._entry.check(ANSWER, changes[ANSWER])
            assert isinstance(answer, tuple)
            self._of_step = int(answer[0])
            self._y[:, 0] = answer[1:]

    def memory(self) -> tuple[FloatArray, FloatArray]:
        """Return outputs and what was read, for a compiled loop."""
        return self._y, self.seen

    def start(self, step_s: float) -> FloatArray:
        """Put out zeros until the first answer; see `Unit.start`."""
        self._of_step = NO_STEP
        self._y[:] = 0.0
        self.seen[:] = 0.0
        return self._y.copy()

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Put out the answer in force; see `Unit.step`."""
        self.seen[:] = inputs
        return self._y.copy()


class Answers:
    """
    Keeps account of a partner's answers: their age, when one is overdue, how long it took.

    A miss begins at the first step that is later than the step answered last by more than the
    deadline. It lasts until the next answer. Before its first answer of a run a partner misses
    nothing.

    taken, refused, misses : how many answers were taken and refused, how many misses there were
    overdue_steps : steps made with an overdue answer
    missing : whether the answer in force is overdue
    of_step : the step that was answered last in this run, NO_STEP for none
    age : of the last answer when it was taken [steps]
    round_trips : from the sending of a step to the arrival of its answer [s]
    """

    def __init__(self, values: int, deadline_s: float) -> None:
        """Expect answers of so many values within a deadline [s of simulated time]; 0 is none."""
        self._values = values
        self._deadline_s = deadline_s
        self._deadline = 0.0
        self._run = 0.0
        self._sent_at = np.full(_REMEMBERED, math.nan)
        self._sent_step = np.full(_REMEMBERED, NO_STEP)
        self.taken = self.refused = self.misses = self.overdue_steps = 0
        self.round_trips = Delays()
        self.begin(0.0, 1.0)

    def begin(self, run: float, step_s: float) -> None:
        """Turn to a run with macro-steps of a length [s]."""
        self._run = run
        self._deadline = self._deadline_s / step_s if self._deadline_s else math.inf
        self._sent_step[:] = NO_STEP
        self.missing = False
        self.of_step = NO_STEP
        self.age = 0
        self._missed_at = 0

    def sent(self, step: int, now: float) -> None:
        """Note that the partner was told of a step at `now` [s]."""
        self._sent_at[step % _REMEMBERED] = now
        self._sent_step[step % _REMEMBERED] = step

    def receive(self, message: Sequence[float], step: int, now: float) -> tuple[float, ...] | None:
        """
        Take in a message of the partner: run, step that it answers, a value of each output.

        message : whatever has come
        step, now : the step that the drive is at, and the time [s]

        Returns the answer, for the unit's setting; None if the message is refused and counted:
        wrong length, not finite, of another run, of no step that was sent, older than the last.
        """
        if (len(message) != 2 + self._values or not all(map(math.isfinite, message))
                or message[0] != self._run or message[1] % 1.0 != 0.0
                or not max(0, self.of_step) <= message[1] <= step):
            self.refused += 1
            return None
        place = int(message[1]) % _REMEMBERED
        if self._sent_step[place] == message[1]:
            self.round_trips.note(now - self._sent_at[place])
        return tuple(message[1:])

    def take(self, of_step: int, step: int) -> None:
        """Note that an answer to a step takes effect at `step`."""
        self.taken += 1
        if self.missing:
            self.overdue_steps += step - self._missed_at
        self.missing = False
        self.of_step = of_step
        self.age = step - of_step

    @property
    def due_step(self) -> int | None:
        """Return the step at which the answer in force becomes overdue, None if none does."""
        if self.of_step == NO_STEP or self.missing or math.isinf(self._deadline):
            return None
        return self.of_step + math.floor(self._deadline + 1e-9) + 1

    def missed(self, step: int) -> bool:
        """Tell whether a miss begins at `step`, and count it."""
        due = self.due_step
        if due is None or step < due:
            return False
        self.missing = True
        self.misses += 1
        self._missed_at = step
        return True

    def overdue(self, step: int) -> int:
        """Return how many steps were made with an overdue answer up to `step`."""
        return self.overdue_steps + (step - self._missed_at if self.missing else 0)
