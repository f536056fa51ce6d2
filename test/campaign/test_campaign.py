# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The campaign itself: what it finds, counts, keeps and leaves out."""

from __future__ import annotations

from collections import Counter
import json
import os
from pathlib import Path
import random
import subprocess
import sys
from typing import Any

from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep.frame import FrameLayout, read_foreign
from antenna_drive.lockstep.inbox import Inbox
from lab.campaign import leftovers
from lab.campaign.kills import _lost_steps
from lab.campaign.mutations import _fault
from lab.campaign.page import page
from lab.campaign.readers import Reader
from lab.campaign.soak import BLOCKS, slope
from lab.campaign.summary import bad, COUNTS, summary
from lab.campaign.supervisor import Campaign, OUTCOMES
from lab.campaign.trials import DOSES, FULL, Outcome, PARTS, plan, READERS, Trial
from lab.cli import main
from lab.trials.verdict import VerdictError
import numpy as np
import pytest
from scipy.stats import linregress
from simgap.errors import UserError

SETTINGS = {'dose': 'short', 'seed': 1, 'soak_s': None}


@pytest.mark.parametrize('dose', DOSES)
def test_every_dose_has_every_part_and_no_trial_twice(dose: str) -> None:
    trials = list(plan(dose))
    assert {trial.part for trial in trials} == set(PARTS)
    assert len({trial.label for trial in trials}) == len(trials)
    assert len({trial.seed(1) for trial in trials}) == len(trials)


def test_the_full_dose_is_what_was_promised() -> None:
    total: Counter[str] = Counter()
    files: Counter[str] = Counter()
    for trial in plan(FULL):
        total.update({key: int(trial.options.get(key, 0)) for key in ('kills', 'frames')})
        files[trial.name.rpartition('_')[0]] += int(trial.options.get('files', 0))
        if trial.part == 'soak':
            assert trial.options['duration_s'] == 3600.0
    assert total['kills'] >= 200
    assert total['frames'] >= 1_000_000
    assert all(files[reader] >= 100_000 for reader in READERS)


def trial(files: int = 30) -> Trial:
    return Trial('mutations', 'change_0', {'files': files}, 120.0)


@pytest.mark.slow
def test_a_campaign_that_is_started_again_leaves_out_what_is_done(tmp_path: Path) -> None:
    done: list[str] = []
    campaign = Campaign(tmp_path, SETTINGS)
    campaign.do([trial()], lambda trial, entry: done.append(trial.label))
    entry = campaign.outcomes['mutations-change_0']
    assert entry['findings'] == []
    assert entry['counts']['mutated_files'] > 20
    # an interruption in the middle of a line
    with (tmp_path / OUTCOMES).open('a') as log:
        log.write('\n{"id": "mutations-sheet_0", "cou')
    again = Campaign(tmp_path, SETTINGS)
    assert again.outcomes == {'mutations-change_0': entry}
    again.do([trial()], lambda trial, entry: done.append(trial.label))
    assert done == ['mutations-change_0']


@pytest.mark.slow
def test_damaged_files_side_by_side_end_as_they_do_alone(tmp_path: Path) -> None:
    trials = [Trial('mutations', f'{reader}_0', {'files': 100}, 120.0)
              for reader in ('change', 'frame')]
    outcomes = {}
    for jobs in (1, 2):
        campaign = Campaign(tmp_path / str(jobs), SETTINGS)
        done: list[str] = []
        campaign.do(trials, lambda trial, entry: done.append(trial.label), jobs)
        outcomes[jobs] = Campaign(tmp_path / str(jobs), SETTINGS).outcomes
        assert sorted(done) == sorted(outcomes[jobs]) == sorted(trial.label for trial in trials)
    for label, alone in outcomes[1].items():
        assert outcomes[2][label]['counts'] == alone['counts']


def test_a_folder_of_another_campaign_is_refused_in_a_line(tmp_path: Path) -> None:
    Campaign(tmp_path, SETTINGS)
    with pytest.raises(UserError, match='holds a campaign with'):
        Campaign(tmp_path, {**SETTINGS, 'seed': 2})


def test_a_trial_that_hangs_is_ended_and_found(tmp_path: Path) -> None:
    entry = Campaign(tmp_path, SETTINGS).one(trial(10**6)._replace(patience_s=0.5))
    assert entry['counts'] == {'hangs': 1}


def test_a_trial_that_fails_is_a_finding(tmp_path: Path) -> None:
    entry = Campaign(tmp_path, SETTINGS).one(Trial('mutations', 'nothing_0', {'files': 1}, 60.0))
    assert 'the trial failed' in entry['findings'][0]['what']


def test_a_process_that_is_left_is_seen_and_ended() -> None:
    token = f'test-{os.getpid()}'
    child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'],
                             env={**os.environ, leftovers.TOKEN: token})
    try:
        assert leftovers.wait_for_none(token, 0.0) == [child.pid]
        assert 'time.sleep' in leftovers.commands([child.pid])[child.pid]
        leftovers.end([child.pid])
        assert child.wait(30.0) == -9
        assert leftovers.alive({leftovers.TOKEN: token}) == []
    finally:
        child.kill()
        child.wait()


