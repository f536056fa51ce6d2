# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The protocol of the unit that owns a run: when it begins, goes on, and ends."""

from collections.abc import Collection, Mapping, Sequence

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep.frame import LATEST_BIRTH, NO_RUN, SENDER
from antenna_drive.lockstep.inbox import DEPTH, Frame, Refusal
from antenna_drive.lockstep.member import DECEIVED_STANDSTILL_S, Member, MEMORY

# How far an observer may fall behind: half of what each node remembers.
SLACK = MEMORY // 2

# Progress of an observer that has not begun the run: it is waited for before the first step, as
# it could not keep what it gets of a run that it has yet to begin.
_NOT_BEGUN = -1.0

# A last step that no run comes to.
NEVER = 2**62


class Conductor(Member):
    """
    The member that owns the run: its id, its macro-step, its beginning and its end.

    It begins a run when it has heard from every other member, publishes step k + 1 only when
    it holds step k of every one, and begins afresh when one of them says hello and makes no more
    steps: that is a node that was started again. So it does when a member, or an observer that
    it waits for, has left for another run, which somebody invented. Observers are waited for
    too, at step 0 but not at every step: they may read in bulk, as long as they stay within what
    the others remember.
    """

    def __init__(self, unit: Unit, birth: float, step_s: float, last_step: int | None = None,
                 outputs: Mapping[str, Sequence[Signal]] = OUTPUTS,
                 observers: Collection[str] = ()) -> None:
        """
        Prepare to conduct every unit in `outputs` and the observers named.

        unit, birth, outputs : see Member
        step_s : length of the macro-step [s]
        last_step : the step at which a run ends; None for a run without end
        observers : further members, which read the drive and say now and then how far they are
        """
        members = [name for name in outputs if name != unit.name]
        super().__init__(unit, birth, outputs, unit.name, (*members, *observers), observers)
        self.wanted_step_s = step_s
        self.last_step = last_step
        self.ended = False
        self.used = dict.fromkeys(observers, _NOT_BEGUN)
        self._heard: dict[str, float] = {}
        self._begin_again = True
        # Our step when a member said hello, or last spoke of another run.
        self._hello_at: dict[str, int] = {}
        self._elsewhere_at: dict[str, int] = {}
        # How far an observer was that then spoke of another run.
        self._strayed_at: dict[str, float] = {}

    def receive(self, peer: str, frame: Frame) -> None:
        """Take in a frame or refuse it; note who is there."""
        if not self._well_formed(peer, frame):
            return
        if self.run == NO_RUN:
            self._heard.setdefault(peer, 0.0)
            self._hear(peer, frame)
            self.inbox.forget(frame[0])
        elif frame[0] not in (NO_RUN, self.run) and not self.inbox.is_over(frame[0]):
            # nobody but the conductor makes runs
            self.inbox.refuse(peer, Refusal.WRONG_RUN)
            self._hear(peer, frame)
            if peer in self.used:
                self._strayed_at[peer] = self.used[peer]
            else:
                self._elsewhere_at[peer] = self.step
        elif peer in self.used and frame[0] == self.run:
            if self.inbox.speaks_for(peer, frame):
                self.inbox.senders[peer] = frame[SENDER]
                self.used[peer] = max(self.used[peer], frame[1])
        else:
            self.inbox.offer(peer, frame)
            for name, birth in self.inbox.hellos:
                self._heard[name] = max(self._heard[name], birth)
                if name in self.used or self.ended or self.fault:
                    self._begin_again = True
                if self._went_on_after_hello(name):
                    self._deceived_at = self.step
                self._hello_at[name] = self.step
            self.inbox.hellos.clear()

    def _hear(self, peer: str, frame: Frame) -> None:
        # A run beyond every birth is an invention, and no measure for runs to come.
        known = frame[1] if frame[0] == NO_RUN else frame[0]
        if known < LATEST_BIRTH:
            self._heard[peer] = max(self._heard[peer], known)

    def _went_on_after_hello(self, name: str) -> bool:
        """Tell whether a hello in a member's name was false, in the last MEMORY steps."""
        return DEPTH < self.step - self._hello_at.get(name, self.step) <= MEMORY

    @property
    def patience_s(self) -> float:
        """Return how long the run must stand still before somebody is believed to be gone [s]."""
        false = any(map(self._went_on_after_hello, self._hello_at))
        observers_alone = bool(self.used) and not self.inbox.missing()
        return DECEIVED_STANDSTILL_S if false or observers_alone else super().patience_s

    def _left(self, at: Mapping[str, int], peers: Collection[str]) -> bool:
        """Tell whether one of the peers has gone since: whoever goes on was spoken for."""
        return any(peer in at and self.step - at[peer] <= DEPTH for peer in peers)

    def unheard(self) -> tuple[str, ...]:
        """Return the members that have not been heard of yet."""
        return tuple(peer for peer in self.peers if peer not in self._heard)

    def wanted(self) -> tuple[str, ...]:
        """Return the members from whom a frame would be of use now."""
        if self.run == NO_RUN or self.ended:
            return self.peers
        missing = self.missing()
        # one whose frame of this step is here may say hello: it was killed after it
        return *missing, *(peer for peer in self.peers
                           if peer not in missing and self.inbox.has_room(peer))

    def missing(self) -> tuple[str, ...]:
        """Return the members without whom the next step cannot be made."""
        if self.run == NO_RUN:
            return self.unheard()
        missing = self.inbox.missing()
        if self.used:
            missing += self._behind()
        return missing

    def _behind(self) -> tuple[str, ...]:
        """Return the observers that have to catch up before the next step."""
        least = max(0, self.step - SLACK)
        if self.last_step is not None and self.step > self.last_step:
            least = self.step
        return tuple(name for name, used in self.used.items() if used < least)

    def farthest(self) -> int:
        """Return the last step that can be made before an observer, or the run's end, is due."""
        ends = [*(used + SLACK + 1 if used >= 0.0 else 0.0 for used in self.used.values()),
                *([] if self.last_step is None else [self.last_step])]
        return int(min(ends, default=NEVER))

    def steady(self) -> bool:
        """Return whether nothing is due but the next steps of the run in progress."""
        return (super().steady() and not self.ended and not self._begin_again
                and (self.last_step is None or self.step < self.last_step))

    def new_run(self, now: float, stands_still: bool = False) -> FloatArray | None:
        """
        Begin a run if one is due and everybody is there.

        now : wall time [us]; the run's id, unless somebody was born later by his own clock
        stands_still : whether the run in progress has made no step for `patience_s`: only then is
            a member that said hello, or speaks of another run, believed to be gone

        Returns an array of shape (len(outputs), 2), to be published as frame 0; None if no run is
        due.
        """
        if stands_still and self._somebody_left():
            self._begin_again = True
        if not self._begin_again or self.unheard():
            return None
        self._begin_again = False
        self._hello_at.clear()
        self._elsewhere_at.clear()
        self._strayed_at.clear()
        self.ended = False
        self.used = dict.fromkeys(self.used, _NOT_BEGUN)
        run = max(float(int(now)), self.birth + 1.0, self.run + 1.0,
                  *(heard + 1.0 for heard in self._heard.values()))
        return self._begin(run, self.wanted_step_s)

    def _somebody_left(self) -> bool:
        missing = () if self.run == NO_RUN or self.ended else self.inbox.missing()
        behind = self._behind()
        # The last frames of a killed member may have reached us and not those who now wait for
        # them, members or observers: then they are missing, and it is not.
        return (bool(missing or behind) and self._left(self._hello_at, self.peers)
                or self._left(self._elsewhere_at, missing)
                or any(self._strayed_at.get(name) == self.used[name] for name in behind))

    def hello(self) -> bytes:
        """Return the serialised message that no run is in progress, and which has just ended."""
        return self.layout.hello(self.birth, self.sender, self.run)

    def begin_again(self) -> None:
        """Leave the run in progress, if any, for a new one."""
        self._begin_again = True

    def go_on(self, stands_still: bool = True) -> FloatArray | None:
        """Make the next step if every member has made the last, and the run has not ended."""
        if self.run == NO_RUN or self.fault or self.ended or self._begin_again:
            return None
        if self.missing():
            return None
        if self.last_step is not None and self.step >= self.last_step:
            # Whoever holds the last step makes one more: by this we know that all have used it.
            if self.step == self.last_step:
                self.inbox.advance()
                self.step += 1
            else:
                self.ended = True
            return None
        return self._advance()
