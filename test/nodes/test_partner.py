# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A partner in plain rclpy beside the drive: kept, missed, and replayed to the bit."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys
from typing import Any

from antenna_drive.emulator.run import Emulator
from antenna_drive.emulator.wiring import OUTPUTS, UNITS
from antenna_drive.parameters import load
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.partner import PartnerUnit  # noqa: E402, I100
from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402
from drive_watch import Recorder, Watch  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'pointing_partner'
STAND_IN = (sys.executable, '-m', 'antenna_drive.nodes.partner')


def parameters(on_miss: str, exchange: str) -> dict[str, dict[str, Any]]:
    """Return those of a slow drive, whose partner would have to be silent for 40 s to miss it."""
    return {**{unit: {'exchange': exchange} for unit in UNITS}, 'test_signal': {
        'exchange': exchange, 'run.step': 4e-3, 'run.pace': 0.1, 'run.observers': ['watcher'],
        'partner.reads': ['plant/encoder'], 'partner.rate': 50.0, 'partner.deadline': 4.0,
        'partner.on_miss': on_miss}}


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize(('on_miss', 'exchange'), [('zero', 'auto'), ('stop', 'python')])
@pytest.mark.slow
def test_a_partner_is_followed_missed_and_replayed(on_miss: str, exchange: str) -> None:
    with Watch() as watch, Recorder('watcher') as recorder, DriveProcesses(
            parameters(on_miss, exchange), commands={'test_signal': STAND_IN}) as processes:
        partner = subprocess.Popen(
            [sys.executable, '-m', 'pointing_partner.pointing'],
            env={**os.environ, 'PYTHONPATH': os.pathsep.join([str(EXAMPLE), *sys.path])})
        try:
            watch.until(lambda: bool(recorder.runs) and len(recorder.schedule()) > 20, 'answers')
            watch.until(lambda: bool(watch.value('test_signal', 'round trip p99.9 [ms]')),
                        'a round trip')
        finally:
            partner.kill()
            partner.wait()
        watch.until(lambda: watch.set_together('test_signal', {'run.pace': 0.0}).successful,
                    'haste')
        watch.until(lambda: number(watch, 'misses') > 0, 'a miss')
        if on_miss == 'zero':
            target = recorder.steps + 50
            watch.until(lambda: recorder.steps > target, 'steps without a partner')
            assert number(watch, 'steps overdue') > 0
        else:
            watch.until(lambda: 'no answer of the partner within 4 s' in
                        watch.reports['test_signal'].message, 'the stop')
        samples, schedule = recorder.array(), recorder.schedule()
        log = processes.log('test_signal')
        codes = processes.stop()
    assert f': {on_miss}; ' in log
    assert codes == dict.fromkeys(UNITS, 0)
    taken = {step: change['test_signal']['answer'] for step, change in schedule.items()}
    assert len(taken) > 15
    nobody = {step: answer for step, answer in taken.items() if answer[0] < 0.0}
    assert all(0 <= answer[0] <= step for step, answer in taken.items() if step not in nobody)
    assert list(nobody.values())[-1:] == ([[-1.0, 0.0, 0.0]] if on_miss == 'zero' else [])
    stand_in = PartnerUnit('test_signal', OUTPUTS['test_signal'])
    emulator = Emulator(load(), 4e-3, replaced={'test_signal': stand_in})
    run = emulator.run((samples.shape[0] - 1) * 4e-3, schedule)
    assert samples.tobytes() == run.samples.tobytes()
    assert np.ptp(run['plant/axis_angle']) > 0.0


def number(watch: Watch, key: str) -> int:
    """Return a number of the stand-in's last report."""
    return int(watch.value('test_signal', key) or 0)
