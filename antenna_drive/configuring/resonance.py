# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The structure's modes from its inertia and its lowest resonance with the rotors held."""

import math

from antenna_drive.physics.arrays import FloatArray
import numpy as np
from scipy.optimize import brentq


# Between these the lowest resonance goes from near zero to that of a rigid structure.
_SCALES = 1e-3, 1e2


def locked_rotor_frequency(hub: float, inertias: FloatArray, frequencies: FloatArray,
                           stiffness: float) -> float:
    """
    Return the lowest resonance of hub and modes on gearboxes whose rotors are held [Hz].

    hub : its inertia [kg m^2]
    inertias, frequencies : of each mode [kg m^2], with the hub held [Hz]
    stiffness : of all gearboxes together, at the axis [N m/rad]
    """
    springs = inertias * (2.0 * math.pi * frequencies) ** 2
    matrix = np.diag(np.concatenate([[stiffness + springs.sum()], springs]))
    matrix[0, 1:] = matrix[1:, 0] = -springs
    root = 1.0 / np.sqrt(np.concatenate([[hub], inertias]))
    lowest = np.linalg.eigvalsh(root[:, None] * matrix * root)[0]
    return math.sqrt(max(lowest, 0.0)) / (2.0 * math.pi)


def rigid_frequency(inertia: float, stiffness: float) -> float:
    """Return that resonance of a structure that does not bend [Hz]: no other one is higher."""
    return math.sqrt(stiffness / inertia) / (2.0 * math.pi)


def mode_scale(hub: float, inertias: FloatArray, frequencies: FloatArray, stiffness: float,
               wanted: float) -> float:
    """
    Return by what to multiply the frequencies of the modes for a lowest resonance [Hz].

    Raises ValueError: it is not below that of a rigid structure.
    """
    if wanted >= 0.999 * rigid_frequency(hub + float(inertias.sum()), stiffness):
        raise ValueError('not below that of a rigid structure')

    def miss(logarithm: float) -> float:
        return locked_rotor_frequency(
            hub, inertias, frequencies * math.exp(logarithm), stiffness) - wanted

    return math.exp(brentq(miss, *map(math.log, _SCALES), xtol=1e-10))
