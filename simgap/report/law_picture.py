# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A law as a picture: its curve within a band of two deviations, where the data reach."""

from typing import Any

import numpy as np
from simgap.machine.with_law import Law
from simgap.verdict.spoken import number

WIDTH, HEIGHT, _DOTS = 440.0, 150.0, 60


def picture(law: Law) -> dict[str, Any]:
    """Return polygons of a law in a box of WIDTH and HEIGHT, and what its edges are, for SVG."""
    x, y, band = (np.array(item) for item in (law.at, law.values, law.deviations))
    low, high = float(min(0.0, (y - 2.0 * band).min())), float(max(0.0, (y + 2.0 * band).max()))
    across = WIDTH * (x - x.min()) / max(float(np.ptp(x)), 1e-300)

    def points(values: Any) -> list[tuple[float, float]]:
        up = HEIGHT * (high - values) / max(high - low, 1e-300)
        return list(zip(across.tolist(), up.tolist(), strict=True))

    def path(corners: list[tuple[float, float]]) -> str:
        return ' '.join(f'{right:.1f},{down:.1f}' for right, down in corners)

    return {'box': (WIDTH, HEIGHT), 'line': path(points(y)),
            'dots': points(y) if len(x) <= _DOTS else (),
            'band': path([*points(y + 2.0 * band), *reversed(points(y - 2.0 * band))]),
            'zero': points(0.0 * y)[0][1], 'low': number(low), 'high': number(high),
            'begin': number(float(x.min())), 'end': number(float(x.max()))}
