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
"""Transfer function 1: the axis rate command becomes the voltage that the amplifiers follow."""

from __future__ import annotations

from antenna_drive.parameters.sets import RateCommand
from antenna_drive.physics.compiling import inner


@inner
def command_voltage_rate(voltage: float, rate_command: float, p: RateCommand) -> float:
    """
    Return the time derivative of the command voltage [V/s]: k_s k_1 / (1 + tau_1 s), Table 1.

    Parameters
    ----------
    voltage
        v_c, state [V]
    rate_command
        r, axis rate command [rad/s]
    p
        RateCommand

    """
    return (p.k_s * p.k_1 * rate_command - voltage) / p.tau_1
