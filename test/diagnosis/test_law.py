# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A force that is a function of something: it is found, as what it is, and noise is none."""

from __future__ import annotations

import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import FloatArray, Motion
from simgap.settings import DEFAULT
from simgap.verdict.diagnosis import diagnose
from simgap.verdict.law import Law
from simgap.verdict.unknown_input import places
from two_lags import TIME, TwoLags

ANGLE: FloatArray = np.sin(0.9 * TIME) + 0.6 * np.sin(1.7 * TIME + 0.4)
RATE: FloatArray = np.gradient(ANGLE, TIME)
LOAD: FloatArray = 1.0 + 0.8 * np.sin(2.9 * TIME)
NOTHING = 0.0 * TIME


class Turning(TwoLags):
    """Two lags beside something that turns under a load."""

    def motion(self, experiment: int) -> Motion:
        """Return how it turns."""
        return Motion(TIME, rate=RATE, angle=ANGLE, load=LOAD)


def likeliest(left: FloatArray) -> tuple[str, Law]:
    """Return the likeliest place of a force on the left, and its law."""
    first = places(LeastSquares(Turning(left, NOTHING)), {})[0]
    assert first.law is not None
    return first.component, first.law


@pytest.mark.parametrize('by, times, force', [
    ('angle', {''}, np.where(ANGLE > 0.3, 2.0 * (ANGLE - 0.3), 0.0)),
    ('direction', {''}, 0.4 * np.sign(RATE)),
    # any function of a rate is one in proportion to its direction, too
    ('rate', {'', 'direction'}, 0.3 * RATE * np.abs(RATE)),
    ('time', {'load'}, 0.5 * LOAD * np.exp(-TIME / 10.0)),
])
def test_a_force_is_found_as_the_function_that_it_is(by: str, times: set[str],
                                                     force: FloatArray) -> None:
    component, law = likeliest(force)
    assert (component, law.by) == ('left', by) and law.times in times
    quantities = {'angle': ANGLE, 'direction': np.sign(RATE), 'rate': RATE, 'time': TIME}
    factor = {'': 1.0, 'direction': np.sign(RATE), 'load': LOAD}[law.times]
    drawn = factor * np.interp(quantities[by], law.at, law.values)
    assert np.corrcoef(drawn, force)[0, 1] > 0.95


def test_noise_has_no_law() -> None:
    found = places(LeastSquares(Turning(NOTHING, NOTHING)), {})
    assert max(place.law.evidence for place in found if place.law) < DEFAULT.evidence.shows


def test_a_law_that_noise_could_pass_for_is_no_noise() -> None:
    """A few steps of three deviations are slow noise to a filter, and follow the direction."""
    found = diagnose(Turning(0.15 * np.sign(RATE), NOTHING))
    assert (found.word, found.where[0]['signal']) == ('unknown_effect', 'seen left')
    assert diagnose(Turning(NOTHING, NOTHING)).word == 'no_gap'
