# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A partner on the topics: what the drive tells it, and what it answers.

The node in whose place it works publishes `<node>/partner_inputs`, and takes `<node>/answer`.
Both are std_msgs/Float64MultiArray: [run, step, macro-step, value of each input] and [run, step
that is answered, value of each output].
"""

from collections.abc import Callable
import time

from antenna_drive.lockstep.member import Member
from antenna_drive.lockstep.partner import Answers, NO_STEP, PartnerUnit, STOP, ZERO
from antenna_drive.lockstep.readings import READING_QOS, steps_between
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

Answer = tuple[float, ...]

# Misses are told in the log no more often than this [s]; all are counted.
_QUIET_S = 1.0


class PartnerLink:
    """What a node and its partner tell each other."""

    def __init__(self, node: Node, member: Member, unit: PartnerUnit, rate_hz: float,
                 deadline_s: float, on_miss: str, reached: Callable[[], int],
                 ask: Callable[[Answer], str], force: Callable[[Answer], None]) -> None:
        """
        Offer the topics.

        node, member, unit : in whose place the partner works
        rate_hz : how often per simulated second the partner is told its inputs
        deadline_s, on_miss : how old the step that was answered last may be [s of simulated time],
            0 for any age, and what the outputs do when it is older, one of `partner.ON_MISS`
        reached : returns the step that the node is at, to any thread
        ask : asks from another thread for an answer to be put in force
        force : puts an answer in force at once, in the lock-step's thread
        """
        self._node = node
        self._member = member
        self._unit = unit
        self._rate_hz = rate_hz
        self._deadline_s = deadline_s
        self._on_miss = on_miss
        self._reached = reached
        self._ask = ask
        self._force = force
        self._every = 1
        self._told_s = -_QUIET_S
        self.answers = Answers(len(unit.outputs), deadline_s)
        name = node.get_name()
        self._topic = node.create_publisher(
            Float64MultiArray, f'{name}/partner_inputs', READING_QOS)
        self._message = Float64MultiArray()
        self._message.layout.dim = [MultiArrayDimension(
            label=', '.join(('run', 'step', 'step_s', *unit.inputs)),
            size=3 + len(unit.inputs), stride=3 + len(unit.inputs))]
        node.create_subscription(Float64MultiArray, f'{name}/answer', self._receive, READING_QOS)

    def _receive(self, message: Float64MultiArray) -> None:
        # in the thread that serves the node
        answer = self.answers.receive(message.data, self._reached(), time.monotonic())
        if answer is not None and self._ask(answer):
            self.answers.refused += 1

    def begin(self) -> None:
        """Turn to the run that begins."""
        member = self._member
        self._every = steps_between(self._rate_hz, member.step_s)
        self.answers.begin(member.run, member.step_s)

    def took(self, answer: Answer) -> None:
        """Note that an answer has been put in force at the step that the drive is at."""
        # one that was on its way as the run began answers a step of the run before
        step = self._member.step
        self.answers.take(min(int(answer[0]), step), step)

    def next_step(self) -> int:
        """Return the next step after which `stepped` has something to do."""
        step = self._member.step
        telling = step + self._every - (step - 1) % self._every
        due = self.answers.due_step
        return telling if due is None else max(step + 1, min(telling, due))

    def stepped(self) -> None:
        """After a step, tell the partner its inputs if that is due, and look for a miss."""
        member = self._member
        # what the unit has read for this step is of the step before
        of_step = member.step - 1
        if of_step >= 0 and of_step % self._every == 0:
            self._message.data = [member.run, float(of_step), member.step_s,
                                  *self._unit.seen[:, 0].tolist()]
            self.answers.sent(of_step, time.monotonic())
            self._topic.publish(self._message)
        if self.answers.missed(member.step):
            self._miss()

    def _miss(self) -> None:
        member, answers = self._member, self.answers
        why = f'no answer of the partner within {self._deadline_s:g} s'
        if self._on_miss == ZERO:
            self._force((float(NO_STEP), *[0.0] * len(self._unit.outputs)))
        elif self._on_miss == STOP:
            member.fault = f'{self._unit.name}: {why} at step {member.step}'
        now = time.monotonic()
        if now - self._told_s >= _QUIET_S:
            self._told_s = now
            self._node.get_logger().warning(
                f'{why} at step {member.step}: {self._on_miss}; {answers.misses} misses so far')

    def trouble(self) -> str:
        """Say what is wrong with the partner now, '' for nothing."""
        answers = self.answers
        if self._member.run and answers.of_step == NO_STEP:
            return 'no answer of the partner yet'
        if answers.missing:
            return (f'the partner is overdue since it answered step {answers.of_step}: '
                    f'{self._on_miss}')
        return ''

    def values(self) -> list[tuple[str, str]]:
        """Return what /diagnostics says of the partner."""
        answers = self.answers
        return [
            ('answers', str(answers.taken)), ('answers refused', str(answers.refused)),
            ('answered step', str(answers.of_step)),
            ('age of the answer [steps]', str(answers.age)), ('misses', str(answers.misses)),
            ('steps overdue', str(answers.overdue(self._member.step))),
            *answers.round_trips.values('round trip')]

    def summary(self) -> str:
        """Say in words how the partner kept its deadline."""
        answers = self.answers
        took = f', round trip {answers.round_trips}' if str(answers.round_trips) else ''
        return (f'the partner gave {answers.taken} answers{took}; {answers.misses} misses, '
                f'{answers.overdue(self._member.step)} steps overdue')
