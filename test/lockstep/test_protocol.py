# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The protocol without ROS: five members and a network that delivers as it pleases.

Whatever the network does (any order between peers, delay, foreign frames), a run must be the
same as the plain loop that the test writes out itself.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Sequence
import math
from pathlib import Path

from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.lockstep import compiled_loop
from antenna_drive.lockstep.compiled_unit import CompiledForm, FORMS
from antenna_drive.lockstep.conductor import Conductor, SLACK
from antenna_drive.lockstep.exchange import Exchange
from antenna_drive.lockstep.inbox import DEPTH, Inbox, Refusal
from antenna_drive.lockstep.member import (
    DECEIVED_STANDSTILL_S, Member, MEMORY, STANDSTILL_S,
)
from hypothesis import example, given, settings, strategies as st
from memory_channel import MemoryChannel
import numpy as np
import pytest
from simgap.laws.compiling import inner

UNITS = ('test_signal', 'motor_1', 'motor_2', 'torque_share', 'plant')
OUTPUTS = {name: (Signal('a', 'rad', ''), Signal('b', 'V', '')) for name in UNITS}
# who reads whom: chains, rings, both motors, itself
INPUTS = {
    'test_signal': (),
    'motor_1': ('test_signal/a', 'plant/b', 'torque_share/a'),
    'motor_2': ('plant/b', 'test_signal/b'),
    'torque_share': ('motor_1/a', 'motor_2/b'),
    'plant': ('motor_1/b', 'motor_2/a', 'plant/a'),
}
# which units have a compiled exchange: none, all, any
some = st.one_of(st.just(frozenset(UNITS)), st.frozensets(st.sampled_from(UNITS)))
none_some_all = pytest.mark.parametrize('in_loops', [(), ('test_signal', 'plant'), UNITS])


class Chaotic(Unit):
    """A unit whose every bit depends on every input it ever had."""

    outputs = OUTPUTS['plant']

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.inputs = INPUTS[name]  # type: ignore[misc]
        self.x = np.zeros((2, 2))
        self.broken_at = np.array([-1])  # the step after which it puts out NaN

    def start(self, step_s: float) -> FloatArray:
        self.x[:] = 0.1 + 0.1 * UNITS.index(self.name)
        self.step_s = step_s
        return self.x.copy()

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        drive = float(inputs.sum()) + k * self.step_s
        self.x[:] = 3.7 * self.x * (1.0 - self.x) * 0.9 + 1e-3 * math.sin(drive)
        if k == self.broken_at[0]:
            self.x[1, 0] = math.nan
        return self.x.copy()


@inner
def advance(k: int, h: float, u: FloatArray, y: FloatArray, memory: tuple[FloatArray]) -> None:
    """Do in compiled code what Chaotic.step does."""
    drive = 0.0
    for row in range(u.shape[0]):
        drive += u[row, 0]
        drive += u[row, 1]
    drive += k * h
    for row in range(2):
        for column in range(2):
            x = y[row, column]
            y[row, column] = 3.7 * x * (1.0 - x) * 0.9 + 1e-3 * math.sin(drive)
    if k == memory[0][0]:
        y[1, 0] = math.nan


FORMS[Chaotic] = lambda unit: CompiledForm(
    'chaotic', advance, lambda step_s: (unit.broken_at,), unit.x, lambda step: None,
    Path(__file__).resolve().parent)


def expected(steps: int, step_s: float) -> dict[str, list[FloatArray]]:
    """Run the units in one plain loop: the law that the protocol has to keep."""
    units = {name: Chaotic(name) for name in UNITS}
    history = {name: [unit.start(step_s)] for name, unit in units.items()}
    for k in range(steps):
        now = {f'{name}/{signal.name}': history[name][k][row]
               for name in UNITS for row, signal in enumerate(OUTPUTS[name])}
        for name, unit in units.items():
            inputs = np.array([now[source] for source in unit.inputs]).reshape(-1, 2)
            history[name].append(unit.step(k, inputs))
    return history


