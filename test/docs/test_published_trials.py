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
"""Trials that are published case by case give the figures that the documents state."""

from __future__ import annotations

from pathlib import Path
import re

from antenna_drive.trial.scorecard import score
from antenna_drive.trial.scored_cases import read_scored
import pytest

DOCS = Path(__file__).resolve().parents[2] / 'docs'
# rows of the tables of wild trials, in the words of both pages
ROWS = {
    'top1': 'true effect first', 'top3': 'true effect in the first three',
    'within_set': 'true effect in what the first entry and its sets hold',
    'overconfident_outside': 'a catalogue effect named above 0.9 instead',
    'pairs_both': 'both of a pair named first',
    'no_gap_on_none': '`no_gap` where nothing is wrong',
    'auroc_unknown': 'AUROC of the unknown', 'ece': 'expected calibration error',
    'size_coverage': 'share of the 95 percent intervals',
    'closed_held_back_median': 'closed on'}


@pytest.mark.parametrize('number', [9, 10, 11])
@pytest.mark.parametrize('page', ['diagnosis.md', 'trials/README.md'])
def test_figures_of_a_wild_trial_are_those_of_its_cases(page: str, number: int) -> None:
    cases = read_scored(DOCS / 'trials' / f'wild_{number}.jsonl')
    text = (DOCS / page).read_text(encoding='utf-8')
    table = text[text.index('| figure (95 % interval) |'):].split('\n\n')[0].splitlines()
    cells = [[cell.strip() for cell in line.strip('|').split('|')] for line in table]
    # a trial that was published in part has a column for its first cases, too
    columns = {int(match.group(1)): k for k, title in enumerate(cells[0])
               if (match := re.fullmatch(rf'trial {number}, (\d+) cases', title))}
    assert max(columns) == len(cases)
    for count, column in columns.items():
        figures = score(cases[:count])
        for key, words in ROWS.items():
            [row] = [row for row in cells if row[0].startswith(words)]
            stated = re.match(r'[\d.]+', row[column])
            assert stated is not None
            assert float(stated.group()) == pytest.approx(figures[key], abs=0.005001), words