class _Raises:
    def __init__(self, error: BaseException) -> None:
        self.error = error

    def __call__(self, folder: Path) -> None:
        raise self.error


@pytest.mark.parametrize(('error', 'counted'), [
    (UserError('sheet.yaml: wrong'), None), (UserError('wrong'), 'bad_messages'),
    (UserError('sheet.yaml: ' + 'x' * 5000), 'bad_messages'), (KeyError('a'), 'tracebacks'),
    (VerdictError('sheet.yaml: \0'), 'bad_messages'), (UserError('sheet.yaml: \0'), None),
    (MemoryError(), 'gigabytes'), (RecursionError(), 'tracebacks')])
def test_each_answer_of_a_reader_is_judged(error: BaseException, counted: str | None,
                                           tmp_path: Path) -> None:
    fault = _fault(Reader('sheet.yaml', b'', _Raises(error)), tmp_path, Outcome())
    assert (fault[0] if fault else None) == counted


def test_the_slope_is_that_of_the_means_of_blocks() -> None:
    rng = np.random.default_rng(3)
    x = np.linspace(0.0, 1.0, 10 * BLOCKS)
    y = 7.0 * x + rng.normal(0.0, 1.0, x.size)
    value, low, high = slope(x, y.tolist())
    means = linregress(x.reshape(BLOCKS, -1).mean(1), y.reshape(BLOCKS, -1).mean(1))
    assert value == pytest.approx(means.slope)
    assert high - value == value - low == pytest.approx(2.101 * means.stderr)
    assert low < 7.0 < high


def test_steps_lost_are_told_of_each_recorder_by_itself() -> None:
    """A recorder says how many it has lost so far; one that is started again begins anew."""
    begun = '[recorder]: run 7: recording from step {} on to /tmp/bags/start_{}{}\n'
    lost = '[recorder]: {} steps lost: the recorder or the machine is too slow\n'
    log = ''.join((begun.format(0, 1795641360, ''), begun.format(0, 1795641360, '_run_2'),
                   lost.format(1), lost.format(3), begun.format(110, 1795641408, ''),
                   begun.format(0, 1795641408, '_run_2'), lost.format(2)))
    assert _lost_steps(log) == 3 + 2


def test_no_garbage_is_a_frame_that_somebody_may_wait_for() -> None:
    """Garbage that is right in everything would be stepped on, and rightly so."""
    pytest.importorskip('rclpy', reason='there is no ROS 2 here')
    from lab.campaign.impostor import Garbage
    garbage = Garbage(random.Random(5))
    garbage.run, garbage.step = 1.7e15, 30_000
    layouts = {unit: FrameLayout(signals) for unit, signals in OUTPUTS.items()}
    inbox = Inbox({unit: layout.length for unit, layout in layouts.items()})
    well_formed = 0
    for _ in range(20_000):
        unit, message = garbage.one()
        frame = layouts[unit].decode(message)
        frame = read_foreign(message) if frame is None else frame
        if inbox.well_formed(unit, frame):
            well_formed += 1
            assert frame[0] != garbage.run or abs(frame[1] - garbage.step) > 1000
    assert well_formed > 5000, 'near misses get past the first check'


def entry(**more: Any) -> dict[str, Any]:
    return {'id': 'starts-0', 'wall_s': 1.0, 'counts': {'kills': 2}, 'figures': {}, 'findings': [],
            'skipped': '', **more}


def test_the_result_has_every_promised_count() -> None:
    result = summary([], {}, SETTINGS, 'out')
    assert {*COUNTS, 'memory_slope_MB_per_h', 'findings'} <= set(result)
    json.dumps(result)
    assert 'none' in page(result)


def test_a_finding_says_how_to_repeat_it_and_becomes_no_part_of_the_page() -> None:
    [first, *_] = plan('short')
    finding = {'what': '<script>alert(1)</script>', 'detail': 5}
    result = summary([first], {first.label: entry(
        id=first.label, findings=[finding], counts={'tracebacks': 1})}, SETTINGS, 'out')
    assert bad(result) == {'tracebacks': 1}
    [found] = result['findings']
    assert found['repeat'] == f'lab campaign --out out --repeat {first.label}'
    text = page(result)
    assert '<script>' not in text
    assert found['repeat'] in text


def test_an_unknown_trial_is_told_in_a_line(tmp_path: Path,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['campaign', '--out', str(tmp_path / 'out'), '--repeat', 'kills-x']) == 2
    assert 'kills-x: no such trial' in capsys.readouterr().err


@pytest.mark.trial
def test_a_short_campaign_finds_nothing(tmp_path: Path, fresh_domain: int) -> None:
    """Ten minutes of what `make campaign` does for hours."""
    pytest.importorskip('rclpy', reason='there is no ROS 2 here')
    status = main(['campaign', '--short', '--out', str(tmp_path / 'out'),
                   '--json', str(tmp_path / 'result.json')])
    result = json.loads((tmp_path / 'result.json').read_text())
    assert bad(result) == {}, result['findings']
    assert status == 0, result['findings']
    assert result['trials_done'] == result['trials']
