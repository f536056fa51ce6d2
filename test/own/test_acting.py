# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""When something unknown acts: the moments at which it was let in and taken away."""

from __future__ import annotations

import numpy as np
from own.swing import logs, swing, TIME
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.model import OwnMachine
from simgap.verdict.localisation import loud_span, of_the_unknown


@pytest.mark.parametrize('begin, end', [(6.0, 13.0), (12.0, None), (None, 6.0)])
def test_a_push_is_told_from_its_begin_to_its_end(begin: float | None,
                                                  end: float | None) -> None:
    wind = np.where((TIME >= (begin or 0.0)) & (TIME < (end or 99.0)), 0.2, 0.0)
    quiet, pushed = (LeastSquares(OwnMachine(swing(), tests)) for tests in (
        logs(), logs(wind=wind)))
    # the numbers of the model are known: with the push they would take a share of it
    numbers = quiet.machine.nuisances
    known = quiet.fit(quiet.start(numbers, {}), 20).point()
    first, *_ = of_the_unknown(pushed, pushed.start(numbers, known), {'swing': 1.0})
    spans = first['acts']
    assert [span['test'] for span in spans] == ['far', 'near']
    for span in spans:
        for said, true in ((span['from_s'], begin), (span['until_s'], end)):
            assert (said is None) is (true is None)
            assert true is None or said == pytest.approx(true, abs=0.5)


def test_what_acts_from_the_beginning_to_the_end_has_no_moment() -> None:
    random = np.random.default_rng(5)
    noise, able = random.standard_normal(2000), np.ones(2000, bool)
    assert loud_span(noise, able) is None
    assert loud_span(6.0 * noise, able) is None
    loud = noise.copy()
    loud[700:1200] *= 6.0
    first, last = loud_span(loud, able) or (0, 0)
    assert [first, last] == pytest.approx([700, 1200], abs=15)


def test_what_is_quiet_only_while_nothing_moves_has_no_moment() -> None:
    random = np.random.default_rng(6)
    loud, able = random.standard_normal(2000), np.arange(2000) >= 900
    loud[900:] *= 6.0
    assert loud_span(loud, np.ones(2000, bool)) is not None
    assert loud_span(loud, able) is None
    assert loud_span(np.zeros(0), np.zeros(0, bool)) is None
