# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Budgets of lines: a change that exceeds one removes something.

An exception has a number of its own, which may only fall: the test fails where it could be lower.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HOUSES = ('simgap', 'antenna_drive', 'lab')
# Lines of Python: what a user installs, and the parts of it.
INSTALLED, ENGINE, LABORATORY = 42_000, 15_377, 15_973
FILE, FUNCTION, README, PAGE, DECISION_WORDS = 400, 60, 200, 300, 80

LONG_FILES: dict[str, int] = {}
LONG_FUNCTIONS: dict[str, int] = {
    # compiled loops, whose parts share their state
    'lab/servo/physics.py:swing': 82,
    'lab/antenna/integrator.py:integrate': 67,
}


def sources(house: str) -> list[Path]:
    """Return the Python files of a house."""
    found = sorted((ROOT / house).rglob('*.py'))
    assert found, f'{house} has no source'
    return found


def lines(path: Path) -> int:
    """Return the number of lines of a file."""
    return len(path.read_text(encoding='utf-8').splitlines())


def total(house: str) -> int:
    """Return the lines of a house."""
    return sum(map(lines, sources(house)))


def over(found: dict[str, int], budget: int, exceptions: dict[str, int]) -> dict[str, str]:
    """Return what exceeds the budget or its exception, and exceptions that are too generous."""
    wrong = {name: f'{size} lines, allowed are {exceptions.get(name, budget)}'
             for name, size in found.items() if size > exceptions.get(name, budget)}
    return wrong | {name: f'{found.get(name, 0)} lines: lower the exception from {size}'
                    for name, size in exceptions.items() if found.get(name, 0) < size}


def test_what_a_user_installs() -> None:
    """The engine and the drive together."""
    assert total('simgap') + total('antenna_drive') <= INSTALLED


@pytest.mark.parametrize('house, budget', [('simgap', ENGINE), ('lab', LABORATORY)])
def test_a_house(house: str, budget: int) -> None:
    """The engine, and the laboratory."""
    assert total(house) <= budget


def test_files() -> None:
    """No file is longer than a reader's patience."""
    found = {str(path.relative_to(ROOT)): lines(path) for house in HOUSES
             for path in sources(house)}
    assert over(found, FILE, LONG_FILES) == {}


def test_functions() -> None:
    """No function is longer than a screen."""
    found: dict[str, int] = {}
    for house in HOUSES:
        for path in sources(house):
            for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
                if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                    assert node.end_lineno is not None
                    name = f'{path.relative_to(ROOT)}:{node.name}'
                    found[name] = max(found.get(name, 0), node.end_lineno - node.lineno + 1)
    assert over(found, FUNCTION, LONG_FUNCTIONS) == {}


def test_readme() -> None:
    """The first page."""
    assert lines(ROOT / 'README.md') <= README


def test_pages_of_the_documentation() -> None:
    """A page of docs/ is read in one go."""
    found = {str(path.relative_to(ROOT)): lines(path)
             for path in sorted((ROOT / 'docs').glob('*.md')) if path.name != 'decisions.md'}
    assert found and over(found, PAGE, {}) == {}


def test_decisions() -> None:
    """A decision says what, why and what was rejected, and no more."""
    text = (ROOT / 'docs' / 'decisions.md').read_text(encoding='utf-8')
    decisions = [part for part in text.split('\n\n') if part.startswith('**')]
    assert len(decisions) >= 40, 'no decisions were found'
    assert [decision[:60] for decision in decisions
            if len(decision.split()) > DECISION_WORDS] == []
