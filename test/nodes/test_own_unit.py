# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The examples among the nodes, to the bits of one process.

The torque share takes the place of ours, and the position loop is a sixth unit.
"""

from __future__ import annotations

import os
from pathlib import Path
import sys
from typing import Any

from antenna_drive.emulator.run import Emulator, simulate
from antenna_drive.emulator.wiring import find, UNITS
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from drive_watch import Recorder, Watch  # noqa: E402

EXAMPLES = Path(__file__).parents[2] / 'examples'


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_own_torque_share_joins_the_other_four(monkeypatch: pytest.MonkeyPatch) -> None:
    package = str(EXAMPLES / 'own_torque_share')
    monkeypatch.syspath_prepend(package)
    from own_torque_share.constant_bias import ConstantBias
    path = os.pathsep.join([package, *sys.path])
    parameters: dict[str, dict[str, Any]] = {
        'test_signal': {'run.pace': 0.0, 'run.observers': ['watcher']},
        'torque_share': {'bias': 9.0}}
    command = (sys.executable, '-m', 'own_torque_share.constant_bias')
    with Watch() as watch, Recorder('watcher') as recorder, DriveProcesses(
            parameters, commands={'torque_share': command},
            environment={'PYTHONPATH': path}) as processes:
        processes.check()
        watch.until(lambda: recorder.steps > 200, 'step 200')
        answer = watch.set_together('torque_share', {'bias': 7.5})
        assert answer.successful, answer.reason
        assert not watch.set_together('torque_share', {'bias': 21.0}).successful
        target = recorder.steps + 500
        watch.until(lambda: recorder.steps > target, 'a while with the new bias')
        samples, schedule = recorder.array(), recorder.schedule()
        codes = processes.stop()
    assert [change['torque_share'] for change in schedule.values()] == [{'bias': 7.5}]
    emulator = Emulator(load(), replaced={'torque_share': ConstantBias(bias=9.0)})
    run = emulator.run((samples.shape[0] - 1) * 1e-3, schedule)
    assert samples.tobytes() == run.samples.tobytes()
    assert codes == dict.fromkeys(UNITS, 0)


STUCK = """
import threading
from antenna_drive.lockstep.entry import run_unit
from own_torque_share.constant_bias import ConstantBias


class Stuck(ConstantBias):
    def step(self, k, inputs):
        if k == 100:
            threading.Event().wait()
        return super().step(k, inputs)


run_unit(Stuck())
"""


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_own_unit_that_does_not_return_is_ended_and_says_where_it_was() -> None:
    path = os.pathsep.join([str(EXAMPLES / 'own_torque_share'), *sys.path])
    with Recorder('watcher') as recorder, Watch() as watch, DriveProcesses(
            {'test_signal': {'run.observers': ['watcher']}},
            commands={'torque_share': (sys.executable, '-c', STUCK)},
            environment={'PYTHONPATH': path}) as processes:
        watch.until(lambda: recorder.steps >= 100, 'step 100')
        watch.until(lambda: 'torque_share' in watch.value('motor_1', 'waiting for'), 'a wait')
        codes = processes.stop()
        log = processes.log('torque_share')
    assert codes == {**dict.fromkeys(UNITS, 0), 'torque_share': 1}
    assert 'in step' in log and '"<string>", line 10' in log


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_own_position_loop_is_a_sixth_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    package = str(EXAMPLES / 'own_position_loop')
    monkeypatch.syspath_prepend(package)
    name = 'own_position_loop.wiring:POINTED'
    wiring = find(name)
    parameters: dict[str, dict[str, Any]] = {
        'test_signal': {'run.pace': 0.0, 'run.observers': ['watcher']},
        'position_loop': {'angle': 2e-4}}
    with Watch() as watch, Recorder('watcher', outputs=wiring.outputs) as recorder, DriveProcesses(
            parameters, wiring=name, environment={
                'PYTHONPATH': os.pathsep.join([package, *sys.path])}) as processes:
        processes.check()
        watch.until(lambda: recorder.steps > 200, 'step 200')
        answer = watch.set_together('position_loop', {'track_rate': 5e-5})
        assert answer.successful, answer.reason
        assert not watch.set_together('position_loop', {'track_rate': 1.0}).successful
        assert watch.get('motor_2', 'wiring') == [[name]]
        target = recorder.steps + 500
        watch.until(lambda: recorder.steps > target, 'a while on the track')
        samples, schedule = recorder.array(), recorder.schedule()
        codes = processes.stop()
    assert [change['position_loop'] for change in schedule.values()] == [{'track_rate': 5e-5}]
    drive = changed(wiring.load(), {'position_loop.angle': 2e-4})
    run = simulate(drive, (samples.shape[0] - 1) * 1e-3, changes=schedule, wiring=wiring)
    assert samples.tobytes() == run.samples.tobytes()
    assert np.ptp(run['plant/axis_angle']) > 0.0
    assert codes == dict.fromkeys(wiring.units, 0)
