# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What nodes say where they were started: that they are ready, whom they wait for, a namesake."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import subprocess
import sys
from typing import IO

from antenna_drive.emulator.wiring import UNITS
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.leaving import leave  # noqa: E402, I100
from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402
from antenna_drive.lockstep.starting import namesake  # noqa: E402
from drive_watch import Watch  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.node import Node  # noqa: E402

OTHERS = tuple(unit for unit in UNITS if unit != 'test_signal')


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_each_says_once_that_it_is_ready_and_whom_it_waits_for() -> None:
    with Watch() as watch, DriveProcesses(order=['test_signal', 'plant']) as processes:
        def said(unit: str, text: str) -> bool:
            return text in processes.log(unit)

        watch.until(lambda: said('plant', 'ready; waits for test_signal to begin a run'), 'plant')
        watch.until(lambda: said('test_signal', f'ready; waits for {", ".join(OTHERS)} to begin'),
                    'the conductor')
        # of those who have come, nobody says any more that they are waited for
        missing = ', '.join(unit for unit in OTHERS if unit != 'plant')
        watch.until(lambda: said('test_signal', f'waiting for {missing} to begin a run'), 'a wait')
        processes.start('motor_1')
        missing = missing.replace('motor_1, ', '')
        watch.until(lambda: said('test_signal', f'waiting for {missing} to begin a run'), 'news')
        processes.start('motor_2', 'torque_share')
        watch.until(lambda: all(said(unit, 'begins, macro-step') for unit in UNITS), 'the run')
        for unit in UNITS:
            assert processes.log(unit).count('ready; waits for ') == 1
            assert 'another node' not in processes.log(unit)


@contextmanager
def started(log: IO[bytes], node: str, *arguments: str) -> Iterator[None]:
    with subprocess.Popen([sys.executable, '-m', f'antenna_drive.nodes.{node}', *arguments],
                          stdout=log, stderr=log) as process:
        try:
            yield
        finally:
            process.terminate()


@pytest.mark.usefixtures('node_domain')
@pytest.mark.parametrize(('node', 'arguments', 'waits'), [
    ('recorder', (), f'the frames of {", ".join(UNITS)}'),
    ('joint_states', (), f'the frames of {", ".join(UNITS)}'),
    pytest.param('twin', ('--ros-args', '-p', 'real:=/east', '-p', 'verdict:=false'),
                 ', '.join(f'/east/{signal}' for signal in (
                     'test_signal/rate_command', 'motor_1/ammeter', 'motor_2/ammeter',
                     'motor_1/tach_rate', 'motor_2/tach_rate', 'plant/encoder',
                     'torque_share/bias_voltage')), marks=pytest.mark.slow)])
def test_those_who_only_read_say_so_too(node: str, arguments: tuple[str, ...], waits: str,
                                        tmp_path: Path) -> None:
    with Watch() as watch, (tmp_path / 'log').open('wb') as log, started(log, node, *arguments):
        watch.until(lambda: b'ready;' in (tmp_path / 'log').read_bytes(), 'a word')
        [line] = [line for line in (tmp_path / 'log').read_text().splitlines() if 'ready;' in line]
        assert line.endswith(f']: ready; waits for {waits}')


@pytest.mark.slow
def test_the_second_of_a_name_says_so_where_it_was_started(node_domain: int) -> None:
    with Watch() as watch, DriveProcesses(order=['torque_share']) as first, DriveProcesses(
            order=['torque_share']) as second:
        line = f'another node is called /torque_share in ROS domain {node_domain}: '
        watch.until(lambda: line in second.log('torque_share'), 'the second')
        # and so does the first one, for as long as it waits in vain
        watch.until(lambda: line in first.log('torque_share'), 'the first')
        assert 'ROS_DOMAIN_ID' in second.log('torque_share')


def test_a_namesake_has_the_same_namespace_too(node_domain: int) -> None:
    context = Context()
    context.init(args=[], domain_id=node_domain)
    alone, *others = (Node('motor_1', namespace=space, context=context)
                      for space in ('/east', '/west'))
    try:
        assert namesake(alone) == ''
        others.append(Node('motor_1', namespace='/east', context=context))
        assert namesake(alone).startswith('another node is called /east/motor_1 in ROS domain ')
    finally:
        leave(alone)
