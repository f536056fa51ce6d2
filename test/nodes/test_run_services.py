# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Pause, step, reset and play in five real processes: the bits are those of one process."""

from __future__ import annotations

from pathlib import Path
import re
from typing import Any

from antenna_drive.emulator.run import simulate
from antenna_drive.emulator.units import build
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep.exchange import compile_ahead
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from diagnostic_msgs.msg import DiagnosticStatus  # noqa: E402
from drive_watch import Recorder, Watch  # noqa: E402

NAME = 'watcher'
SAW_TOOTH = {'waveform': 'saw_tooth', 'amplitude': 0.01, 'period': 0.5}
SHEET = """\
waveform: {type: multisine, amplitude_deg_s: 0.2, frequencies_hz: [1.0, 3.0], weights: [0.5, 0.5],
           phases: [0.0, 1.0], start_s: 0.05}
circuit: old
"""


def nodes(exchange: str) -> dict[str, dict[str, Any]]:
    """Return the parameters of an endless drive that waits for the recorder."""
    return {**{unit: {'exchange': exchange} for unit in UNITS}, 'test_signal': {
        'exchange': exchange, 'run.pace': 0.0, 'run.observers': [NAME], **SAW_TOOTH}}


def step_in(message: str) -> int:
    found = re.fullmatch(r'paused at step (\d+) of run \d+', message)
    assert found, message
    return int(found[1])


def same(recorder: Recorder, settings: dict[str, Any]) -> None:
    """Compare the run in progress with the emulator in one process, to the bit."""
    samples = recorder.array()
    drive = changed(load(), settings)
    want = simulate(drive, (len(samples) - 1) * 1e-3, 1e-3, recorder.schedule()).samples
    assert samples.tobytes() == want.tobytes()
    assert np.abs(samples[:, 0, 0]).max() > 0.0, 'the command moves'


def settings_of(parameters: dict[str, Any], prefix: str = 'test_signal.rate.') -> dict[str, Any]:
    return {f'{prefix}{name}': value for name, value in parameters.items()}


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize('exchange', ['auto', pytest.param('python', marks=pytest.mark.trial)])
@pytest.mark.slow
def test_an_operator_controls_the_run_and_changes_no_bit(exchange: str, tmp_path: Path) -> None:
    if exchange == 'auto':
        for unit in UNITS:
            compile_ahead(build(unit, load()))
    with Watch() as watch, Recorder(NAME) as recorder, DriveProcesses(nodes(exchange)):
        watch.until(lambda: recorder.steps > 50, 'step 50')
        refused = watch.call('test_signal/step')
        assert not refused.success
        assert 'call pause first' in refused.message
        at = _pause(watch, recorder)
        _nobody_is_blamed(watch, at)
        assert watch.set_together('torque_share', {'bias_pot': 0.4}).successful
        assert step_in(watch.call('test_signal/step').message) == at + 1
        assert watch.set_together('test_signal', {'run.steps': 250}).successful
        refused = watch.set_together('test_signal', {'run.steps': 0})
        assert 'run.steps' in refused.reason
        assert step_in(watch.call('test_signal/step').message) == at + 251
        watch.until(lambda: recorder.steps == at + 251, 'the steps that were asked for')
        assert watch.call('test_signal/resume').success
        watch.until(lambda: recorder.steps > at + 500, 'more steps')
        at = _pause(watch, recorder)
        assert {change['torque_share']['bias_pot'] for change in recorder.schedule().values()
                if 'torque_share' in change} == {0.4}
        same(recorder, settings_of(SAW_TOOTH))
        _reset(watch, recorder)
        _play(watch, recorder, tmp_path)


def _pause(watch: Watch, recorder: Recorder) -> int:
    at = step_in(watch.call('test_signal/pause').message)
    assert step_in(watch.call('test_signal/state').message) == at
    watch.until(lambda: recorder.steps == at, f'step {at}')
    return at


def _nobody_is_blamed(watch: Watch, at: int) -> None:
    """Hear from each node for longer than it would wait before it complains."""
    watch.until(lambda: all(unit in watch.reports and watch.reports[unit].message ==
                            f'paused at step {at}' for unit in UNITS), 'reports of the pause')
    watch.heard.clear()
    watch.until(lambda: len(watch.heard) > 3 * len(UNITS), 'more reports')
    for status in watch.heard:
        assert status.level == DiagnosticStatus.OK
        assert 'waiting' not in status.message
        assert 'waiting for' not in {item.key for item in status.values}


def _reset(watch: Watch, recorder: Recorder) -> None:
    assert step_in(watch.call('test_signal/reset').message) == 0
    watch.until(lambda: len(recorder.runs) == 2 and recorder.steps == 0, 'step 0 of another run')
    assert watch.call('test_signal/resume').success
    watch.until(lambda: recorder.steps > 300, 'steps of the new run')
    _pause(watch, recorder)
    assert watch.get('torque_share', 'bias_pot') == [0.4], 'parameters stay'
    same(recorder, {**settings_of(SAW_TOOTH), 'torque_share.circuit.bias_pot': 0.4})


def _play(watch: Watch, recorder: Recorder, folder: Path) -> None:
    assert 'not given' in watch.call('test_signal/play').message
    sheet = folder / 'test.yaml'
    assert watch.set_together('test_signal', {'run.sheet': str(sheet)}).successful
    assert str(sheet) in watch.call('test_signal/play').message
    sheet.write_text(SHEET)
    assert watch.call('test_signal/play').success
    watch.until(lambda: len(recorder.runs) == 3 and recorder.steps > 300, 'the sheet played')
    _pause(watch, recorder)
    amplitude = float(np.deg2rad(0.2))
    same(recorder, {'torque_share.circuit.bias_pot': 0.4, **settings_of({
        'waveform': 'multisine', 'amplitude': amplitude, 'frequencies': (1.0, 3.0),
        'weights': (0.5, 0.5), 'phases': (0.0, 1.0), 'start_after': 0.05})})
