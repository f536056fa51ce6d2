# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The Cholesky factor of a matrix that rounding has made indefinite, against numpy's own."""

from __future__ import annotations

import numpy as np
import pytest
from simgap.fit.cholesky import factored, solved


def test_of_a_positive_definite_matrix_it_is_the_usual_factor() -> None:
    columns = np.random.default_rng(0).normal(size=(50, 4))
    columns /= np.linalg.norm(columns, axis=0)
    matrix = columns.T @ columns
    factor, right = factored(matrix), np.arange(8.0).reshape(4, 2)
    assert np.tril(factor) == pytest.approx(np.linalg.cholesky(matrix), rel=1e-12)
    assert solved(factor, right) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-10)


@pytest.mark.parametrize('wrong', [np.nan, np.inf])
def test_what_is_no_number_is_refused_and_not_raised_for_ever(wrong: float) -> None:
    with pytest.raises(ValueError, match='infs or NaNs'):
        factored(np.array([[1.0, wrong], [wrong, 1.0]]))


@pytest.mark.parametrize('ridge', [0.0, 1e-6])
def test_a_direction_that_rounding_has_turned_down_is_not_gone_along(ridge: float) -> None:
    """Its eigenvalue is -1e-4 instead of 0: a step along it would be 1e4 long, and wrong."""
    flat = np.array([1.0, -1.0, 0.0]) / 2.0 ** 0.5
    steep = np.array([1.0, 1.0, 0.0]) / 2.0 ** 0.5
    matrix = (2.0 * np.outer(steep, steep) - 1e-4 * np.outer(flat, flat)
              + np.diag([0.0, 0.0, 1.0]))
    assert np.linalg.eigvalsh(matrix)[0] == pytest.approx(-1e-4)
    factor = factored(matrix, ridge)
    assert solved(factor, steep) == pytest.approx(0.5 * steep, abs=1e-3)
    assert solved(factor, np.array([0.0, 0.0, 1.0])) == pytest.approx([0.0, 0.0, 1.0], abs=1e-2)
