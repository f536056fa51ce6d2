# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The next test for a growing verdict: asked for, designed, told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.twin.growing import NextTest
from later import Later
from simgap.errors import UserError

FOUND = {'say': ['next test: chirp'], 'test': {'circuit': 'new'}, 'sheet': 'circuit: new'}


def design(planning: Mapping[str, Any], drive: Drive) -> dict[str, Any]:
    if not planning:
        raise UserError('nothing to tell apart')
    return FOUND


def test_it_is_told_when_it_is_there() -> None:
    later = Later()
    following = NextTest(later, load(), design)
    assert not following.under_way and not following.take()
    following.begin({'rivals': 2}, 45.0)
    assert following.message() == {'under_way': True, 'after_s': 45.0, 'fault': '', 'say': [],
                                   'test': None, 'sheet': ''}
    assert not following.take()
    later.tasks.pop()()
    assert following.take() and not following.take()
    assert following.message() == {'under_way': False, 'after_s': 45.0, 'fault': '', **FOUND}


def test_a_new_one_takes_the_place_of_the_last_and_a_fault_is_told() -> None:
    later = Later()
    following = NextTest(later, load(), design)
    for planning in ({'rivals': 2}, {}):
        following.begin(planning, 45.0)
        later.tasks.pop()()
        assert following.take()
    assert following.message()['fault'] == 'nothing to tell apart'
    assert following.message()['test'] is None