class Network:
    """
    Members and the frames between them; `choose` decides what happens next.

    Those `in_loops` have a compiled exchange, the others make every step in Python.
    """

    def __init__(self, in_loops: Collection[str], step_s: float = 1e-3,
                 last_step: int | None = None) -> None:
        self.in_loops = in_loops
        self.exchanges: dict[str, Exchange] = {}
        self.channels: dict[str, MemoryChannel] = {}
        self.members: dict[str, Member] = {}
        self.queues: dict[tuple[str, str], deque[tuple[float, ...]]] = {}
        self.sent: dict[tuple[str, float], list[FloatArray]] = {}
        self.clock = 1000.0
        self.step_s = step_s
        self.last_step = last_step
        self.quiet = True  # nothing has come to the conductor for a while
        self.stands_still = True  # as each member sees it

    def start(self, name: str) -> None:
        """Start a node, or start it again after it was killed."""
        self.clock += 1.0
        unit = Chaotic(name)
        if name == 'test_signal':
            self.members[name] = Conductor(unit, self.clock, self.step_s, self.last_step, OUTPUTS)
        else:
            self.members[name] = Member(unit, self.clock, OUTPUTS)
        if name in self.in_loops:
            self._compile(name)
        for other in UNITS:
            self.queues[other, name] = deque()
            # a new reader gets what a living writer remembers: here, its last frames
            self.queues[name, other] = self.queues.get((name, other), deque())
        self.publish(name, (0.0, self.clock, 0.0, self.members[name].sender, *[0.0] * 4))

    def _compile(self, name: str) -> None:
        member = self.members[name]
        channel = self.channels[name] = MemoryChannel(
            member.layout, member.layouts, lambda frame: self._sent_by_loop(name, frame))
        self.exchanges[name] = Exchange(member, FORMS[Chaotic](member.unit), channel)

    def _sent_by_loop(self, name: str, frame: tuple[float, ...]) -> None:
        self.sent[name, frame[0]].append(np.array(frame[4:]).reshape(2, 2))
        assert len(self.sent[name, frame[0]]) == frame[1] + 1
        assert frame[2:4] == (self.step_s, self.members[name].sender)
        self.publish(name, frame)

    def publish(self, name: str, frame: tuple[float, ...]) -> None:
        for other in UNITS:
            if other in self.members and other != name:
                self.queues[name, other].append(frame)

    def hello_to_late(self) -> None:
        """Let everybody hear everybody's hello, as transient-local topics do."""
        for name, member in self.members.items():
            for other in self.members:
                if other != name:
                    self.queues[name, other].append(
                        (0.0, member.birth, 0.0, member.sender, *[0.0] * 4))

    def deliver(self, source: str, target: str) -> None:
        queue = self.queues.get((source, target))
        member = self.members.get(target)
        if member is None or source not in member.peers:
            return
        if target in self.channels:
            if queue:
                self.channels[target].arrived[source].append(queue.popleft())
            self._receive_arrived(target, source)
        elif queue and source in member.wanted():
            member.receive(source, queue.popleft())

    def _receive_arrived(self, target: str, source: str) -> None:
        """Let Python take a frame that has arrived, where the loop does not."""
        member, arrived = self.members[target], self.channels[target].arrived[source]
        if arrived and not member.steady() and source in member.wanted():
            member.receive(source, arrived.popleft())

    def attack(self, source: str, target: str, frame: tuple[float, ...]) -> None:
        """Let a frame that is none of ours come in."""
        if target in self.channels and self.members[target].steady():
            self.channels[target].arrived[source].append(frame)
        else:
            self.members[target].receive(source, frame)

    def act(self, name: str) -> None:
        member = self.members.get(name)
        if member is None:
            return
        if name in self.exchanges and self._run_loop(name):
            return
        outputs = None
        if isinstance(member, Conductor) and self.quiet and not self._has_arrived(name):
            self.clock += 1.0
            outputs = member.new_run(self.clock, self.stands_still)
        if outputs is None:
            outputs = member.go_on(self.stands_still)
        if outputs is not None:
            self.sent.setdefault((name, member.run), []).append(outputs.copy())
            assert len(self.sent[name, member.run]) == member.step + 1
            self.publish(name, (member.run, float(member.step), member.step_s, member.sender,
                                *outputs.ravel().tolist()))

    def _has_arrived(self, name: str) -> bool:
        """Tell whether a member with a loop could take a frame: then it is not quiet."""
        return name in self.channels and any(
            self.channels[name].arrived[source] for source in self.members[name].wanted())

    def _run_loop(self, name: str) -> bool:
        """Do what a node does with its loop until it is quiet; tell whether it made a step."""
        member, arrived = self.members[name], self.channels[name].arrived
        while member.steady():
            self.exchanges[name].pauses = [member.step + 1]
            reason = self.exchanges[name].run(limit_s=60.0)
            if reason == compiled_loop.STEPPED:
                return True
            if reason == compiled_loop.MISSING:
                ready = [source for source in member.wanted() if arrived[source]]
                for source in ready:
                    member.receive(source, arrived[source].popleft())
                if not ready:
                    break
            elif reason != compiled_loop.FOREIGN:
                break
        return False

    def settle(self, rounds: int) -> None:
        """Deliver and act in a fair order until `rounds` are over."""
        for _ in range(rounds):
            for target in UNITS:
                for source in UNITS:
                    self.deliver(source, target)
                self.act(target)

    def run_of(self, name: str) -> list[FloatArray]:
        return self.sent[name, self.members[name].run]


