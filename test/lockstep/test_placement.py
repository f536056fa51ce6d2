# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where the kernel says that a drive's processes run."""

from __future__ import annotations

from collections.abc import Iterator
import os
import sys

from antenna_drive.emulator.wiring import MOTORS, PLANT, TEST_SIGNAL, TORQUE_SHARE, UNITS
from antenna_drive.lockstep import processes
from antenna_drive.lockstep.placement import hasten, idle_share
from antenna_drive.lockstep.processes import DriveProcesses
import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, 'SCHED_BATCH'), reason='this is not Linux')
# It neither needs ROS 2 nor does anything; what follows on its command line it does not read.
WAITING = dict.fromkeys(UNITS, (sys.executable, '-c', 'import signal; signal.pause()'))


@pytest.fixture
def two_cores() -> Iterator[set[int]]:
    """Allow this process two of its cores."""
    before = os.sched_getaffinity(0)
    if len(before) < 2:
        pytest.skip('there is one core')
    os.sched_setaffinity(0, sorted(before)[:2])
    yield os.sched_getaffinity(0)
    os.sched_setaffinity(0, before)


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the machine look idle."""
    monkeypatch.setattr(processes, 'machine_is_idle', lambda: True)


@pytest.mark.usefixtures('idle')
@pytest.mark.slow
def test_processes_at_full_speed_are_placed(two_cores: set[int]) -> None:
    with DriveProcesses({TEST_SIGNAL: {'run.pace': 0.0}}, commands=WAITING) as drive:
        pids = {unit: drive.process(unit).pid for unit in UNITS}
        assert {os.sched_getscheduler(pid) for pid in pids.values()} == {os.SCHED_BATCH}
        cores = {unit: os.sched_getaffinity(pid) for unit, pid in pids.items()}
    assert cores[TEST_SIGNAL] == two_cores
    assert cores[MOTORS[0]] == cores[TORQUE_SHARE] != cores[MOTORS[1]] == cores[PLANT]
    assert cores[PLANT] | cores[TORQUE_SHARE] == two_cores
    assert os.sched_getscheduler(0) == os.SCHED_OTHER, 'whoever starts them is left alone'


@pytest.mark.usefixtures('idle')
@pytest.mark.slow
def test_a_node_started_again_is_placed_as_before(two_cores: set[int]) -> None:
    with DriveProcesses({TEST_SIGNAL: {'run.pace': 0.0}}, commands=WAITING) as drive:
        core = os.sched_getaffinity(drive.process(PLANT).pid)
        drive.kill(PLANT)
        drive.start(PLANT)
        assert os.sched_getaffinity(drive.process(PLANT).pid) == core
        assert os.sched_getscheduler(drive.process(PLANT).pid) == os.SCHED_BATCH


@pytest.mark.usefixtures('idle')
@pytest.mark.parametrize('parameters', [{}, {TEST_SIGNAL: {'run.pace': 1.0}}])
@pytest.mark.slow
def test_processes_at_a_pace_are_left_to_the_system(
        two_cores: set[int], parameters: dict[str, dict[str, float]]) -> None:
    with DriveProcesses(parameters, commands=WAITING) as drive:
        for unit in UNITS:
            assert os.sched_getscheduler(drive.process(unit).pid) == os.SCHED_OTHER
            assert os.sched_getaffinity(drive.process(unit).pid) == two_cores


@pytest.mark.slow
def test_on_a_busy_machine_they_are_left_to_the_system(
        two_cores: set[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, 'machine_is_idle', lambda: False)
    with DriveProcesses({TEST_SIGNAL: {'run.pace': 0.0}}, commands=WAITING) as drive:
        for unit in UNITS:
            assert os.sched_getscheduler(drive.process(unit).pid) == os.SCHED_OTHER
            assert os.sched_getaffinity(drive.process(unit).pid) == two_cores


def test_idle_share_is_that_of_all_time() -> None:
    # 10 ticks of user, 20 of system, 60 idle, 10 stolen; what guests take is in user already
    before = 'cpu  100 10 100 1000 5 1 2 30 40 0'
    assert idle_share(before, 'cpu  110 10 120 1060 5 1 2 40 50 0') == pytest.approx(0.6)
    for line in (before, 'cpu  1 2', ''):
        with pytest.raises(ValueError, match='after'):
            idle_share(before, line)


def test_a_process_that_has_ended_is_no_error() -> None:
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)
    hasten({PLANT: child})
