# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the page is told of twins is checked first: anything may be on a topic."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given, strategies as st
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no twin to listen to')

from antenna_drive.live.twins import next_test_of, verdict_of  # noqa: E402, I100
from stand_in_twin import NEXT_TEST, VERDICT  # noqa: E402

ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner,
                                                                max_size=4), max_leaves=8)
READERS = ((verdict_of, VERDICT), (next_test_of, NEXT_TEST))


@pytest.mark.parametrize(('read', 'told'), READERS)
def test_what_a_twin_tells_is_passed_on(read: Any, told: dict[str, Any]) -> None:
    assert read(json.dumps(told)) == told


@pytest.mark.parametrize(('read', 'told'), READERS)
@given(data=st.data())
def test_with_anything_in_place_of_an_entry_nothing_or_plain_data_is_told(
        read: Any, told: dict[str, Any], data: st.DataObject) -> None:
    key = data.draw(st.sampled_from(sorted(told)))
    found = read(json.dumps({**told, key: data.draw(ANYTHING)}))
    assert found is None or (set(found) == set(told) and json.dumps(found, allow_nan=False))


@pytest.mark.parametrize(('read', 'told'), READERS)
@given(text=st.text() | ANYTHING.map(json.dumps))
def test_of_any_text_nothing_is_told(read: Any, told: dict[str, Any], text: str) -> None:
    assert read(text) is None


@pytest.mark.parametrize('text', ['[' * 100_000, ' ' * 300_000, '{"looks": 1e999}'])
@pytest.mark.parametrize(('read', 'told'), READERS)
def test_what_is_too_deep_or_too_long_is_left_out(
        read: Any, told: dict[str, Any], text: str) -> None:
    assert read(text) is None