moves = st.lists(st.tuples(st.sampled_from(UNITS), st.sampled_from(UNITS), st.booleans()),
                 max_size=300)


def shake(network: Network, choices: Sequence[tuple[str, str, bool]]) -> None:
    for source, target, act in choices:
        if act:
            network.act(target)
        else:
            network.deliver(source, target)


def assert_as_expected(network: Network, at_least: int) -> None:
    for name in UNITS:
        frames = network.run_of(name)
        assert len(frames) > at_least
        law = expected(len(frames) - 1, network.step_s)[name]
        assert all(got.tobytes() == want.tobytes() for got, want in zip(frames, law))


@settings(deadline=None, max_examples=60)
@given(some, st.permutations(UNITS), moves)
def test_any_order_of_start_and_delivery_gives_the_same_bits(
        in_loops: Collection[str], order: list[str], choices: list[tuple[str, str, bool]]) -> None:
    network = Network(in_loops)
    for name in order:
        network.start(name)
    network.hello_to_late()
    shake(network, choices)
    network.settle(80)
    assert_as_expected(network, at_least=10)
    for member in network.members.values():
        assert not set(member.inbox.refused) - {
            (peer, Refusal.DUPLICATE) for peer in UNITS}


# the last frame of the killed motor_2 reaches the conductor, and not those who wait for it
@example(frozenset(UNITS) - {'torque_share'}, 'motor_2', [('motor_2', 'test_signal', False)], [])
@settings(deadline=None, max_examples=60)
@given(some, st.sampled_from(UNITS), moves, moves)
def test_a_node_started_again_lets_everybody_start_afresh(
        in_loops: Collection[str], victim: str, before: list[tuple[str, str, bool]],
        after: list[tuple[str, str, bool]]) -> None:
    network = Network(in_loops)
    for name in UNITS:
        network.start(name)
    network.hello_to_late()
    network.settle(40)
    shake(network, before)
    first_run = network.members['plant'].run
    for key in [key for key in network.queues if key[0] == victim]:
        network.queues[key].clear()  # what the dead had not sent yet
    network.start(victim)
    if victim == 'test_signal':
        network.hello_to_late()
    shake(network, after)
    network.settle(80)
    runs = {member.run for member in network.members.values()}
    assert len(runs) == 1
    assert runs.pop() > first_run
    assert_as_expected(network, at_least=10)


