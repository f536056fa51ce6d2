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
"""The article's experiments through five real ROS 2 processes: the same figures, to the bit."""

from __future__ import annotations

import json
from pathlib import Path

from antenna_drive import cli
from antenna_drive.programs import OK
import pytest

pytest.importorskip('rclpy')


@pytest.mark.trial
def test_five_processes_give_the_rows_of_one(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fresh_domain: int) -> None:
    from antenna_drive.cli import article
    monkeypatch.setattr(article, 'EXPERIMENTS', article.THROUGH_NODES)
    obtained = []
    for options in ([], ['--through-nodes']):
        target = tmp_path / f'{len(options)}.json'
        assert cli.main(['article', '--config', 'reference', *options, '--json',
                         str(target)]) == OK
        rows = json.loads(target.read_text())['rows']
        assert {row['id'].partition('.')[0] for row in rows} == set(article.THROUGH_NODES)
        obtained.append({row['id']: row['obtained'] for row in rows})
        marked = [row['id'] for row in rows if 'five ROS 2 processes' in row['note']]
        assert len(marked) == (len(rows) if options else 0)
    assert obtained[0] == obtained[1]
