# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The result files of a servo study: found again for the same data and effort, and only then."""

from __future__ import annotations

from pathlib import Path

from lab.servo.log import read_bam, ServoLog
from lab.servo.rounds import FitEffort
from lab.servo.study import _KeptResults, Direction
import numpy as np
import pytest
from simgap.errors import UserError

LOG = Path(__file__).parent / 'data' / '2026-01-15_10h28m57.json'
DIRECTION = Direction('gain', (100.0, 200.0))
RESULT = {'split': 'gain', 'models': {'m1': 1.5}}


@pytest.fixture(scope='module')
def log() -> ServoLog:
    return ServoLog.of(LOG.stem, read_bam(LOG))


def test_a_result_is_found_for_the_same_study_and_no_other(tmp_path: Path,
                                                           log: ServoLog) -> None:
    effort = FitEffort(100, 20)
    kept = _KeptResults(tmp_path, [log], effort, ['encoder.offset'])
    assert kept.find(DIRECTION) is None
    kept.put(DIRECTION, RESULT)
    again = _KeptResults(tmp_path, [log], effort, ['encoder.offset'])
    assert again.find(DIRECTION) == RESULT
    assert again.find(Direction('gain', (100.0, 400.0))) is None
    moved = ServoLog(**{**vars(log), 'measured': np.zeros_like(log.measured)})
    for other in (_KeptResults(tmp_path, [moved], effort, ['encoder.offset']),
                  _KeptResults(tmp_path, [log], FitEffort(101, 20), ['encoder.offset']),
                  _KeptResults(tmp_path, [log], effort, [])):
        assert other.find(DIRECTION) is None
    assert sorted(path.suffix for path in tmp_path.iterdir()) == ['.json']


def test_a_damaged_result_is_not_found(tmp_path: Path, log: ServoLog) -> None:
    kept = _KeptResults(tmp_path, [log], FitEffort(100, 20), [])
    kept.put(DIRECTION, RESULT)
    file, = tmp_path.iterdir()
    for text in (file.read_text()[:-5], '[]', '{}', ''):
        file.write_text(text)
        assert kept.find(DIRECTION) is None


def test_nothing_is_kept_without_a_folder_and_a_bad_one_is_told(tmp_path: Path,
                                                                log: ServoLog) -> None:
    kept = _KeptResults(None, [log], FitEffort(100, 20), [])
    kept.put(DIRECTION, RESULT)
    assert kept.find(DIRECTION) is None
    (tmp_path / 'file').write_text('')
    with pytest.raises(UserError, match='cannot be written'):
        _KeptResults(tmp_path / 'file', [log], FitEffort(100, 20), []).put(DIRECTION, RESULT)
