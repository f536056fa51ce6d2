# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a law, read back from its SVG by another program."""

from __future__ import annotations

import numpy as np
import pytest
from simgap.machine.with_law import Law
from simgap.report.law_picture import picture

AT, VALUES, DEVIATIONS = (-2.0, 0.0, 1.0, 4.0), (-3.0, 0.0, 1.0, 5.0), (0.5, 0.0, 0.25, 1.0)


def read(points: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return the corners of an SVG path, shape (n, 2)."""
    return np.array([[float(part) for part in corner.split(',')] for corner in points.split()])


def test_the_curve_and_its_band_are_read_back_from_the_edges() -> None:
    found = picture(Law('rate', '', 9.0, AT, VALUES, DEVIATIONS, 'rad/s', 'N', 1.0, 1.0))
    width, height = found['box']
    low, high = float(found['low']), float(found['high'])
    assert (low, high, found['begin'], found['end']) == (-4.0, 7.0, '-2', '4')

    def values(points: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        corners = read(points)
        return np.column_stack([-2.0 + corners[:, 0] / width * 6.0,
                                high - corners[:, 1] / height * (high - low)])

    assert values(found['line']) == pytest.approx(np.column_stack([AT, VALUES]), abs=0.01)
    upper, lower = np.split(values(found['band'])[:, 1], 2)
    assert upper == pytest.approx(np.array(VALUES) + 2.0 * np.array(DEVIATIONS), abs=0.01)
    assert lower[::-1] == pytest.approx(np.array(VALUES) - 2.0 * np.array(DEVIATIONS), abs=0.01)
    assert high - found['zero'] / height * (high - low) == pytest.approx(0.0, abs=1e-9)
