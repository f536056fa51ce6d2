# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The twin as a process, beside a 'real' drive that is the independent antenna, over DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import json
from pathlib import Path
import subprocess
import sys
from threading import Thread
import time
from typing import Any

import pytest

pytest.importorskip('rclpy', reason='there is no ROS 2 here')

from antenna_drive.lockstep.entry import choose_transport  # noqa: E402, I100
from antenna_drive.lockstep.leaving import leave  # noqa: E402
from antenna_drive.recording.csv_format import write_csv  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from lab.antenna.effects import CATALOGUE  # noqa: E402
from lab.campaign.twin_proving import recording_of  # noqa: E402
from lab.trials import onset  # noqa: E402
import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from simgap.command.programs import BAD_INPUT  # noqa: E402
from std_msgs.msg import Float64, Float64MultiArray  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
import yaml  # noqa: E402

pytestmark = pytest.mark.slow
PATIENCE_S = 250.0
ONSET_S = 75.0
PACE = '4.0'
NAMES = ('rate_command_rad_s', 'current_1_A', 'current_2_A', 'tach_rate_1_rad_s',
         'tach_rate_2_rad_s', 'encoder_rad', 'bias_voltage_V')
MAP: dict[str, Any] = {
    'time': {'column': '/real/row', 'index': 0, 'unit': 's'},
    'signals': {name: {'column': '/real/row', 'index': place + 1}
                for place, name in enumerate(NAMES)}}


@pytest.fixture(scope='module')
def truth() -> dict[str, Any]:
    """Return an antenna whose motor 2 gets viscous friction in the middle of a triangle."""
    number = 0
    while True:
        number += 1
        found = onset.draw_truths(number, 41, 0.02)[-1]
        if found['sheets'][0]['waveform']['type'] == 'triangle':
            break
    effect = 'motor_2.viscous_friction'
    found.update(onset_s=ONSET_S, duration_s=ONSET_S + 15.0, effects=[
        {'id': effect, 'parameters': CATALOGUE[effect].draw(0.7, np.random.default_rng(1))}])
    return found


class Program:
    """A process of the package and the lines that it has logged; it ends with the test."""

    def __init__(self, module: str, *arguments: str) -> None:
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, '-m', f'antenna_drive.nodes.{module}', *arguments],
            stderr=subprocess.PIPE, text=True)
        Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        self.lines.extend(self.process.stderr)

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *failure: Any) -> None:
        self.process.terminate()
        try:
            self.process.wait(20.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Listener:
    """What a twin says, and a 'real' drive's row to send."""

    def __init__(self) -> None:
        import os
        choose_transport(os.environ)
        context = rclpy.Context()
        rclpy.init(context=context)
        self.node = rclpy.create_node('watcher', context=context)
        self.said: list[tuple[str, dict[str, str]]] = []
        self.residuals: list[float] = []
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 100)
        self.node.create_subscription(Float64, 'twin/residual/motor_2/ammeter',
                                      lambda message: self.residuals.append(message.data), 1000)
        self.row = self.node.create_publisher(Float64MultiArray, '/real/row', 1000)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)

    def _hear(self, message: Any) -> None:
        for status in message.status:
            if status.name.endswith('twin'):
                self.said.append((status.message, {v.key: v.value for v in status.values}))

    def until(self, reached: Callable[[], bool], program: Program) -> None:
        """Listen until something is so; fail if it never comes."""
        end = time.monotonic() + PATIENCE_S
        while not reached():
            assert program.process.poll() is None, ''.join(program.lines)
            assert time.monotonic() < end, (self.said[-3:], program.lines[-5:])
            self.listen(0.1)

    def listen(self, patience_s: float) -> None:
        """Hear what comes within a time, one message at most."""
        self._executor.spin_once(patience_s)

    def close(self) -> None:
        self._executor.shutdown()
        leave(self.node)


@pytest.fixture
def listener() -> Iterator[Listener]:
    found = Listener()
    yield found
    found.close()


def arguments(folder: Path, sheet: dict[str, Any], *more: str) -> list[str]:
    (folder / 'map.yaml').write_text(yaml.safe_dump(MAP), encoding='utf-8')
    (folder / 'sheet.yaml').write_text(yaml.safe_dump(sheet), encoding='utf-8')
    return ['--ros-args', '-p', f'map:={folder / "map.yaml"}',
            '-p', f'sheet:={folder / "sheet.yaml"}', '-p', 'quiet:=40.0', *more]


