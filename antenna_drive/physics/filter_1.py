# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Filter 1, Eq. (15), in the form k' / (s + p) that Table 1's numbers have."""

from antenna_drive.parameters.sets import Filter1
from simgap.laws.compiling import inner


@inner
def counter_torque_rate(
        counter_torque: float, bias_voltage: float, current_1: float, current_2: float,
        p: Filter1,
) -> float:
    """
    Return the time derivative of x_F [V/s]; the filter acts on the error of the torque bias.

    counter_torque : x_F, state [V]
    bias_voltage : v_b, the bias asked for [V]
    current_1, current_2 : of the motors [article A]
    p : Filter1
    """
    error = bias_voltage - p.difference_gain * (current_2 - current_1)
    return p.gain * error - p.pole * counter_torque
