# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A command from outside has limits: the rate that the drive can reach, or what is allowed."""

from __future__ import annotations

import math

from antenna_drive.parameters import load
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from drive_watch import Watch  # noqa: E402
from simgap.inputs.schema import Value  # noqa: E402

TOPIC, UNIT = 'test_signal/external', 'test_signal'


def test_the_greatest_rate_is_that_of_a_motor_without_a_load() -> None:
    """Its voltage is the back-EMF. The article's antennas slew at 0.8 deg/s, which is less."""
    drive = load('reference')
    armature = drive.motor_1.armature
    motor_rad_s = drive.greatest_rate * drive.motor_1.gear_ratio
    assert armature.back_emf_constant * motor_rad_s == pytest.approx(armature.voltage_limit)
    assert 0.8 < math.degrees(drive.greatest_rate) < 0.9


@pytest.mark.usefixtures('node_domain')
@pytest.mark.parametrize(('parameters', 'taken', 'refused'), [
    ({}, 0.015, 0.0153), ({}, -0.015, -0.8), ({'run.external_limit': 0.1}, 0.09, 0.11)])
@pytest.mark.slow
def test_what_is_beyond_is_refused_and_said(parameters: dict[str, Value], taken: float,
                                            refused: float) -> None:
    with Watch() as watch, DriveProcesses(
            {UNIT: {'waveform': 'external', **parameters}}, order=[UNIT]) as processes:
        command = watch.float_publisher(TOPIC)
        watch.until(lambda: 'ready' in processes.log(UNIT), 'the node')
        said = f'external: {refused:g} given, allowed is '

        def told(count: int) -> bool:
            return watch.value(UNIT, 'refused values') == str(count)

        command(taken)
        command(refused)
        watch.until(lambda: said in processes.log(UNIT), 'a word')
        command(math.nan)
        watch.until(lambda: told(2), 'the count')
        assert processes.log(UNIT).count('The value of before stays in force') == 1, 'the first'
        command(taken)
        command(refused)
        watch.until(lambda: processes.log(UNIT).count(said) == 2, 'a word again')
        assert 'run.external_limit' in processes.log(UNIT)
        assert told(2) or told(3), 'nothing that was taken is counted'
