# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The stability limit of the torque bias (T4c), by simulation and from eigenvalues.

By simulation a small disturbance grows or decays. Only the sign of the growth counts, since
friction and limits bound the amplitude. The matrices of the linear part are written from the
equations of docs/model.md, independently of the compiled physics, so that each checks the other.
The teeth stay in contact there and nothing saturates. Static friction either holds the rotors or
is absent.
"""

from antenna_drive.article.experiments import filter_variant
from antenna_drive.emulator.run import Emulator, MACRO_STEP
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters import Drive
import numpy as np
from scipy.optimize import brentq

# A stable gain k' [1/s], at which the bias settles for this long before it is disturbed, and how
# long the disturbance is observed [s].
_SETTLING_GAIN, _SETTLED_S, _WATCHED_S = 45.4, 12.0, 6.0
# The disturbance [V], so small that static friction keeps on holding the rotors.
_DISTURBANCE = 1e-3
# The limit is searched for within this share of the linear one, down to this width [1/s]. Far
# above the limit the disturbance is already large when the observation begins.
_SHARE = 0.1
_GAIN_WIDTH = 0.05
# Gains k' of Filter 1 between which the linear limit is searched for [1/s].
_GAINS = (1.0, 1e4)


def growth_rate(drive: Drive, gain: float, pole: float, step_s: float = MACRO_STEP) -> float:
    """
    Return the growth rate of a small disturbance of the steady torque bias [1/s].

    drive : with the old circuit
    gain, pole : k' and p of Filter 1 [1/s]
    step_s : macro-step [s]
    """
    emulator = Emulator(filter_variant(_SETTLING_GAIN, pole).applied_to(drive), step_s)
    emulator.advance(round(_SETTLED_S / step_s))
    # the voltage that keeps the present state steady at the new gain
    difference_gain = drive.torque_share.filter_1.difference_gain
    counter_torque = emulator.now[emulator.names.index('torque_share/counter_torque'), 0]
    steady = (difference_gain * _difference(emulator, emulator.now[np.newaxis])[0]
              + pole * counter_torque / gain)
    emulator.tune({'torque_share': {'filter_1.gain': gain, 'bias_source': 'fixed',
                                    'fixed_voltage': float(steady + _DISTURBANCE)}})
    _, samples = emulator.advance(round(_WATCHED_S / step_s))
    difference = _difference(emulator, samples)
    swing = difference - difference.mean()
    # compare the second third with the last: the fast transients have decayed by then
    third = swing.size // 3
    middle, last = swing[third:2 * third], swing[2 * third:]
    if last.std() == 0.0:
        return float('-inf')
    return float(np.log(last.std() / middle.std()) / (third * step_s))


def _difference(emulator: Emulator, samples: FloatArray) -> FloatArray:
    """Return i_2 - i_1 [article A], shape (n,), of samples of shape (n, signals, 2)."""
    first, second = (emulator.names.index(f'motor_{m}/current') for m in (1, 2))
    return np.asarray(samples[:, second, 0] - samples[:, first, 0], np.float64)


def simulated_limit(drive: Drive, pole: float, step_s: float = MACRO_STEP) -> float:
    """
    Return the gain k' of Filter 1 above which a small disturbance grows [1/s].

    drive : with the old circuit
    pole : p of Filter 1 [1/s]
    step_s : macro-step [s]

    Returns the gain [1/s]; NaN if it is not within ten percent of the linear one.
    """
    linear = stability_limit(drive, pole)
    low, high = (1.0 - _SHARE) * linear, (1.0 + _SHARE) * linear
    if not growth_rate(drive, low, pole, step_s) < 0.0 < growth_rate(drive, high, pole, step_s):
        return float('nan')
    while high - low > _GAIN_WIDTH:
        gain = 0.5 * (low + high)
        if growth_rate(drive, gain, pole, step_s) > 0.0:
            high = gain
        else:
            low = gain
    return 0.5 * (low + high)


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
    motor, amplifier, armature = drive.motor_2, drive.motor_2.amplifier, drive.motor_2.armature
    kappa = armature.physical_amperes_per_article_ampere
    feedback = amplifier.current_feedback_gain
    difference_gain = drive.torque_share.filter_1.difference_gain
    error = amplifier.rate_gain * (amplifier.bias_command_gain * x_f
                                   - amplifier.tach_gain * rate)
    matrix = np.array([
        -pole * x_f - gain * difference_gain * 2.0 * current,
        error / amplifier.integral_time,
        (error + integral - demand) / amplifier.lag,
        ((armature.resistance + feedback) * (demand - current)
         - armature.back_emf_constant / kappa * rate) / armature.inductance,
        (motor.motor.torque_constant * current - motor.gearbox.stiffness * angle
         - motor.gearbox.contact_damping * rate) / motor.motor.rotor_inertia,
        rate,
    ])
    return matrix[:4, :4] if rotors_held else matrix


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
