# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Sizes in the text of commands, as people say them."""

from __future__ import annotations

import math

from antenna_drive.cli.confusability import _size
from antenna_drive.cli.predict import _change
import pytest
from simgap.cli.propose import in_percent
from simgap.next_test.proposal import lines
from simgap.verdict.spoken import size


@pytest.mark.parametrize('now, before, text', [
    (0.25, 1.0, '75 % less'), (1.0, 1.0, '0 % less'), (1.5, 1.0, '50 % more'),
    (931.0, 1.0, '930 times more'), (1.0, 0.0, 'where there was nothing'),
    (0.0, 0.0, '0 % less')])
def test_a_prediction_that_is_worse_is_not_less_than_nothing(now: float, before: float,
                                                             text: str) -> None:
    assert _change(now, before) == text


def test_what_no_test_shows_has_no_size() -> None:
    assert _size(math.inf, 'rad') == 'does not show'
    assert (_size(0.053, '1'), _size(0.01, 'rad')) == ('5.3 %', '0.01 rad')


def test_sizes_of_no_unit_are_in_percent() -> None:
    sizes = {'gear.gap': {'size': 0.02, 'unit': '1'}, 'gear.shaft': {'size': None, 'unit': '1'},
             'dial.zero': {'size': 0.02, 'unit': 'rad'}}
    told = lines(in_percent({
        'helps': True, 'family': 'steps', 'limits_used': {'rate': 0.5}, 'not_told_apart': [],
        'refused': {}, 'smallest_sizes': sizes}))
    assert told[1:] == ['  dial.zero: shows from 0.02 rad', '  gear.gap: shows from 2 %',
                        '  gear.shaft: shows from no size on']
    assert size(0.02, '1') == '2 percent' and size(0.02, 'rad') == '0.02 rad'