def test_twin_learns_tells_the_gap_and_then_that_the_drive_has_stopped(
        tmp_path: Path, truth: dict[str, Any], listener: Listener) -> None:
    recording = recording_of(onset.make_recording(truth), truth['sheets'][0])
    write_csv(recording, tmp_path / 'real.csv')
    quiet = tmp_path / 'quiet.json'
    with Program('twin', *arguments(tmp_path, truth['sheets'][0],
                                    '-p', f'quiet_file:={quiet}')) as twin:
        listener.until(lambda: bool(listener.said), twin)
        assert listener.said[0][0].startswith('waiting')
        with Program('recording_player', str(tmp_path / 'real.csv'),
                     '--ros-args', '-p', f'pace:={PACE}'):
            listener.until(lambda: listener.said[-1][0].startswith('stale'), twin)
        words = [message.split(':')[0] for message, _ in listener.said]
        order = list(dict.fromkeys(word.split(' since')[0] for word in words))
        assert order == ['waiting for test_signal/rate_command', 'settling',
                         'learning the quiet record', 'ok', 'gap', 'stale input']
        gap = next(item for item in listener.said if item[0].startswith('gap'))
        assert 'motor_2/ammeter' in gap[0]
        assert ' article A instead of ' in gap[0]
        assert 'sigma' in gap[0]
        assert gap[1]['tuning'] == 'tuned to the quiet record'
        assert gap[1]['behind'].endswith(' s')
        assert len(listener.residuals) > 5000
        assert json.loads(quiet.read_text())['baseline']['signals']
    assert twin.process.returncode == 0


def test_twin_names_rubbish_and_goes_on(tmp_path: Path, truth: dict[str, Any],
                                        listener: Listener) -> None:
    columns = onset.make_recording({**truth, 'effects': [], 'duration_s': 60.0,
                                    'onset_s': 60.0})
    table = np.column_stack([columns['time_s'], *(columns[name] for name in NAMES)])
    with Program('twin', *arguments(tmp_path, truth['sheets'][0], '-p', 'tune:=false')) as twin:
        listener.until(lambda: bool(listener.said) and listener.row.get_subscription_count() > 0,
                       twin)

        def says(state: str, begin: float, end: float, last: float = 0.0) -> Any:
            """Send a part of the recording; return what the twin says in this state."""
            heard, compared = len(listener.said), len(listener.residuals)
            rows = table[(table[:, 0] >= begin) & (table[:, 0] < end)].tolist()
            # It takes what it can get, and a sender does not wait: half a second is under way.
            for sent, row in enumerate(rows, 1):
                listener.row.publish(Float64MultiArray(
                    data=[*row[:-1], last if last else row[-1]]))
                if sent % 50 == 0:
                    listener.until(lambda: len(listener.residuals) - compared >= sent - 10, twin)
            listener.until(lambda: any(message.startswith(state)
                                       for message, _ in listener.said[heard:]), twin)
            return next(said for said in listener.said[heard:] if said[0].startswith(state))

        asking: Any = listener.node.create_client(Trigger, 'twin/propose')
        listener.until(asking.service_is_ready, twin)
        answer: Any = asking.call_async(Trigger.Request())
        listener.until(answer.done, twin)
        assert not answer.result().success
        assert 'verdict:=true' in answer.result().message
        says('learning', 0.0, 18.0)
        message, _ = says('bad input', 18.0, 22.0, last=float('inf'))
        assert 'torque_share/bias_voltage' in message and 'infinite' in message
        says('learning', 22.0, 40.0)
        # the clock of the drive is set back: it begins anew
        _, values = says('settling', 0.0, 10.0)
        assert 'jumped back' in values['jumps of time']


@pytest.mark.parametrize(('argument', 'said'), [
    ('alarms_per_day:=0.0', 'alarms_per_day'), ('quiett:=40.0', 'did you mean quiet?'),
    ('map:=nowhere.yaml', 'nowhere.yaml'), ('tune:=7', 'tune'),
])
def test_wrong_parameter_is_refused_in_one_line(argument: str, said: str) -> None:
    done = subprocess.run([sys.executable, '-m', 'antenna_drive.nodes.twin', '--ros-args', '-p',
                           argument], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == BAD_INPUT
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize('module', ['twin', 'recording_player'])
def test_help_shows_an_example(module: str) -> None:
    done = subprocess.run([sys.executable, '-m', f'antenna_drive.nodes.{module}', '--help'],
                          capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0
    assert f'ros2 run antenna_drive {module}' in done.stdout
