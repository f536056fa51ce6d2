# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the position loop: units, allowed ranges, which may change while it runs."""

from dataclasses import dataclass, field
import math
from typing import Any

from simgap.inputs.schema import Entry


def _number(unit: str, low: float, high: float, description: str, live: bool = True) -> Any:
    return field(metadata={'entry': Entry(unit, low, high, description, live)})


@dataclass(frozen=True, kw_only=True)
class PositionLoop:
    """A proportional and integral controller of the axis angle; values in position_loop.yaml."""

    angle: float = _number('rad', -math.pi, math.pi, 'commanded angle at the start of a track')
    track_rate: float = _number('rad/s', -0.02, 0.02, 'rate at which the commanded angle moves')
    proportional_gain: float = _number('1/s', 0.0, 10.0, 'rate per angle error')
    integral_gain: float = _number('1/s^2', 0.0, 10.0, 'rate per integral of the angle error')
    rate_limit: float = _number('rad/s', 1e-6, 0.02, 'greatest rate command', live=False)
