# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The Cholesky factor of a matrix that rounding has made indefinite, against numpy's own."""

from __future__ import annotations

from antenna_drive.diagnosis.cholesky import factored, solved
import numpy as np
import pytest


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
