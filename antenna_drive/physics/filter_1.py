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
"""Filter 1, Eq. (15), in the form k' / (s + p) that Table 1's numbers have."""

from __future__ import annotations

from antenna_drive.parameters.sets import Filter1
from antenna_drive.physics.compiling import inner


@inner
def counter_torque_rate(
        counter_torque: float, bias_voltage: float, current_1: float, current_2: float,
        p: Filter1,
) -> float:
    """
    Return the time derivative of x_F [V/s]; the filter acts on the error of the torque bias.

    Parameters
    ----------
    counter_torque
        x_F, state [V]
    bias_voltage
        v_b, the bias asked for [V]
    current_1, current_2
        of the motors [article A]
    p
        Filter1

    """
    error = bias_voltage - p.difference_gain * (current_2 - current_1)
    return p.gain * error - p.pole * counter_torque
