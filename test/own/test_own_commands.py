# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The commands for a machine of one's own, as a user types them: simgap's and the drive's."""

from __future__ import annotations

import json
from pathlib import Path

from antenna_drive.cli import main
import numpy as np
from own.swing import log_of
import pytest
import simgap.cli

MODEL = 'from own.swing import swing\nmachine = swing()\n'
DEAF = ('from own.swing import simulate, swing\n'
        'machine = swing(simulate=lambda n, t: {"angle": t.time, "rate": t.time})\n')
HANGING = ('from own.swing import known, swing\n'
           'machine = swing(per_test={"start": known(0.0, "rad")})\n')


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a model and two logs of a swing whose sensor drifts."""
    (tmp_path / 'model.py').write_text(MODEL)
    (tmp_path / 'deaf.py').write_text(DEAF)
    (tmp_path / 'hanging.py').write_text(HANGING)
    for name, start, seed in (('far', 1.0, 1), ('near', 0.4, 2)):
        log = log_of(name, start, seed, {'drift': 0.01})
        names = ['turn', 'angle', 'rate']
        np.savetxt(tmp_path / f'{name}.csv', np.column_stack(
            [log.time, *(log[column] for column in names)]), delimiter=',', comments='',
            header=','.join(['time_s', *names]))
    return tmp_path


def test_diagnose_writes_verdict_and_page(folder: Path,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['diagnose', '--model', f'{folder}/model.py:machine', f'{folder}/far.csv',
                 f'{folder}/near.csv', '--json', f'{folder}/v.json',
                 '--report', f'{folder}/v.html', '--matters', 'angle=0.1']) == 0
    assert 'sensor.drift' in capsys.readouterr().out
    verdict = json.loads((folder / 'v.json').read_text())
    assert verdict['which'][0]['effects'] == ['sensor.drift']
    assert verdict['numbers']['drift']['value'] == pytest.approx(0.01, rel=0.05)
    assert '<!doctype html>' in (folder / 'v.html').read_text()


def test_diagnose_goes_on_from_a_verdict_on_the_recordings_before(
        folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ['diagnose', '--model', f'{folder}/model.py:machine', f'{folder}/far.csv']
    assert main([*words, '--json', f'{folder}/one.json']) == 0
    assert main([*words, f'{folder}/near.csv', '--after', f'{folder}/one.json',
                 '--json', f'{folder}/two.json']) == 0
    verdict = json.loads((folder / 'two.json').read_text())
    assert verdict['which'][0]['effects'] == ['sensor.drift']
    assert verdict['numbers']['drift']['value'] == pytest.approx(0.01, rel=0.05)
    capsys.readouterr()


def test_a_log_that_nothing_is_fitted_to_is_predicted(
        folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = log_of('new', 0.7, 5, {'drift': 0.01})
    np.savetxt(folder / 'new.csv', np.column_stack(
        [log.time, log['turn'], log['angle'], log['rate']]), delimiter=',', comments='',
        header='time_s,turn,angle,rate')
    assert simgap.cli.main(['diagnose', f'{folder}/model.py:machine', f'{folder}/far.csv',
                            f'{folder}/near.csv', '--unseen', f'{folder}/new.csv',
                            '--json', f'{folder}/v.json']) == 0
    found = json.loads((folder / 'v.json').read_text())['unseen']['new']['angle']
    # what a bias leaves of a drift of 0.01 t over 20 s
    assert found['before'] == pytest.approx(0.2 / np.sqrt(12.0), rel=0.1)
    assert found['after'] < 0.2 * found['before'] and found['lawful'] is None
    assert 'new, not fitted: angle is off by' in capsys.readouterr().out


@pytest.mark.parametrize(('text', 'message'), [
    ('no JSON', 'old.json: no JSON of a diagnosis'),
    ('{"verdict": "no_gap"}', 'old.json: no entry planning: a verdict of an earlier version'),
    ('{"planning": {"inflation": "much"}}', 'old.json: planning: '),
])
def test_a_verdict_that_cannot_be_gone_on_from(folder: Path, text: str, message: str,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    (folder / 'old.json').write_text(text)
    assert main(['diagnose', '--model', f'{folder}/model.py:machine', f'{folder}/far.csv',
                 '--after', f'{folder}/old.json']) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(('options', 'message'), [
    (['--model', 'none.py', 'a.csv'], 'no such Python file'),
    (['--model', 'x.py', 'a.csv', '--config', 'reference'], '--config: does not go with --model'),
    (['--model', 'x.py', 'a.csv', '--corrected', 'c.yaml'], '--corrected: does not go with'),
    (['a.csv', '--map', 'none.yaml'], 'none.yaml: No such file'),
    (['a.csv', '--after', 'none.json'], 'none.json: No such file'),
])
def test_options_that_do_not_go_together(options: list[str], message: str,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['diagnose', *options]) == 2
    assert message in capsys.readouterr().err


def wrong_logs(folder: Path) -> dict[str, str]:
    """Write logs that tell nothing; return what is said of each."""
    head, *lines = (folder / 'far.csv').read_text().splitlines(keepends=True)
    times = [line.partition(',')[0] for line in lines]
    noise = np.random.default_rng(1).normal(size=(len(times), 2))
    texts = {
        'none': head, 'one': head + lines[0], 'brief': ''.join([head, *lines[:4]]),
        'still': head + ''.join(f'{time},0,0,0\n' for time in times),
        'quiet': head + ''.join(f'{time},0,{1e-3 * angle:.9f},{1e-3 * rate:.9f}\n'
                                for time, (angle, rate) in zip(times, noise, strict=True))}
    for name, text in texts.items():
        (folder / f'{name}.csv').write_text(text)
    needed = 'two or more increasing times are needed'
    return {'none': needed, 'one': needed, 'brief': 'record a longer test',
            'still': 'at rest, nothing moves', 'quiet': 'at rest, nothing moves'}


@pytest.mark.parametrize('name', ['none', 'one', 'brief', 'still', 'quiet'])
def test_a_log_that_tells_nothing_is_refused(name: str, folder: Path,
                                             capsys: pytest.CaptureFixture[str]) -> None:
    said = wrong_logs(folder)[name]
    model, log = f'{folder}/hanging.py', f'{folder}/{name}.csv'
    for program, words in ((simgap.cli.main, ['diagnose']), (simgap.cli.main, ['check']),
                           (main, ['diagnose', '--model']), (main, ['check-model'])):
        assert program([*words, model, log]) > 0
        out, err = capsys.readouterr()
        assert said in out + err and len((out + err).splitlines()) <= 2


def test_check_model_says_yes_or_what_is_wrong(folder: Path,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    logs = [f'{folder}/far.csv', f'{folder}/near.csv']
    assert main(['check-model', f'{folder}/model.py', *logs]) == 0
    assert capsys.readouterr().out.endswith('nothing is wrong\n')
    assert main(['check-model', f'{folder}/deaf.py', *logs, '--json', f'{folder}/c.json']) == 1
    out = capsys.readouterr().out
    assert 'wrong: decay: the simulation never asks for numbers.decay' in out
    faults = json.loads((folder / 'c.json').read_text())['faults']
    assert out.endswith(f'{len(faults)} to mend\n')
    assert simgap.cli.main(['check', f'{folder}/model.py', *logs]) == 0
    assert simgap.cli.main(['check', f'{folder}/deaf.py', *logs]) == 1
    assert capsys.readouterr().out.endswith(f'{len(faults)} to mend\n')


@pytest.mark.slow
def test_both_programs_say_the_same(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, logs = f'{folder}/model.py', [f'{folder}/far.csv', f'{folder}/near.csv']
    assert main(['diagnose', '--model', model, *logs, '--json', f'{folder}/a.json']) == 0
    drive = capsys.readouterr().out
    assert simgap.cli.main(['diagnose', model, *logs, '--json', f'{folder}/b.json']) == 0
    assert capsys.readouterr().out == drive
    first, second = (json.loads((folder / f'{name}.json').read_text()) for name in 'ab')
    assert [*first] == [*second]
    assert {**first, 'seconds': 0} == {**second, 'seconds': 0}


@pytest.mark.parametrize('words', [[], *([name] for name in simgap.cli.COMMANDS)])
def test_simgap_teaches(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        simgap.cli.main([*words, '--help'])
    assert left.value.code == 0
    assert 'usage: simgap' in capsys.readouterr().out
