# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The documents at the top agree with the package and with each other."""

from __future__ import annotations

from pathlib import Path
import re

from antenna_drive import __version__
from antenna_drive.cli import COMMANDS
import lab.cli
import pytest
import simgap.cli
import yaml

ROOT = Path(__file__).resolve().parents[2]
TOP = sorted(path for path in ROOT.glob('*.md'))


def test_one_version() -> None:
    assert f"version='{__version__}'" in (ROOT / 'setup.py').read_text()
    assert f'<version>{__version__}</version>' in (ROOT / 'package.xml').read_text()
    assert yaml.safe_load((ROOT / 'CITATION.cff').read_text())['version'] == __version__
    assert __version__ in (ROOT / 'CHANGELOG.md').read_text()
    assert __version__ in (ROOT / 'QUALITY_DECLARATION.md').read_text()


def test_one_licence() -> None:
    licence = yaml.safe_load((ROOT / 'CITATION.cff').read_text())['license']
    assert f'<license>{licence}</license>' in (ROOT / 'package.xml').read_text()
    assert f"license='{licence}'" in (ROOT / 'setup.py').read_text()


def test_citation_has_what_the_format_requires() -> None:
    """Version 1.2.0 of the Citation File Format requires these four."""
    content = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert content['cff-version'] == '1.2.0'
    assert content['message'] and content['title']
    assert all(author.get('name') or author.get('family-names') for author in content['authors'])


def test_level_fits_the_version() -> None:
    """REP-2004 asks for a stable version from level 3 up."""
    page = (ROOT / 'QUALITY_DECLARATION.md').read_text()
    (level,) = re.findall(r'\*\*Quality Level (\d)\*\*', page)
    assert int(level) >= 4 or int(__version__.partition('.')[0]) >= 1


def test_readme_leads_to_them() -> None:
    readme = (ROOT / 'README.md').read_text()
    for name in ('QUALITY_DECLARATION.md', 'CHANGELOG.md', 'CITATION.cff', 'CONTRIBUTING.md'):
        assert f']({name})' in readme


def test_dependencies_are_declared() -> None:
    page = (ROOT / 'QUALITY_DECLARATION.md').read_text()
    package = (ROOT / 'package.xml').read_text()
    for name in re.findall(r'<exec_depend>(\w+)</exec_depend>', package):
        assert name in page
    setup = (ROOT / 'setup.py').read_text()
    required = setup[setup.index('install_requires'):setup.index('extras_require')]
    for name in re.findall(r"'(\w+) >=", required):
        assert name in page


@pytest.mark.parametrize('page', TOP, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in re.findall(r'\]\((?!https?:)([^)#]+)\)', page.read_text()):
        assert (page.parent / target).exists(), target


def test_commands_of_the_changelog_are_there() -> None:
    for name in re.findall(r'^- `([a-z][a-z-]*)`: ', (ROOT / 'CHANGELOG.md').read_text(), re.M):
        assert name in {*COMMANDS, *lab.cli.COMMANDS, *simgap.cli.COMMANDS}
