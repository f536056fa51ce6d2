# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the README says of topics, parameters and files is so."""

from pathlib import Path
import re

from antenna_drive.cli import COMMANDS
from antenna_drive.emulator import wiring
from antenna_drive.emulator.units import build
from antenna_drive.parameters import load
import pytest

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / 'README.md').read_text()
PAGES = sorted([ROOT / 'README.md', *(ROOT / 'docs').rglob('*.md')])


def test_every_signal_has_its_line() -> None:
    for name in wiring.signal_names():
        if not name.startswith('motor_2/'):
            unit, _, signal = name.partition('/')
            (line,) = re.findall(rf'^\| `{name}` \| (.*?) \|', README, re.M)
            known = {item.name: item.unit for item in wiring.OUTPUTS[unit]}[signal]
            assert line.removeprefix('article ') == known


@pytest.mark.parametrize('unit', wiring.UNITS)
def test_every_tuning_parameter_is_named_and_no_other(unit: str) -> None:
    table = README[README.index('| node | tuning parameter'):README.index('At the start only')]
    for name, (entry, _) in build(unit, load()).settings().items():
        named = f'`{name}`' in table
        if name.startswith('torque.') or name == 'external':
            continue  # told by the row for all of them, and by the topic
        assert named == entry.live, name


def test_every_command_is_named() -> None:
    for command in COMMANDS:
        assert f'`{command}`' in README or f'antenna-drive {command}' in README, command


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in re.findall(r'\]\((?!https?:)([^)#]+)\)', page.read_text()):
        assert (page.parent / target).exists(), target
