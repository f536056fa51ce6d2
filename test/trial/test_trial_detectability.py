# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The measure of detectability against the closed form of a ridge in one dimension."""

from __future__ import annotations

import math

from lab.antenna.detectability import Study
import numpy as np
import pytest


def study(nuisance: list[float]) -> Study:
    """Return a study with one nuisance and no simulations."""
    made = object.__new__(Study)
    made._nuisance = np.array(nuisance)[:, None]
    made._solver = np.linalg.inv(made._nuisance.T @ made._nuisance + np.eye(1))
    made._base = np.zeros(len(nuisance))
    return made


@pytest.mark.parametrize('size', [0.5, 3.0])
def test_an_imitated_effect_shows_only_as_far_as_the_prior_resists(
        size: float, monkeypatch: pytest.MonkeyPatch) -> None:
    made = study([3.0, 4.0])
    monkeypatch.setattr(made, '_signals', lambda *_: size * made._nuisance[:, 0])
    whole, beyond = made.of('x', {})
    assert whole == pytest.approx(5.0 * size)
    # minimum of |change - a n|^2 + a^2 for change = size n, |n|^2 = 25
    assert beyond == pytest.approx(size * math.sqrt(25.0 / 26.0))


def test_an_effect_that_nothing_imitates_shows_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    made = study([3.0, 4.0])
    monkeypatch.setattr(made, '_signals', lambda *_: np.array([-8.0, 6.0]))
    assert made.of('x', {}) == pytest.approx((10.0, 10.0))
