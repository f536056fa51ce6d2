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
"""The motor's armature: voltage in, current out, Fig. 6."""

from __future__ import annotations

from antenna_drive.parameters.sets import Armature
from antenna_drive.physics.compiling import inner


@inner
def current_rate(voltage: float, current: float, rate: float, p: Armature) -> float:
    """
    Return the time derivative of the current [article A/s]: L i' = V/kappa - R i - (k_b/kappa) w.

    Parameters
    ----------
    voltage
        V at the armature [V]
    current
        i [article A]
    rate
        w of the motor [rad/s]
    p
        Armature; resistance_change is zero and back_emf_share 1 in the article

    """
    kappa = p.physical_amperes_per_article_ampere
    return ((voltage - p.back_emf_constant * p.back_emf_share * rate) / kappa
            - (p.resistance + p.resistance_change) * current) / p.inductance
