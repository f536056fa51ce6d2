# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The firmware of a servo is a YAML file: ours, or one beside the logs."""

from __future__ import annotations

import math
from pathlib import Path

from lab.servo.firmware import Firmware, firmware_of
from lab.servo.log import DUTY, read_bam, ServoLog
import numpy as np
import pytest
from simgap.errors import UserError

LOG = Path(__file__).parent / 'data' / '2026-01-15_10h28m57.json'
OTHER = ('counts_per_revolution: 4096\nduty_counts: 1000\ngain_divisor: 128\n'
         'rate_step_rpm: 0.229\nrate_window_s: 0.02\n')


def test_the_xl330_has_the_numbers_of_its_control_table_to_the_last_digit() -> None:
    count = 4096 / (2.0 * math.pi)
    assert firmware_of('xl330') == Firmware(count / (256.0 * 885.0), 885.0, 1.0 / count,
                                            0.229 * 2.0 * math.pi / 60.0, 0.04)


def test_another_servo_is_a_file_beside_the_logs(tmp_path: Path) -> None:
    (tmp_path / 'other.yaml').write_text(OTHER)
    path = tmp_path / 'log.json'
    path.write_text(LOG.read_text().replace('"xl330"', '"other"'))
    usual = ServoLog.of('log', read_bam(LOG))
    log = ServoLog.of('log', read_bam(path), tmp_path)
    assert log.gain == pytest.approx(usual.gain * 2.0 * 885.0 / 1000.0, rel=1e-12)
    np.testing.assert_allclose(log.measured[:, DUTY], usual.measured[:, DUTY] * 0.885, rtol=1e-12)
    assert log.firmware.rate_window_s == 0.02


def test_a_file_beside_the_logs_goes_before_ours(tmp_path: Path) -> None:
    (tmp_path / 'xl330.yaml').write_text(OTHER)
    assert firmware_of('xl330', tmp_path).duty_count == 1000.0


@pytest.mark.parametrize(('text', 'words'), [
    (OTHER.replace('gain_divisor', 'gain_diviser'), 'did you mean gain_divisor'),
    (OTHER.replace('128', '0'), 'gain_divisor: 0 given'),
    ('duty_counts: 885\n', 'counts_per_revolution: missing'),
    ('- 1\n', 'allowed is a mapping'),
    ('a: [\n', 'line 2'),
])
def test_a_wrong_file_is_told_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / 'other.yaml').write_text(text)
    with pytest.raises(UserError, match=words) as refusal:
        firmware_of('other', tmp_path)
    assert str(refusal.value).startswith(f'{tmp_path / "other.yaml"}: ')


@pytest.mark.parametrize('motor', ['none', '', '../other', '/etc/other', 'a.b'])
def test_a_name_without_a_file_is_told_and_leads_nowhere_else(motor: str, tmp_path: Path) -> None:
    (tmp_path / 'other.yaml').write_text(OTHER)
    (tmp_path / 'logs').mkdir()
    with pytest.raises(UserError, match='the drive law is known of xl330; put'):
        firmware_of(motor, tmp_path / 'logs')
