# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The figures: each drawn, with its axes, in a file of its own and on one page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import re
from xml.etree import ElementTree

from antenna_drive import cli
from antenna_drive.article import figures, loaded_axis
from antenna_drive.article.measures import Results, with_circuits
import numpy as np
import pytest
from simgap.command.programs import OK

NUMBERS = (1, 2, 3, *range(8, 14), *range(15, 24))
# The article's axes: what stands along them, and in which unit.
AXES = {
    1: ('deg', 'N m'), 2: ('percent', 'percent'), 8: ('s', 'deg/s'), 9: ('s', 'A'),
    10: ('s', 'deg'), 11: ('s', 'deg/s'), 12: ('s', 'A'), 13: ('s', 'deg'), 15: ('A', 'V'),
    16: ('A', 'V'), 17: ('percent', 'percent'), 18: ('s', 'deg/s'), 19: ('s', 'V'),
    20: ('s', 'V'), 21: ('s', 'percent'), 22: ('s', 'percent'), 23: ('s', 'percent'),
}


@pytest.fixture
def short_load(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let the load rise and fall faster than for the true figure: only drawing is tested."""
    monkeypatch.setattr(loaded_axis, 'PERIOD', 8.0)
    loaded_axis.loaded.cache_clear()
    yield
    loaded_axis.loaded.cache_clear()


@pytest.fixture(scope='module')
def results() -> Results:
    return Results(with_circuits())


@pytest.mark.slow
def test_every_figure_is_a_file_and_on_the_page(
        short_load: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('antenna_drive.cli.article.EXPERIMENTS', ('T3a',))
    folder = tmp_path / 'new' / 'figures'
    assert cli.main(['article', '--figures', str(folder)]) == OK
    assert {path.name for path in folder.iterdir()} == {
        *(f'fig_{number:02d}.svg' for number in NUMBERS), 'figures.html'}
    for number in NUMBERS:
        root = ElementTree.parse(folder / f'fig_{number:02d}.svg').getroot()
        assert root.tag.endswith('svg')
    page = (folder / 'figures.html').read_text()
    assert re.findall(r'<b>Fig\. (\d+)\.</b>', page) == [str(number) for number in NUMBERS]
    assert page.count('data:image/svg+xml;base64,') == len(NUMBERS)


@pytest.mark.parametrize('number', AXES)
def test_axes_are_the_articles(number: int, results: Results, short_load: None) -> None:
    draw = figures.FIGURES[number]
    axes = draw(results).axes
    x, y = AXES[number]
    labels = [axis.get_xlabel() for axis in axes if axis.get_xlabel()]
    assert labels
    assert all(re.search(rf', {re.escape(x)}\b', label) for label in labels)
    labels = [axis.get_ylabel() for axis in axes if axis.get_ylabel()]
    assert labels
    assert all(re.search(rf', {re.escape(y)}\b', label) for label in labels)


def test_the_drawn_backlash_is_equation_1(results: Results) -> None:
    line, = figures.backlash(results).axes[0].lines
    twist, torque = map(np.asarray, line.get_data())
    expected = [0.0 if abs(x) <= 1.0 else 20.0 * (x - 1.0 if x > 0.0 else x + 1.0) for x in twist]
    assert torque == pytest.approx(expected)
