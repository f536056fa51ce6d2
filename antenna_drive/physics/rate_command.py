# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Transfer function 1: the axis rate command becomes the voltage that the amplifiers follow."""

from antenna_drive.parameters.sets import RateCommand
from simgap.laws.compiling import inner


@inner
def command_voltage_rate(voltage: float, rate_command: float, p: RateCommand) -> float:
    """
    Return the time derivative of the command voltage [V/s]: k_s k_1 / (1 + tau_1 s), Table 1.

    voltage : v_c, state [V]
    rate_command : r, axis rate command [rad/s]
    p : RateCommand
    """
    return (p.k_s * p.k_1 * rate_command - voltage) / p.tau_1
