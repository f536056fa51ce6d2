# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the README and the pages say of topics, parameters, commands and files is so."""

from pathlib import Path
import re

from antenna_drive.cli import COMMANDS
from antenna_drive.emulator import wiring
from antenna_drive.emulator.units import build
from antenna_drive.parameters import load
import lab.cli
import pytest
import simgap.cli

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / 'README.md').read_text()
TOPICS = (ROOT / 'docs' / 'topics.md').read_text()
ENGINE, LABORATORY = ((ROOT / house / 'README.md').read_text() for house in ('simgap', 'lab'))
PAGES = sorted([ROOT / 'README.md', ROOT / 'simgap' / 'README.md',
                *(ROOT / 'docs').rglob('*.md'), *(ROOT / 'lab').rglob('*.md'),
                *(ROOT / 'examples').rglob('*.md')])


def test_every_signal_has_its_line() -> None:
    for name in wiring.DRIVE.signals:
        if not name.startswith('motor_2/'):
            unit, _, signal = name.partition('/')
            (line,) = re.findall(rf'^\| `{name}` \| (.*?) \|', TOPICS, re.M)
            known = {item.name: item.unit for item in wiring.OUTPUTS[unit]}[signal]
            assert line == known


@pytest.mark.parametrize('unit', wiring.UNITS)
def test_every_tuning_parameter_is_named_and_no_other(unit: str) -> None:
    table = TOPICS[TOPICS.index('| node | tuning parameter'):TOPICS.index('At the start only')]
    for name, (entry, _) in build(unit, load()).settings().items():
        named = f'`{name}`' in table
        if name.startswith('torque.') or name == 'external':
            continue  # the row for all of them has it, and the topic
        assert named == entry.live, name


def test_every_command_is_named() -> None:
    for command in COMMANDS:
        assert f'`{command}`' in README or f'antenna-drive {command}' in README, command
    for command in lab.cli.COMMANDS:
        assert f'`lab {command}' in LABORATORY, command
    for command in simgap.cli.COMMANDS:
        assert f'simgap {command}' in ENGINE, command


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in re.findall(r'\]\((?!https?:)([^)#]+)\)', page.read_text()):
        assert (page.parent / target).exists(), target
