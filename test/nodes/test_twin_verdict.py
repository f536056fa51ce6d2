# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The verdict that grows, and the next test, as the node of the twin gives them: minutes each."""

from __future__ import annotations

from collections.abc import Iterator
import json
from pathlib import Path
import subprocess
import sys
import time
from typing import Any

import pytest

pytest.importorskip('rclpy', reason='there is no ROS 2 here')

from antenna_drive.lockstep.leaving import leave  # noqa: E402, I100
from lab.cli import main  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from std_msgs.msg import Empty, String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
import yaml  # noqa: E402

pytestmark = pytest.mark.trial
PATIENCE_S = 1200.0
# The third case of six with this seed is a current loop of motor 2 whose gain is off.
SEED, CASES, CASE, EFFECT = '5', '6', 'case_0003', 'current_2.gain'
SQUARE = {'type': 'square', 'amplitude_deg_s': 0.1, 'period_s': 7.4, 'phase': 0.25}
NAMES = ('rate_command_rad_s', 'current_1_A', 'current_2_A', 'tach_rate_1_rad_s',
         'tach_rate_2_rad_s', 'encoder_rad', 'bias_voltage_V')


def program(module: str, *arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, '-m', f'antenna_drive.nodes.{module}', *arguments])


@pytest.fixture
def tests(tmp_path: Path) -> list[Path]:
    """Return a slow square wave and a fast triangle on one antenna, and write the twin's files."""
    out = tmp_path / 'sealed'
    assert main(['trial', '--cases', CASES, '--seed', SEED, '--out', str(out), '--quiet']) == 0
    triangle = yaml.safe_load((out / CASE / 'rec_b.yaml').read_text())
    found = []
    for name, sheet in (('square', {**triangle, 'waveform': SQUARE}), ('triangle', triangle)):
        (tmp_path / f'{name}_sheet.yaml').write_text(yaml.safe_dump(sheet))
        found.append(tmp_path / f'{name}.csv')
        assert main(['trial-test', str(out), CASE, '--sheet', str(tmp_path / f'{name}_sheet.yaml'),
                     '--out', str(found[-1])]) == 0
    del triangle['waveform']
    (tmp_path / 'sheet.yaml').write_text(yaml.safe_dump(triangle))
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump({
        'time': {'column': '/real/row', 'index': 0, 'unit': 's'},
        'signals': {name: {'column': '/real/row', 'index': place + 1}
                    for place, name in enumerate(NAMES)}}))
    return found


class Asker:
    """Hears what a twin says, and asks it."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node('asker', context=self._context)
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.said: dict[str, Any] = {}
        for topic in ('verdict', 'next_test'):
            self.node.create_subscription(String, f'twin/{topic}', self._listener(topic), kept)
        self.begin_test = self.node.create_publisher(Empty, 'twin/begin_test', 1)
        self.propose: Any = self.node.create_client(Trigger, 'twin/propose')
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def _listener(self, topic: str) -> Any:
        def listen(message: String) -> None:
            self.said[topic] = json.loads(message.data)
        return listen

    def until(self, reached: Any) -> None:
        end = time.monotonic() + PATIENCE_S
        while not reached():
            assert time.monotonic() < end, self.said
            self._executor.spin_once(0.1)

    def tested(self) -> float:
        """Return the seconds of testing that the last look was based on."""
        looks = self.said.get('verdict', {'looks': []})['looks']
        return float(looks[-1]['seconds']) if looks else 0.0

    def close(self) -> None:
        self._executor.shutdown()
        leave(self.node)


@pytest.fixture
def asker(fresh_domain: int) -> Iterator[Asker]:
    found = Asker()
    yield found
    found.close()


def test_a_gain_is_named_and_a_test_proposed(
        tests: list[Path], tmp_path: Path, asker: Asker) -> None:
    twin = program('twin', '--ros-args', '-p', f'map:={tmp_path / "map.yaml"}',
                   '-p', f'sheet:={tmp_path / "sheet.yaml"}', '-p', 'verdict:=true')
    try:
        # A look takes its time: the second is at 19.5 s or later, and a later one on both tests.
        for test, tested in zip(tests, (19.0, 38.0), strict=True):
            player = program('recording_player', str(test))
            assert player.wait(PATIENCE_S) == 0
            asker.until(lambda least=tested: asker.tested() > least)
            asker.begin_test.publish(Empty())
        verdict = asker.said['verdict']
        last = verdict['looks'][-1]['probabilities']
        assert max(last, key=lambda answer: float(last[answer])) == EFFECT
        assert verdict['fault'] == ''
        asker.until(asker.propose.service_is_ready)
        asked = asker.propose.call_async(Trigger.Request())
        asker.until(asked.done)
        assert asked.result().success
        asker.until(lambda: asker.said.get('next_test', {'under_way': True})['under_way'] is False)
        assert asker.said['next_test']['fault'] == ''
        assert asker.said['next_test']['test']['circuit'] == 'new'
        # a further design is under way when it is asked to end
        asked = asker.propose.call_async(Trigger.Request())
        asker.until(asked.done)
    finally:
        twin.terminate()
        try:
            code = twin.wait(20.0)
        except subprocess.TimeoutExpired:
            twin.kill()
            raise
    assert code == 0
