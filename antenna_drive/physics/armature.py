# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The motor's armature: voltage in, current out, Fig. 6."""

from antenna_drive.parameters.sets import Armature
from simgap.laws.compiling import inner


@inner
def current_rate(voltage: float, current: float, rate: float, p: Armature) -> float:
    """
    Return the time derivative of the current [article A/s]: L i' = V/kappa - R i - (k_b/kappa) w.

    voltage : V at the armature [V]
    current : i [article A]
    rate : w of the motor [rad/s]
    p : Armature; resistance_change is zero and back_emf_share 1 in the article
    """
    kappa = p.physical_amperes_per_article_ampere
    return ((voltage - p.back_emf_constant * p.back_emf_share * rate) / kappa
            - (p.resistance + p.resistance_change) * current) / p.inductance