foreign = st.tuples(
    st.one_of(st.sampled_from([math.nan, math.inf, -1.0, 3.0, 0.5, 1e300]),
              st.integers(1, 2000).map(float)),
    st.one_of(st.sampled_from([math.nan, -1.0, 0.5, 1e18]), st.integers(0, 60).map(float)),
    st.floats())


@settings(deadline=None, max_examples=100)
@given(some, st.lists(st.tuples(st.sampled_from(UNITS[1:]), st.sampled_from(UNITS),
                                foreign, st.sampled_from([0, 4, 8, 9])), max_size=40))
def test_foreign_frames_change_nothing_and_are_counted(
        in_loops: Collection[str], attacks: list[tuple[str, str, tuple[float, ...], int]]) -> None:
    network = Network(in_loops)
    for name in UNITS:
        network.start(name)
    network.hello_to_late()
    network.settle(10)
    network.stands_still = False
    run = network.members['plant'].run
    past = {sent_in for _, sent_in in network.sent} - {run}
    counted = 0
    for source, target, head, length in attacks:
        member = network.members[target]
        # in every other respect it is the peer's own
        frame = (*head, network.members[source].sender, *[0.25] * 5)[:length]
        if len(frame) == 8 and frame[0] == run and float(frame[1]).is_integer():
            continue  # a frame that looks right in everything cannot be told from a right one
        if source in member.peers:
            network.attack(source, target, frame)
            # what is left over of a past run passes, and is no refusal
            counted += not (len(frame) == 8 and frame[0] in past)
        network.settle(1)
    network.settle(40)
    assert {member.run for member in network.members.values()} == {run}
    assert_as_expected(network, at_least=10)
    refused = sum(sum(member.inbox.refused.values()) for member in network.members.values())
    assert refused >= counted


invented_runs = st.sampled_from([-9.0, 1.0, 7.0, 2.0**51, 2.0**52 - 2.0**40, 2.0**52 - 1.0])


def invent(network: Network, target: str, run: float) -> None:
    """Let a member hear of another run, as if from the conductor."""
    if run < 1000.0:
        run += network.members['test_signal'].run
    network.members[target].receive('test_signal', (run, 0.0, 1e-3, 7.0, *[0.25] * 4))


def begun_network(in_loops: Collection[str]) -> Network:
    network = Network(in_loops)
    for name in UNITS:
        network.start(name)
    network.clock += 20.0  # so that a run may be invented that is younger than all nodes
    network.hello_to_late()
    network.settle(10)
    return network


@settings(deadline=None, max_examples=60)
@given(some, st.lists(st.tuples(st.sampled_from(UNITS[1:]), invented_runs, moves), max_size=5))
def test_an_invented_run_is_refused_while_the_run_goes_on(
        in_loops: Collection[str],
        attacks: list[tuple[str, float, list[tuple[str, str, bool]]]]) -> None:
    network = begun_network(in_loops)
    network.stands_still = False
    run = network.members['plant'].run
    for target, invented, choices in attacks:
        invent(network, target, invented)
        shake(network, choices)
    network.settle(40)
    assert {member.run for member in network.members.values()} == {run}
    assert_as_expected(network, at_least=40)
    for target, _, _ in attacks:
        assert network.members[target].inbox.refused['test_signal', Refusal.WRONG_RUN]


@settings(deadline=None, max_examples=60)
@given(some, st.sets(st.sampled_from(UNITS[1:]), min_size=1), invented_runs, moves, st.booleans())
@pytest.mark.slow
def test_who_was_led_into_an_invented_run_comes_back(
        in_loops: Collection[str], victims: set[str], invented: float,
        choices: list[tuple[str, str, bool]],
        again: bool) -> None:
    network = begun_network(in_loops)
    for target in victims:
        invent(network, target, invented)
        network.act(target)  # the run stood still just then: it is followed
        assert network.members[target].run != network.members['test_signal'].run
    network.settle(80)
    shake(network, choices)
    if again:
        network.start('plant')
    network.settle(80)
    assert len({member.run for member in network.members.values()}) == 1
    assert_as_expected(network, at_least=10)


