# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The linear part of the drive as matrices, and the stability limit of the torque bias (T4c).

The matrices are written from the equations of docs/model.md, independently of the compiled
physics, so that each checks the other. The teeth stay in contact and nothing saturates. Static
friction either holds the rotors or is absent.
"""

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters import Drive
import numpy as np
from scipy.optimize import brentq

# Gains k' of Filter 1 between which the stability limit is searched for [1/s].
_GAINS = (1.0, 1e4)


def bias_loop(drive: Drive, gain: float, pole: float, *, rotors_held: bool) -> FloatArray:
    """
    Return the matrix of the loop through Filter 1, in which the motors move in opposition.

    The states are those of motor 2; motor 1 is its mirror image. They are x_F [V], integral and
    lagged demand of amplifier 1 [article A], current [article A], and with free rotors also rate
    [rad/s] and angle [rad]. The axis does not move.

    drive : parameters
    gain, pole : k' and p of Filter 1 [1/s]
    rotors_held : True if static friction holds the rotors

    Returns a matrix of shape (4, 4) or (6, 6).
    """
    x_f, integral, demand, current, rate, angle = np.eye(6)
    motor, amplifier = drive.motor_2, drive.motor_2.amplifier
    difference_gain = drive.torque_share.filter_1.difference_gain
    error = amplifier.rate_gain * (amplifier.bias_command_gain * x_f
                                   - amplifier.tach_gain * rate)
    matrix = np.array([
        -pole * x_f - gain * difference_gain * 2.0 * current,
        error / amplifier.integral_time,
        (error + integral - demand) / amplifier.lag,
        _current_slope(drive, demand, current, rate),
        (motor.motor.torque_constant * current - motor.gearbox.stiffness * angle
         - motor.gearbox.contact_damping * rate) / motor.motor.rotor_inertia,
        rate,
    ])
    return matrix[:4, :4] if rotors_held else matrix


def _current_slope(drive: Drive, demand: FloatArray, current: FloatArray, rate: FloatArray,
                   ) -> FloatArray:
    armature, gain = drive.motor_2.armature, drive.motor_2.amplifier.current_feedback_gain
    kappa = armature.physical_amperes_per_article_ampere
    return np.asarray(((armature.resistance + gain) * (demand - current)
                       - armature.back_emf_constant / kappa * rate) / armature.inductance)


def growth(matrix: FloatArray) -> float:
    """Return the largest real part of the eigenvalues [1/s]; above 0 is unstable."""
    return float(np.linalg.eigvals(matrix).real.max())


def stability_limit(drive: Drive, pole: float, *, rotors_held: bool = True) -> float:
    """
    Return the gain k' of Filter 1 above which the torque bias is unstable [1/s].

    drive : parameters
    pole : p of Filter 1 [1/s]
    rotors_held : True if static friction holds the rotors

    Returns the gain [1/s]; NaN if the loop is unstable at every gain or at none.
    """
    def rightmost(gain: float) -> float:
        return growth(bias_loop(drive, gain, pole, rotors_held=rotors_held))

    if rightmost(_GAINS[0]) > 0.0 or rightmost(_GAINS[1]) < 0.0:
        return float('nan')
    return float(brentq(rightmost, *_GAINS, rtol=1e-10))
