# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The QoS of signals can be changed at the start; that of the lock-step cannot."""

from __future__ import annotations

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from drive_watch import Watch  # noqa: E402
from rclpy.qos import ReliabilityPolicy  # noqa: E402

UNIT = 'torque_share'
OVERRIDE = 'qos_overrides./torque_share/{}.publisher.reliability'


@pytest.mark.slow
def test_a_signal_is_published_as_it_was_asked_for(node_domain: int) -> None:
    asked = {UNIT: {OVERRIDE.format('bias_voltage'): 'best_effort'}}

    def reliability(topic: str) -> ReliabilityPolicy | None:
        found = watch.node.get_publishers_info_by_topic(f'/{UNIT}/{topic}')
        return found[0].qos_profile.reliability if found else None

    with Watch() as watch, DriveProcesses(asked, order=[UNIT]):
        watch.until(lambda: reliability('counter_torque') is not None
                    and reliability('bias_voltage') is not None, 'the topics')
        assert reliability('bias_voltage') == ReliabilityPolicy.BEST_EFFORT
        assert reliability('counter_torque') == ReliabilityPolicy.RELIABLE
        assert reliability('frame') == ReliabilityPolicy.RELIABLE


@pytest.mark.slow
@pytest.mark.parametrize('topic', ['frame', 'changes'])
def test_the_qos_of_the_lock_step_is_not_changed(topic: str, node_domain: int) -> None:
    name = OVERRIDE.format(topic)
    with DriveProcesses({UNIT: {name: 'best_effort'}}, order=[UNIT]) as processes:
        assert processes.process(UNIT).wait(timeout=120.0) == 2
        [line] = processes.log(UNIT).splitlines()
        assert f'{name}: the lock-step needs' in line