@none_some_all
@pytest.mark.parametrize('run', [1.0, 2000.0, 2.0**51, 2.0**52 - 1.0])
def test_an_invented_run_before_the_first_does_not_keep_anybody_from_it(
        in_loops: Collection[str], run: float) -> None:
    network = Network(in_loops)
    for name in UNITS[1:]:
        network.start(name)
        invent(network, name, run + 1000.0)
        network.act(name)
    network.start('test_signal')
    network.hello_to_late()
    network.settle(80)
    assert len({member.run for member in network.members.values()}) == 1
    assert_as_expected(network, at_least=10)


@none_some_all
@pytest.mark.parametrize('birth', [5000.0, 2.0**51, 2.0**52 - 1.0, 1e300])
def test_an_invented_hello_ends_no_run_and_leaves_room_for_the_next(
        in_loops: Collection[str], birth: float) -> None:
    network = begun_network(in_loops)
    run = network.members['test_signal'].run
    conductor = network.members['test_signal']
    conductor.receive('plant', (0.0, birth, 0.0, 7.0, *[0.0] * 4))
    network.quiet = False  # the plant goes on
    network.settle(20)
    network.quiet = True
    network.settle(20)
    assert {member.run for member in network.members.values()} == {run}
    network.start('plant')
    network.settle(40)
    assert network.members['plant'].run > run
    assert_as_expected(network, at_least=10)


@settings(deadline=None, max_examples=60)
@given(some, st.lists(st.tuples(st.sampled_from(UNITS), st.sampled_from(UNITS), st.integers(0, 60),
                                st.floats(-1.0, 1.0)), min_size=1, max_size=40))
def test_frames_of_a_second_node_of_one_name_are_refused_and_told(
        in_loops: Collection[str], frames: list[tuple[str, str, int, float]]) -> None:
    """Right in everything, they were stepped on if they came first, and nobody knew."""
    network = begun_network(in_loops)
    run = network.members['plant'].run
    told = set()
    for source, target, step, value in frames:
        if source in network.members[target].peers:
            network.attack(source, target, (run, float(step), 1e-3, 7.0, *[value] * 4))
            told.add((source, target))
        network.settle(1)
    network.settle(40)
    assert_as_expected(network, at_least=20)
    for source, target in told:
        inbox = network.members[target].inbox
        assert inbox.refused[source, Refusal.SECOND_SENDER]
        assert inbox.doubled[source] == (network.members[source].sender, 7.0)
    assert sum(len(member.inbox.doubled) for member in network.members.values()) == len(told)


def test_a_second_observer_of_one_name_does_not_speak_for_the_first() -> None:
    conductor = conductor_with_recorder()
    conductor.receive('recorder', (conductor.run, 0.0, 1e-3, 7.0))
    conductor.receive('recorder', (conductor.run, 400.0, 1e-3, 8.0))
    assert step_as_far_as_possible(conductor) == SLACK + 1
    assert conductor.inbox.doubled == {'recorder': (7.0, 8.0)}


@none_some_all
def test_the_run_ends_when_everybody_has_used_the_last_step(in_loops: Collection[str]) -> None:
    network = Network(in_loops, last_step=12)
    for name in UNITS:
        network.start(name)
    network.hello_to_late()
    network.settle(60)
    conductor = network.members['test_signal']
    assert isinstance(conductor, Conductor)
    assert conductor.ended
    assert len(network.run_of('test_signal')) == 13
    assert all(len(network.run_of(name)) == 14 for name in UNITS[1:])


@none_some_all
def test_nobody_runs_more_than_two_steps_ahead(in_loops: Collection[str]) -> None:
    network = Network(in_loops)
    for name in UNITS:
        network.start(name)
    network.hello_to_late()
    network.settle(30)
    slow = network.members.pop('plant')  # it answers no more
    network.settle(30)
    assert {member.step - slow.step for member in network.members.values()} <= {0, 1, 2}


