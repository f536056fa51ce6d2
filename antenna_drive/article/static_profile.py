# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The torque bias at a constant load, Eq. (14) and Fig. 15, and the corners of the profile."""

from dataclasses import dataclass

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed, TorqueShare
from antenna_drive.physics.torque_share import steady_bias_voltage
import numpy as np
from scipy.optimize import brentq

# Eq. (14)'s own numbers, 'as implemented at DSS 13', and Fig. 16's: g_2 is k_2 / s_2.
TEXT_FADE_OUT = -9.0
TEXT_GAIN = 2.6
NEW_GAIN = 1.617
# The profile ends well before this current [article A].
_CURRENT_LIMIT = 100.0
# A bias this close to its maximum or to zero is at the corner [V].
_NEAR = 1e-9


@dataclass(frozen=True)
class Corners:
    """Where the bias leaves its maximum and where it reaches zero: |i| in article A."""

    flat_A: float
    zero_A: float


def as_in_the_text(share: TorqueShare, gain: float = TEXT_GAIN,
                   fade_out_voltage: float = TEXT_FADE_OUT) -> TorqueShare:
    """
    Return a circuit with the numbers of Eq. (14): one volt per ampere, bias pot 0.7.

    share : the circuit, for transfer function 2 and the saturation
    gain : k_2 of Eq. (14); Table 1 calls it k_4 over k_2
    fade_out_voltage : f_o [V]
    """
    return changed(share, {'g_4': gain, 'fade_out_voltage': fade_out_voltage,
                           'current_to_voltage': 1.0, 'bias_pot': 0.7})


def bias_voltage(share: TorqueShare, current_sum: FloatArray) -> FloatArray:
    """Return v_b [V] at each i_1 + i_2 [article A], Eq. (14); both of shape (n,)."""
    record = record_of(share)[0]
    return np.array([steady_bias_voltage(current, record) for current in current_sum])


def corners(share: TorqueShare) -> Corners:
    """Return the corners of the profile; ValueError if it is constant and has none."""
    record = record_of(share)[0]
    most = share.bias_pot * share.saturation_high

    def beyond(level: float, current: float) -> float:
        return float(steady_bias_voltage(current, record)) - level

    return Corners(
        brentq(lambda current: beyond(most - _NEAR, current), 0.0, _CURRENT_LIMIT),
        brentq(lambda current: beyond(_NEAR, current), 0.0, _CURRENT_LIMIT))
