# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What pages tell a reader to type is understood, and what they quote of it is what is said."""

from __future__ import annotations

from pathlib import Path
import re
import runpy
import subprocess
import sys
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.article.readings import bias_range
from antenna_drive.emulator.run import simulate
from installations import ROOT
import pytest
from quoted import (
    blocks_of, commands_of, environment, options_known, PROGRAMS, shown_in, understood,
)
from simgap.model import diagnose_logs, load_model, Log

PAGES = sorted([ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *(ROOT / 'docs').glob('*.md'),
                ROOT / 'simgap' / 'README.md', ROOT / 'lab' / 'README.md',
                *(ROOT / 'examples').rglob('README.md')])
COMMANDS = {command: folder for page in PAGES for folder, command in commands_of(page)}
_SENTENCE = re.compile(rf'`((?:{"|".join(PROGRAMS)}) (?!->)[^`\n]+)`')
_FOLDERS = '|'.join(('antenna_drive', 'simgap', 'lab', 'test', 'examples', 'docs', 'config',
                     'scripts'))
_PATH = re.compile(rf'`((?:{_FOLDERS})/[\w./-]+\.\w+)`')


def test_they_are_found() -> None:
    assert len(COMMANDS) > 60
    assert 'make test' in ' '.join(COMMANDS)


@pytest.mark.parametrize('command', COMMANDS)
def test_a_command_is_understood(command: str) -> None:
    understood(command, COMMANDS[command])


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_and_files_in_sentences_are_there(page: Path) -> None:
    text = page.read_text(encoding='utf-8')
    assert [found for found in _SENTENCE.findall(text) if not options_known(found)] == []
    assert [found for found in _PATH.findall(text) if not (ROOT / found).exists()] == []


def test_what_is_not_there_is_seen() -> None:
    for wrong in ('antenna-drive recrod --out x', 'antenna-drive record --long', 'make tests',
                  "pip install '.[everything]'", 'ros2 run antenna_drive motor',
                  'ros2 param set /plant bias_pot 1', 'python examples/none.py'):
        with pytest.raises((AssertionError, SystemExit)):
            understood(wrong)
    assert not options_known('simgap diagnose --soon')
    said = 'named:  gap 0.401 rad (0.4 to 0.402)\nand more'
    assert shown_in('gap 0.4 rad (0.4\nto ...', said, 0.01) == []
    assert shown_in('gap 0.5 rad', said, 0.01) == ['gap 0.5 rad']


@pytest.mark.slow
@pytest.mark.parametrize(('circuit', 'test'), [('old', 'T3a'), ('new', 'T3b')])
def test_the_first_figures_of_the_readme_are_obtained(circuit: str, test: str) -> None:
    [row] = re.findall(rf'^\| {circuit} circuit .*\| (.*) \|$', (ROOT / 'README.md').read_text(),
                       re.M)
    experiment = experiments()[test]
    run = simulate(experiment.drive(), duration=experiment.duration)
    found = bias_range(run.time, run['torque_share/bias_voltage'], 5.0)
    zero = (f'{100 * found.zero_fraction:.0f} percent of the time at zero'
            if found.zero_fraction else 'never zero')
    assert row == f'{found.low_V:.1f} to {found.high_V:.1f} V, {zero}'


@pytest.mark.trial
def test_the_first_half_hour_says_what_its_page_quotes(tmp_path: Path) -> None:
    """Logs are made, checked and diagnosed; how long that takes is not compared."""
    (tmp_path / 'examples').symlink_to(ROOT / 'examples')
    typed, said, compared = 'function simgap { python -m simgap "$@"; }\n', '', 0
    for block in blocks_of(ROOT / 'simgap' / 'README.md'):
        if block.startswith(('simgap', 'python')) and 'my_machine' not in block:
            done = subprocess.run(['bash', '-ec', typed + block], cwd=tmp_path, text=True, env={
                **environment(), 'PATH': f'{Path(sys.executable).parent}:/usr/bin:/bin'},
                capture_output=True)
            assert done.returncode == 0, done.stderr
            said = done.stdout
        elif said:
            shown = re.sub('^one run of all tests takes.*$', '...', block, flags=re.M)
            assert shown_in(shown, said, 0.02) == [], said
            compared, said = compared + 1, ''
    assert compared == 4


@pytest.mark.trial
@pytest.mark.parametrize('fault', ['nothing', 'compliance', 'load_friction', 'delay', 'backlash'])
def test_the_verdicts_on_a_joint_are_those_of_its_page(fault: str) -> None:
    folder = ROOT / 'examples' / 'robot_joint_files'
    maker = runpy.run_path(str(folder / 'make_logs.py'))
    logs = []
    for seed, name in enumerate(('steps', 'sweep')):
        rows: Any = maker['log_of'](maker[name], maker['FAULTS'][fault], seed)
        logs.append(Log(name, rows[:, 0], dict(zip(
            ('reference_rad', 'motor_rad', 'torque_Nm'), rows[:, 1:].T, strict=True))))
    first = diagnose_logs(load_model(f'{folder}/machine.py'), logs).which[0]
    [row] = re.findall(rf'^\| `{fault}` .*$', (folder / 'README.md').read_text(), re.M)
    _, answer, probability, size = (cell.strip() for cell in row.strip('|').split('|'))
    assert ' '.join(first.effects or ['none']) == answer
    assert first.probability == pytest.approx(float(probability), abs=0.005)
    sizes = [(item['value'], *item['ci95']) for item in first.parameters.values()]
    stated = re.findall(r'[\d.]+', size.partition(' instead')[0])
    assert [*map(float, stated)] == pytest.approx(
        [value for item in sizes for value in item], rel=0.01)
