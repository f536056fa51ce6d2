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
"""
The numbers of the reference drive, each with its unit and source.

They were copied by hand from the reference model's parameter file; the emulator reads its own
copy. Currents and current gains are in article amperes: 1 A is 6.892 N m at the motor.
"""

from __future__ import annotations

from typing import NamedTuple


class Fact(NamedTuple):
    """A number, its unit and its source: article, derived from it, fitted or assumed."""

    value: float
    unit: str
    source: str


# Axis
GEAR_RATIO = Fact(14868.0, '1', 'derived: 193/0.013 and 9.1e5/61')
HUB_INERTIA = Fact(8.74e6, 'kg m^2', 'fitted')
MODE_INERTIA = (
    Fact(2.82e6, 'kg m^2', 'fitted'),
    Fact(1.55e6, 'kg m^2', 'fitted'),
    Fact(0.99e6, 'kg m^2', 'fitted'))
MODE_FREQUENCY = (
    Fact(2.2, 'Hz', 'assumed, hub held'),
    Fact(3.7, 'Hz', 'assumed, hub held'),
    Fact(5.6, 'Hz', 'assumed, hub held'))
MODE_DAMPING = Fact(0.01, '1', 'assumed')
AXIS_COULOMB = Fact(1.862, 'article A of both motors together', 'fitted')
STICTION_RATIO = Fact(1.25, '1', 'article, Eq. (4): 1.2-1.3')

# Motor and armature
TORQUE_CONSTANT = Fact(6.892, 'N m/A', 'derived: 61 lb-in per A')
CURRENT_LIMIT = Fact(5.049, 'A', 'derived: 308/61')
ROTOR_INERTIA = Fact(0.0748, 'kg m^2', 'fitted')
MOTOR_COULOMB = Fact(0.069, 'A', 'fitted')
RESISTANCE = Fact(0.46, 'ohm', 'assumed')
INDUCTANCE = Fact(0.0125, 'H', 'fitted: limit of stability')
BACK_EMF = Fact(1.148681, 'V s/rad', 'assumed')
AMPERE_SCALE = Fact(6.0, 'physical A per article A', 'assumed')
VOLTAGE_LIMIT = Fact(260.0, 'V', 'assumed')

# Amplifier
RATE_GAIN = Fact(3.87, 'A/V', 'fitted')
INTEGRAL_TIME = Fact(0.0218, 's', 'fitted')
AMPLIFIER_LAG = Fact(0.0098, 's', 'fitted')
CURRENT_FEEDBACK_GAIN = Fact(2.35, 'ohm', 'fitted')
TACH_GAIN = Fact(0.03853629, 'V s/rad', 'derived: 0.8 * 716.197 / gear ratio')

# Gearbox, at the motor shaft
GEAR_STIFFNESS = Fact(23.6, 'N m/rad', 'fitted')
HALF_GAP = Fact(0.148, 'rad', 'fitted')
CONTACT_DAMPING = Fact(0.133, 'N m s/rad', 'fitted')

# Transfer function 1
COMMAND_SCALE = Fact(0.8, '1', 'article, Table 1: k_s')
COMMAND_GAIN = Fact(716.197, 'V s/rad', 'article, Table 1: k_1')
COMMAND_LAG = Fact(6.37e-3, 's', 'article, Table 1: tau_1')

# Torque share
FADE_OUT_VOLTAGE = Fact(-10.74, 'V', 'fitted; the -9 V of the article is another antenna')
CURRENT_TO_VOLTAGE = Fact(0.925, 'V/A', 'fitted')
BIAS_CEILING = Fact(13.0, 'V', 'article, Eq. (10)')
BIAS_POT = Fact(0.7, '1', 'article, Fig. 15')


class ShareConstants(NamedTuple):
    """Transfer functions 2 to 4 of Table 1: k_2, s_2 and k_3 in 1/s, g_4 of unit 1."""

    k_2: float
    s_2: float
    k_3: float
    g_4: float


SHARE = {  # article, Table 1
    'old': ShareConstants(-3.502, 1.093, 2.0, 2.8),
    'new': ShareConstants(-2.114, 0.8895, 3.831, 1.617)}


class FilterConstants(NamedTuple):
    """Filter 1 as gain / (s + pole), both in 1/s."""

    gain: float
    pole: float


FILTER_1 = {  # article, Table 1 and Eq. (15)
    'old': FilterConstants(4.54, 1.369863),
    'new': FilterConstants(66.67, 8.889)}
DIFFERENCE_GAIN = Fact(8.192149, 'V/A', 'derived: 22 percent of 5.049 A is 0.7 * 13 V')
COUNTER_TORQUE_GAIN = Fact(0.01304006, '1', 'fitted')