@none_some_all
def test_a_unit_that_puts_out_nan_stops_and_says_so(in_loops: Collection[str]) -> None:
    network = Network(in_loops)
    for name in UNITS:
        network.start(name)
    plant = network.members['plant'].unit
    assert isinstance(plant, Chaotic)
    plant.broken_at[0] = 3
    network.hello_to_late()
    network.settle(40)
    assert network.members['plant'].fault == 'plant: b is NaN or infinite at step 4'
    assert len(network.run_of('plant')) == 4
    assert network.members['test_signal'].missing() == ('plant',)


@pytest.mark.parametrize('frame, reason', [
    ((9.0, 0.0, 1e-3, 1.0), Refusal.WRONG_LENGTH),
    ((9.0, 0.0, 1e-3, math.nan, 1.0), Refusal.NAN),
    ((9.0, 0.0, 1e-3, -math.inf, 1.0), Refusal.INFINITE),
    ((9.0, 0.5, 1e-3, 0.0, 1.0), Refusal.NOT_A_STEP),
    ((2.0**53, 0.0, 1e-3, 0.0, 1.0), Refusal.WRONG_RUN),
    ((9.0, 1.0, 1e-3, 0.0, 1.0), Refusal.TOO_OLD),
    ((9.0, 2.0 + DEPTH, 1e-3, 0.0, 1.0), Refusal.TOO_FAR_AHEAD),
    ((9.0, 2.0, 1e-3, 0.0, 2.0), Refusal.CONTRADICTION),
    ((9.0, 2.0, 1e-3, 0.0, 1.0), Refusal.DUPLICATE),
])
def test_each_refusal_has_its_name(frame: tuple[float, ...], reason: Refusal) -> None:
    inbox = Inbox({'plant': 5})
    inbox.begin(9.0)
    inbox.advance()
    inbox.advance()
    good = (9.0, 2.0, 1e-3, 0.0, 1.0)
    assert inbox.well_formed('plant', good)
    inbox.offer('plant', good)
    if inbox.well_formed('plant', frame):
        inbox.offer('plant', frame)
    assert inbox.refused == {('plant', reason): 1}
    assert inbox.slots['plant'][2] == good


@pytest.mark.parametrize('other', [8.0, 10.0])
def test_a_frame_of_another_run_is_refused_when_the_run_has_gone_on(other: float) -> None:
    inbox = Inbox({'plant': 5})
    inbox.begin(9.0)
    inbox.offer('plant', (other, 0.0, 1e-3, 0.0, 1.0))
    for _ in range(DEPTH):
        inbox.advance()
    assert not inbox.refused, 'the run may yet be announced'
    inbox.advance()
    assert inbox.refused == {('plant', Refusal.WRONG_RUN): 1}


@pytest.mark.parametrize('invented', [9.0, 2.0**51])
def test_a_frame_that_comes_before_the_announcement_of_its_run_is_kept(invented: float) -> None:
    member = Member(Chaotic('motor_2'), 5.0, OUTPUTS)
    values = [0.25] * 4
    for run in (invented, 30.0, 31.0):
        if run == invented:
            member.receive('test_signal', (run, 0.0, 1e-3, 7.0, *values))
            member.go_on()
            # both runs reach the plant before this member hears of either
            member.receive('plant', (30.0, 0.0, 1e-3, 7.0, *values))
            member.receive('plant', (31.0, 0.0, 1e-3, 7.0, *values))
        else:
            member.receive('test_signal', (run, 0.0, 1e-3, 7.0, *values))
            assert member.go_on() is not None
        assert (member.run, member.step) == (run, 0)
    assert member.go_on() is not None
    assert member.step == 1
    assert not member.inbox.refused


