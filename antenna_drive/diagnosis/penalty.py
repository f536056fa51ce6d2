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
"""What a hypothesis has to gain before it is worth its complexity, in halves of a chi-square."""

from __future__ import annotations

from collections.abc import Sequence

from antenna_drive.diagnosis.machine import Form, Point

EFFECT = 30.0
PARAMETER = 4.0
# A number that is pulled to nought is one of many that make a course over time: such a form
# imitates anything slow, and whatever little a fit has left over.
PULLED = 8.0
# The cycles of a wave were searched for among many.
SOUGHT = 10.0
# An effect that is as small as a tolerance is one: the machine is a little further off than its
# sheet says. The price falls to nought as the effect outgrows the tolerance.
TOLERATED = 24.0


def price(forms: Sequence[Form], point: Point) -> float:
    """Return the price of effects in these forms, with these values."""
    total = 0.0
    for form in forms:
        total += EFFECT + SOUGHT * form.sought
        for p in form.parameters:
            total += PULLED if p.spread else PARAMETER
            if p.tolerance:
                total += TOLERATED * max(0.0, 1.0 - abs(point[p.name]) / p.tolerance)
    return total
