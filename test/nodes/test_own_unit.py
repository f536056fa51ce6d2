# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The example's torque share joins our other four processes and changes no bit on the way."""

from __future__ import annotations

import os
from pathlib import Path
import sys
from typing import Any

from antenna_drive.emulator.run import Emulator
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.parameters import load
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from drive_watch import Recorder, Watch  # noqa: E402

PACKAGE = Path(__file__).parents[2] / 'examples' / 'own_torque_share'


@pytest.mark.usefixtures('fresh_domain')
def test_own_torque_share_joins_the_other_four(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(PACKAGE))
    from own_torque_share.constant_bias import ConstantBias
    path = os.pathsep.join([str(PACKAGE), *sys.path])
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
