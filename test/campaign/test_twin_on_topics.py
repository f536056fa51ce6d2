# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""When a twin's node has told a gap, from what it said on /diagnostics."""

from __future__ import annotations

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: nobody says anything')

from antenna_drive.twin.watch import GAP, LEARNING, OK  # noqa: E402, I100
from lab.campaign.rig import Said  # noqa: E402
from lab.campaign.twin_on_topics import told  # noqa: E402

# The test began at 1000 s of the one clock and 5000 s of the other; its onset is 330 s later.
ZERO_S, ZERO_NS, ONSET_S = 1000.0, 5000 * 10**9, 330.0


def said(after_s: float, state: str, *since_s: float, node: str = 'twin') -> Said:
    """Return a report, so many seconds after the beginning; with a gap since each moment."""
    gaps = {f'gap signal_{k}': f'signal_{k}: 2 A, since stamp {5000.0 + moment:.3f} s'
            for k, moment in enumerate(since_s)}
    return Said(ZERO_S + after_s, '/', node, 0, state, {
        'state': state, 'tuning': 'tuned', 'blocks judged': '40',
        'blocks not judged': '3 (motion beyond that of the quiet record)', **gaps})


def test_a_gap_is_timed_from_the_onset() -> None:
    result = told([said(10.0, LEARNING), said(320.0, OK), said(335.5, GAP, 331.0, 329.25),
                   said(336.5, GAP, 331.0)], ZERO_S, ZERO_NS, ONSET_S)
    assert result['told_after_s'] == pytest.approx(5.5)
    assert result['since_s'] == pytest.approx(-0.75)
    assert len(result['gaps']) == 2
    assert result['alarms'] == []
    assert (result['judged'], result['unjudged'], result['tuning']) == (40, 3, 'tuned')


def test_a_gap_before_the_onset_is_a_false_alarm() -> None:
    result = told([said(320.0, OK), said(325.0, GAP, 324.0), said(326.0, GAP, 324.0),
                   said(327.0, OK), said(333.0, GAP, 331.0)], ZERO_S, ZERO_NS, ONSET_S)
    assert [alarm['time_s'] for alarm in result['alarms']] == pytest.approx([325.0])
    assert result['told_after_s'] == pytest.approx(3.0)


def test_what_nobody_tells_is_not_told() -> None:
    result = told([said(340.0, OK), said(350.0, GAP, 341.0, node='another')],
                  ZERO_S, ZERO_NS, ONSET_S)
    assert result['told_after_s'] is None
    assert result['gaps'] == []