def test_who_is_slow_is_named_first_but_bulk_is_waited_for_at_no_step() -> None:
    inbox = Inbox({'plant': 4, 'motor_1': 4, 'recorder': 4}, in_bulk=('recorder',))
    inbox.begin(9.0)
    inbox.put_first('motor_1')
    inbox.put_first('recorder')
    assert inbox.missing() == ('motor_1', 'plant')
    for peer in inbox.missing():
        inbox.offer(peer, (9.0, 0.0, 1e-3, 7.0))
    assert not inbox.missing()


def test_an_input_that_nobody_puts_out_is_named() -> None:
    unit = Chaotic('plant')
    unit.inputs = ('motor_1/c',)  # type: ignore[misc]
    with pytest.raises(ValueError, match='motor_1/c: no such signal'):
        Member(unit, 0.0, OUTPUTS)


def conductor_with_recorder(last_step: int | None = None) -> Conductor:
    """Return a conductor that has begun a run, for which its recorder has yet to begin."""
    conductor = Conductor(Chaotic('test_signal'), 1.0, 1e-3, last_step, OUTPUTS, ('recorder',))
    for name in (*UNITS[1:], 'recorder'):
        conductor.receive(name, (0.0, 2.0, 0.0, 7.0, *([] if name == 'recorder' else [0.0] * 4)))
    assert conductor.new_run(10.0) is not None
    return conductor


def step_as_far_as_possible(conductor: Conductor) -> int:
    for _ in range(SLACK + 50):
        for name in UNITS[1:]:
            if name in conductor.missing():
                conductor.receive(
                    name, (conductor.run, float(conductor.step), 1e-3, 7.0, *[0.5] * 4))
        conductor.go_on()
    return conductor.step


def test_the_conductor_waits_for_an_observer_that_falls_behind() -> None:
    conductor = conductor_with_recorder(SLACK + 20)
    run = conductor.run
    assert step_as_far_as_possible(conductor) == 0, 'the recorder has not begun the run'
    assert conductor.missing() == ('recorder',)
    conductor.receive('recorder', (run, 0.0, 1e-3, 7.0))
    assert step_as_far_as_possible(conductor) == SLACK + 1
    assert conductor.missing() == ('recorder',)
    conductor.receive('recorder', (run, 5.0, 1e-3, 7.0))
    assert step_as_far_as_possible(conductor) == SLACK + 6
    conductor.receive('recorder', (run, 500.0, 1e-3, 7.0))
    assert step_as_far_as_possible(conductor) == SLACK + 21, (
        'one more than the last: nobody uses it')
    assert not conductor.ended
    assert conductor.missing() == ('recorder',)
    conductor.receive('recorder', (run, SLACK + 21.0, 1e-3, 7.0))
    step_as_far_as_possible(conductor)
    assert conductor.ended


def waiting_for_its_recorder() -> Conductor:
    """Return a conductor that has made every step that its recorder, at step 5, lets it make."""
    conductor = conductor_with_recorder()
    conductor.receive('recorder', (conductor.run, 5.0, 1e-3, 7.0))
    step_as_far_as_possible(conductor)
    assert conductor.missing() == ('recorder',)
    return conductor


def test_an_observer_that_was_led_into_an_invented_run_is_fetched_back() -> None:
    conductor = waiting_for_its_recorder()
    run = conductor.run
    conductor.receive('recorder', (run + 7.0, 0.0, 1e-3, 7.0))
    assert conductor.new_run(20.0) is None, 'the drive does not stand still yet'
    assert conductor.new_run(20.0, stands_still=True) is not None
    assert conductor.run > run + 7.0


def test_an_observer_that_reads_on_has_not_left() -> None:
    """The other run was somebody else's word in the observer's name."""
    conductor = waiting_for_its_recorder()
    conductor.receive('recorder', (conductor.run + 7.0, 0.0, 1e-3, 7.0))
    conductor.receive('recorder', (conductor.run, 6.0, 1e-3, 7.0))
    step_as_far_as_possible(conductor)
    assert conductor.missing()[-1:] == ('recorder',)
    assert conductor.new_run(20.0, stands_still=True) is None


