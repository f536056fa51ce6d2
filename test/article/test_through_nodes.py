# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The article's experiments through five real ROS 2 processes: the same figures, to the bit."""

from __future__ import annotations

import json
from pathlib import Path

from antenna_drive import cli
import pytest
from simgap.command.programs import OK

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
