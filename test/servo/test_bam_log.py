# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Logs of a real servo through the Recording type."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

from antenna_drive.recording.recording import Recording
from lab.servo.log import read_bam
import numpy as np
import pytest
from simgap.logs.channel import RecordingError

FIXTURE = Path(__file__).parent / 'data' / '2026-01-15_10h28m57.json'
# the folder of all sixteen logs: next to a checkout, or from the variable
FOLDER = Path(os.environ.get('BAM_XL330', Path(__file__).resolve().parents[3]
                             / 'shared' / 'data' / 'bam_xl330'))


def check(path: Path, recording: Recording) -> None:
    """Compare with the log itself and with what is known of the machine."""
    log = json.loads(path.read_text())
    entries = log['entries']
    for key, name in (('position', 'servo/position'), ('speed', 'servo/speed'),
                      ('load', 'servo/load'), ('input_volts', 'servo/input_volts'),
                      ('temp', 'servo/temperature'), ('goal_position', 'servo/goal_position'),
                      ('torque_enable', 'servo/torque_enable')):
        assert recording[name].values.tolist() == [float(e[key]) for e in entries]
    stamps = np.array([e['timestamp'] for e in entries])
    assert np.abs(recording['servo/position'].time_s - stamps).max() <= 0.5000001e-9
    for key in ('mass', 'length', 'kp', 'vin', 'motor', 'trajectory'):
        assert recording.notes[key] == log[key]
    # the encoder has 4096 steps per turn; a log has 6 s at about 190 Hz or more
    steps = recording['servo/position'].values / (2 * math.pi / 4096)
    assert np.abs(steps - np.rint(steps)).max() < 1e-6
    assert recording.duration_s == pytest.approx(6.0, abs=0.01)
    assert 180 < len(entries) / recording.duration_s < 260
    assert recording['servo/position'].unit == 'rad'
    assert recording['servo/speed'].unit == 'rad/s'


def test_a_real_log_is_read_whole() -> None:
    recording = read_bam(FIXTURE)
    check(FIXTURE, recording)
    assert recording.notes['trajectory'] == 'up_and_down'
    assert recording.notes['kp'] == 200


@pytest.mark.skipif(not FOLDER.is_dir(), reason=f'the sixteen logs are not in {FOLDER}')
def test_all_sixteen_logs_are_read_whole() -> None:
    paths = sorted(FOLDER.glob('*.json'))
    assert len(paths) == 16
    seen = set()
    for path in paths:
        recording = read_bam(path)
        check(path, recording)
        seen.add((recording.notes['kp'], recording.notes['trajectory']))
    assert seen == {(kp, trajectory) for kp in (100, 200, 400, 800)
                    for trajectory in ('sin_sin', 'lift_and_drop', 'up_and_down',
                                       'sin_time_square')}


@pytest.mark.parametrize(('change', 'words'), [
    ({'mass': None}, 'mass: None given, allowed is a number'),
    ({'trajectory': 3}, 'trajectory: 3 given, allowed is a text'),
    ({'entries': 3}, 'no list of entries'),
    ({'entries': [3]}, 'entry 0: timestamp: None given'),
])
def test_what_is_no_log_is_refused(change: dict[str, object], words: str,
                                   tmp_path: Path) -> None:
    path = tmp_path / 'log.json'
    path.write_text(json.dumps({**json.loads(FIXTURE.read_text()), **change}))
    with pytest.raises(RecordingError, match=words) as refusal:
        read_bam(path)
    assert str(refusal.value).startswith(f'{path}: ')


@pytest.mark.parametrize(('key', 'value', 'words'), [
    ('position', '1', "entry 2: position: '1' given, allowed is a number"),
    ('torque_enable', 1, 'entry 2: torque_enable: 1 given, allowed is true or false'),
    ('speed', True, 'entry 2: speed: True given'),
    ('timestamp', 0.0, 'record 3, column timestamp: the time is not later'),
    ('load', 10**400, 'record 3, column load: .* is too large a number'),
])
def test_a_wrong_entry_is_named(key: str, value: object, words: str, tmp_path: Path) -> None:
    log = json.loads(FIXTURE.read_text())
    log['entries'][2][key] = value
    path = tmp_path / 'log.json'
    path.write_text(json.dumps(log))
    with pytest.raises(RecordingError, match=words):
        read_bam(path)


@pytest.mark.parametrize('text', ['', '{', '[1, 2', 'nan', '{"mass": NaN}', '[' * 100000,
                                  '9' * 5000, '"\ud800"'])
def test_what_is_no_json_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / 'log.json'
    path.write_bytes(text.encode(errors='surrogatepass'))
    with pytest.raises(RecordingError, match='log.json: '):
        read_bam(path)