def test_a_node_that_was_killed_before_an_observer_had_its_frames_is_not_waited_for() -> None:
    """The conductor has those frames; the observer never gets them, and can say nothing."""
    conductor = waiting_for_its_recorder()
    assert conductor.new_run(20.0, stands_still=True) is None, 'a slow observer is no reason'
    conductor.receive('plant', (0.0, 12.0, 0.0, 7.0, *[0.0] * 4))
    assert conductor.patience_s == DECEIVED_STANDSTILL_S, 'the observer may just take its time'
    assert conductor.new_run(20.0, stands_still=True) is not None


def test_a_hello_is_false_if_the_observer_and_the_member_go_on() -> None:
    conductor = waiting_for_its_recorder()
    conductor.receive('plant', (0.0, 12.0, 0.0, 7.0, *[0.0] * 4))
    conductor.receive('recorder', (conductor.run, 5.0 + 2 * DEPTH, 1e-3, 7.0))
    step_as_far_as_possible(conductor)
    assert 'recorder' in conductor.missing()
    assert conductor.new_run(20.0, stands_still=True) is None


@none_some_all
def test_who_was_deceived_is_patient_for_a_second_of_steps(in_loops: Collection[str]) -> None:
    network = begun_network(in_loops)
    network.stands_still = False
    motor = network.members['motor_1']
    assert motor.patience_s == STANDSTILL_S
    invent(network, 'motor_1', 7.0)
    network.settle(4)
    assert motor.patience_s == DECEIVED_STANDSTILL_S
    assert network.members['plant'].patience_s == STANDSTILL_S, 'it has heard nothing'
    network.stands_still = True
    network.start('plant')  # the next run is no reason to forget it
    network.settle(40)
    assert motor.run == network.members['test_signal'].run > 0.0
    assert motor.patience_s == DECEIVED_STANDSTILL_S
    motor.follow(motor.step + MEMORY + 1, np.zeros((2, 2)))
    assert motor.patience_s == STANDSTILL_S


@pytest.mark.parametrize('frame', [
    (9.0, 0.0, 1e-3), (math.nan, 0.0, 1e-3, 7.0, *[0.5] * 4), (9.0, 0.5, 1e-3, 7.0, *[0.5] * 4)])
@none_some_all
def test_a_frame_that_no_node_makes_is_a_warning(
        in_loops: Collection[str], frame: tuple[float, ...]) -> None:
    network = begun_network(in_loops)
    for name in ('plant', 'test_signal'):
        member = network.members[name]
        assert member.patience_s == STANDSTILL_S
        network.attack('motor_1', name, frame)
        network.settle(4)
        assert member.patience_s == DECEIVED_STANDSTILL_S
        member.follow(member.step + MEMORY + 8, np.zeros((2, 2)))
        assert member.patience_s == STANDSTILL_S


def test_a_member_that_went_on_after_a_hello_in_its_name_was_spoken_for() -> None:
    conductor = conductor_with_recorder()
    hello = (0.0, 5.0, 0.0, 7.0, *[0.0] * 4)
    conductor.receive('recorder', (conductor.run, 0.0, 1e-3, 7.0))
    conductor.receive('plant', hello)
    assert conductor.patience_s == STANDSTILL_S, 'it may be true'
    step_as_far_as_possible(conductor)
    assert conductor.patience_s == DECEIVED_STANDSTILL_S
    conductor.receive('plant', hello)  # nothing is known of this one yet
    assert conductor.patience_s == DECEIVED_STANDSTILL_S
    conductor.follow(conductor.step + MEMORY + 1, np.zeros((2, 2)))
    assert conductor.patience_s == STANDSTILL_S, 'it is long ago'


def test_a_hello_begins_a_new_run_only_where_the_drive_stands_still() -> None:
    conductor = conductor_with_recorder()
    conductor.receive('plant', (0.0, 12.0, 0.0, 7.0, *[0.0] * 4))
    assert conductor.new_run(20.0) is None
    assert conductor.new_run(20.0, stands_still=True) is not None
