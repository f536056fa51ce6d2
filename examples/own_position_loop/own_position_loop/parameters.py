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
"""The parameters of the position loop: units, allowed ranges, which may change while it runs."""

from dataclasses import dataclass, field
import math
from typing import Any

from antenna_drive.parameters.schema import Entry


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
