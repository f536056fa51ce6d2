# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What expressions do with whole columns has closed forms, at uneven times as at even ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simgap.inputs.schema import ParameterError
from simgap.logs.channel import RecordingError
from simgap.logs.column_map import parse_map
from simgap.logs.expression import parse_expression
from simgap.logs.mapped import read_file
from simgap.logs.whole_columns import derivative, previous, smooth

# whole microseconds, which a stamp of nanoseconds holds
TIME: Any = 1e-6 * np.cumsum(np.random.default_rng(3).integers(1000, 20_000, 400))


def test_the_derivative_of_a_parabola_is_a_straight_line() -> None:
    assert derivative(TIME, 3.0 * TIME ** 2 - TIME) == pytest.approx(6.0 * TIME - 1.0, abs=1e-8)
    assert derivative(TIME[:2], TIME[:2]) == pytest.approx(1.0)


def test_a_straight_line_stays_as_it_is_up_to_its_ends() -> None:
    assert smooth(TIME, 2.0 - 3.0 * TIME, 0.5) == pytest.approx(2.0 - 3.0 * TIME, abs=1e-10)


def test_a_wave_gets_smaller_by_the_mean_over_its_phase() -> None:
    rate, seconds = 4.0, 0.5
    share = np.sin(0.5 * rate * seconds) / (0.5 * rate * seconds)
    inside = (TIME > TIME[0] + 0.5 * seconds) & (TIME < TIME[-1] - 0.5 * seconds)
    found = smooth(TIME, np.sin(rate * TIME), seconds)[inside]
    # straight lines instead of the wave between two samples
    assert found == pytest.approx(share * np.sin(rate * TIME[inside]), abs=0.02 ** 2 * rate ** 2)


def test_noise_gets_smaller_by_the_root_of_the_samples() -> None:
    time: Any = 0.01 * np.arange(20_000)
    found = smooth(time, np.random.default_rng(5).standard_normal(time.size), 1.0)
    assert float(np.std(found)) == pytest.approx(0.1, rel=0.05)


def test_a_window_below_a_step_is_nearly_the_sample() -> None:
    values = np.sin(TIME)
    assert smooth(TIME, values, 1e-6) == pytest.approx(values, abs=1e-6)
    assert smooth(TIME[:1], values[:1], 1.0).tolist() == values[:1].tolist()


def test_the_sample_before() -> None:
    assert previous(TIME[:4], np.array([5.0, 1.0, 2.0, 3.0])).tolist() == [5.0, 5.0, 1.0, 2.0]
    assert previous(TIME[:0], TIME[:0]).size == 0


def read(path: Path, expression: str, rows: list[tuple[Any, ...]], names: str = 't,x,y',
         constants: dict[str, float] | None = None, **time: Any) -> np.ndarray[Any, Any]:
    """Return the values of an expression over the columns of a table."""
    path.write_text(f'{names}\n' + ''.join(','.join(map(str, row)) + '\n' for row in rows))
    found = read_file(path, parse_map({'time': {'column': 't', **time}, 'signals': {
        'found': {'expression': expression, 'unit': 'deg', 'scale': 2.0}}}), constants)
    return found.channels['found'].values


ROWS = list(zip(TIME.tolist(), (TIME ** 2).tolist(), np.cos(TIME).tolist(), strict=True))


@pytest.mark.parametrize(('expression', 'expected'), [
    ('derivative(x)', 2.0 * TIME),
    ('y * derivative(k * x) + y', np.cos(TIME) * (6.0 * TIME + 1.0)),
    ('derivative(derivative(x)) + derivative(y - y)', 2.0 + 0.0 * TIME),
    ('x - previous(x)', np.r_[0.0, np.diff(TIME ** 2)]),
    ('smooth(derivative(x), 0.1)', 2.0 * TIME), ('previous(t) * k', 3.0 * np.r_[
        TIME[:1], TIME[:-1]])])
def test_they_stand_where_a_number_does(expression: str, expected: Any, tmp_path: Path) -> None:
    found = read(tmp_path / 'a.csv', expression, ROWS, constants={'k': 3.0})
    assert found == pytest.approx(np.radians(2.0 * expected), abs=1e-6)


def test_a_row_without_a_sample_does_not_count(tmp_path: Path) -> None:
    rows = [(t, '' if k % 3 else x, y) for k, (t, x, y) in enumerate(ROWS)]
    found = read(tmp_path / 'a.csv', 'derivative(x)', rows)
    assert found == pytest.approx(np.radians(4.0 * TIME[::3]), abs=1e-6)


@pytest.mark.parametrize(('duplicates', 'expected'), [
    ('first', [1.0, 1.0, 2.0]), ('last', [1.0, 1.0, 3.0])])
def test_of_repeated_stamps_one_counts(duplicates: str, expected: list[float],
                                       tmp_path: Path) -> None:
    rows = [(0, 1, 0), (1, 2, 0), (1, 3, 0), (2, 4, 0)]
    with pytest.warns(UserWarning, match='repeated'):
        found = read(tmp_path / 'a.csv', 'previous(x)', rows, duplicates=duplicates)
    assert np.degrees(found / 2.0) == pytest.approx(expected)


@pytest.mark.parametrize(('expression', 'words'), [
    ('derivative(1 / x)', 'line 3, column x: the expression has no value, float division'),
    ('1 / previous(x)', 'line 4, column x: the expression has no value, float division'),
    ('1e300 * previous(x) * 1e300', 'line 2, column x: too large')])
def test_a_value_that_is_none_is_refused_with_its_place(expression: str, words: str,
                                                        tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=words):
        read(tmp_path / 'a.csv', expression, [(0, 1, 0), (1, 0, 0), (2, 4, 0)])


def test_one_sample_has_no_derivative(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='line 2, column x: .*needs two samples'):
        read(tmp_path / 'a.csv', 'derivative(x)', [(0, 1, 0)])


@pytest.mark.parametrize(('text', 'words'), [
    ('derivative(a, 1)', 'derivative takes 1 number'), ('smooth(a)', 'smooth takes 2 numbers'),
    ('smooth(a, 0)', 'smooth takes a column and a number above 0'),
    ('smooth(a, b)', 'smooth takes a column and a number above 0'),
    ('smooth(a, -1)', 'smooth takes a column and a number above 0'),
    ('previous()', 'previous takes 1 number'), ('derivate(a)', 'did you mean derivative'),
    ('smooth(a, True)', 'True.* is not allowed')])
def test_what_they_take(text: str, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        parse_expression('k', text)
