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
"""The next test for a growing verdict: asked for, designed, told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antenna_drive.errors import UserError
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.twin.proposing import NextTest
from later import Later

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
