# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A partner that does not wait, step by step: ages, misses, refusals, and what it puts out."""

from __future__ import annotations

from antenna_drive.emulator.run import Emulator
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep import compiled_loop
from antenna_drive.lockstep.compiled_unit import form_of
from antenna_drive.lockstep.exchange import Exchange
from antenna_drive.lockstep.member import Member
from antenna_drive.lockstep.partner import Answers, NO_STEP, PartnerUnit
from antenna_drive.parameters import load
from memory_channel import Frame, MemoryChannel
import numpy as np
import pytest
from simgap.inputs.schema import ParameterError

RUN = 7.0


def answers(deadline_s: float = 0.01) -> Answers:
    """Return the account of a run with steps of 1 ms and two outputs."""
    found = Answers(2, deadline_s)
    found.begin(RUN, 1e-3)
    return found


def test_an_answer_is_overdue_when_its_step_is_older_than_the_deadline() -> None:
    found = answers()
    assert not any(found.missed(step) for step in range(100)), 'none was given yet'
    found.take(100, 104)
    assert (found.age, found.due_step) == (4, 111)
    assert [step for step in range(105, 130) if found.missed(step)] == [111], 'one miss'
    assert found.missing
    assert found.overdue(120) == 9
    found.take(119, 121)
    assert not found.missing
    assert found.overdue(125) == 10, 'from step 111 to step 121'
    assert found.missed(130)
    assert found.misses == 2


def test_without_a_deadline_nothing_is_overdue() -> None:
    found = answers(0.0)
    found.take(1, 2)
    assert found.due_step is None
    assert not found.missed(10**9)


@pytest.mark.parametrize('message', [
    (RUN, 5.0, 0.1), (RUN, 5.0, 0.1, np.nan), (RUN, 5.0, 0.1, np.inf), (RUN + 1, 5.0, 0.1, 0.2),
    (RUN, 5.5, 0.1, 0.2), (RUN, 11.0, 0.1, 0.2), (RUN, 3.0, 0.1, 0.2), (RUN, -1.0, 0.1, 0.2), ()])
def test_what_is_no_answer_is_refused_and_counted(message: Frame) -> None:
    found = answers()
    found.take(4, 6)
    assert found.receive(message, 10, 0.0) is None
    assert found.refused == 1
    assert found.receive((RUN, 5.0, 0.1, 0.2), 10, 0.0) == (5.0, 0.1, 0.2)
    assert found.refused == 1


def test_the_round_trip_is_from_the_step_told_to_its_answer() -> None:
    found = answers()
    found.sent(5, 100.0)
    found.sent(10, 100.005)
    found.receive((RUN, 5.0, 0.1, 0.2), 12, 100.008)
    assert found.round_trips.percentiles()[0] == pytest.approx(8e-3, rel=0.05)
    found.receive((RUN, 7.0, 0.1, 0.2), 12, 200.0)
    assert found.round_trips.counts.sum() == 1, 'nobody told it step 7'


def test_the_unit_holds_an_answer_and_starts_without_one() -> None:
    unit = PartnerUnit('torque_share', OUTPUTS['torque_share'], ['motor_1/current'])
    count = len(unit.outputs)
    answer = (3.0, *np.arange(1.0, count + 1.0))
    assert not unit.start(1e-3).any()
    unit.tune({'answer': answer})
    for k in range(3):
        assert unit.step(k, np.full((1, 2), k))[:, 0].tolist() == list(answer[1:])
    assert unit.seen.tolist() == [[2.0, 2.0]]
    assert unit.settings()['answer'][1] == answer
    with pytest.raises(ParameterError, match='answer'):
        unit.tune({'answer': answer[:-1]})
    with pytest.raises(ParameterError, match='answer'):
        unit.tune({'answer': (*answer[:-1], np.nan)})
    assert not unit.start(1e-3).any()
    assert unit.settings()['answer'][1] == (float(NO_STEP), *[0.0] * count)


def test_its_compiled_loop_puts_out_the_answer_and_sees_the_inputs() -> None:
    unit = PartnerUnit('torque_share', OUTPUTS['torque_share'],
                       ['plant/axis_angle', 'test_signal/rate_command'])
    member = Member(unit, 1.0)
    sent: list[Frame] = []
    channel = MemoryChannel(member.layout, member.layouts, sent.append)
    form = form_of(unit)
    assert form is not None
    exchange = Exchange(member, form, channel)
    zeros = {peer: [0.0] * (layout.length - 4) for peer, layout in member.layouts.items()}
    member.receive('test_signal', (RUN, 0.0, 1e-3, 7.0, *zeros['test_signal']))
    assert member.go_on() is not None
    answer = (0.0, *np.arange(1.0, len(unit.outputs) + 1.0))
    unit.tune({'answer': answer})
    for k in range(3):
        channel.arrived['plant'].append(
            (RUN, float(k), 1e-3, 7.0, *(k + np.array(zeros['plant']))))
        if k:
            channel.arrived['test_signal'].append(
                (RUN, float(k), 1e-3, 7.0, *zeros['test_signal']))
    exchange.pauses = [3]
    # the sender of each peer's first frame is made known in Python
    reasons = [exchange.run(limit_s=60.0) for _ in range(2)]
    assert reasons == [compiled_loop.FOREIGN, compiled_loop.STEPPED]
    assert [frame[4::2] for frame in sent] == [answer[1:]] * 3
    assert not any(any(frame[5::2]) for frame in sent), 'it holds: no slope'
    assert unit.seen.tolist() == [[2.0, 2.0], [0.0, 0.0]]


def test_a_run_replays_from_its_record() -> None:
    """What a partner commanded is what a test signal of the same values would have."""
    partner = PartnerUnit('test_signal', OUTPUTS['test_signal'])
    record = {3: {'test_signal': {'answer': (1.0, 2e-4, 0.0)}},
              60: {'test_signal': {'answer': (50.0, -1e-4, 30.0)}}}
    run = Emulator(load(), replaced={'test_signal': partner}).run(0.1, record)
    command = run['test_signal/rate_command']
    # an answer in force from step k to k + 1 is put out at k + 1
    assert command.tolist() == [0.0] * 4 + [2e-4] * 57 + [-1e-4] * 40
    assert np.ptp(run['motor_1/current']) > 0.0
    again = Emulator(load(), replaced={'test_signal': partner}).run(0.1, record)
    assert again.samples.tobytes() == run.samples.tobytes()
