# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Sizes in the text of commands, as people say them."""

from __future__ import annotations

import math

from antenna_drive.cli.confusability import _size
from antenna_drive.cli.predict import _change
import pytest


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
