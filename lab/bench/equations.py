# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The drive as one set of ordinary differential equations, as a user of a solver would write it.

The equations are written from docs/model.md alone, in plain Python on plain arrays. All peers that
the emulator is compared with use them, compiled. They are those of the article's model, without
units, macro-steps or effects.

States: command voltage; of each motor integral, lagged demand, current, angle, rate; of the
torque share x_3, x_2, x_F; hub angle and rate; angle and rate of each of three modes.
"""

from collections.abc import Callable
import math
from typing import Any

from antenna_drive.article.experiments import DriveExperiment
from antenna_drive.parameters.sets import Drive
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

INTEGRAL, DEMAND, CURRENT, ANGLE, RATE = range(5)
MOTOR_STATES = 5
MODES = 3
X_3 = 1 + 2 * MOTOR_STATES
X_2, X_F, HUB_ANGLE, HUB_RATE, FIRST_MODE = range(X_3 + 1, X_3 + 6)
STATES = FIRST_MODE + 2 * MODES

# Bodies with friction: both rotors and the hub.
BODIES = 3

# A demand beyond its limit by less than this counts as being on it [article A].
_ON_LIMIT = 1e-3
# Relative error of the stiction torque at which a solver locates a break-away.
_ALMOST = 1e-9

(K_COMMAND, TAU_1, RATE_GAIN, TACH_GAIN, BIAS_GAIN, T_2, LAG, LIMIT, CENTRE, GAIN_SUM, KAPPA,
 FEEDBACK, V_MAX, RESISTANCE, INDUCTANCE, BACK_EMF, TORQUE_CONSTANT, ROTOR, COULOMB, STICTION,
 STIFFNESS, HALF_GAP, DAMPING, RATIO, K_3, CURRENT_VOLTS, S_2, K_2, FADE_OUT, G_4, POT, LOW, HIGH,
 FIXED, FIXED_VOLTAGE, POLE, GAIN, DIFFERENCE, HUB, HUB_COULOMB, HUB_STICTION, MODE_1,
 ) = range(42)
CONSTANTS = MODE_1 + 3 * MODES


def constants(drive: Drive) -> FloatArray:
    """
    Return the constants of the equations as one array.

    The motors must be equal except for the sign of their counter torque, and all effects that the
    article's model does not have must be neutral.
    """
    motor, share, axis = drive.motor_1, drive.torque_share, drive.plant.axis
    amplifier, armature = motor.amplifier, motor.armature
    kappa = armature.physical_amperes_per_article_ampere
    coulomb = motor.motor.coulomb_torque * motor.motor.friction_torque_per_ampere
    hub_coulomb = axis.coulomb_torque * axis.friction_torque_per_ampere * axis.gear_ratio
    circuit, filter_1 = share.circuit, share.filter_1
    gain_sum = armature.resistance + amplifier.current_feedback_gain
    p = np.array([
        motor.rate_command.k_s * motor.rate_command.k_1, motor.rate_command.tau_1,
        amplifier.rate_gain, amplifier.tach_gain, amplifier.bias_command_gain,
        amplifier.integral_time, amplifier.lag, motor.motor.current_limit,
        armature.back_emf_constant / kappa / gain_sum, gain_sum, kappa,
        amplifier.current_feedback_gain, armature.voltage_limit, armature.resistance,
        armature.inductance, armature.back_emf_constant, motor.motor.torque_constant,
        motor.motor.rotor_inertia, coulomb, motor.motor.stiction_ratio * coulomb,
        motor.gearbox.stiffness, motor.gearbox.half_gap, motor.gearbox.contact_damping,
        motor.gear_ratio, circuit.k_3, circuit.current_to_voltage, circuit.s_2, circuit.k_2,
        circuit.fade_out_voltage, circuit.g_4, circuit.bias_pot, circuit.saturation_low,
        circuit.saturation_high, float(circuit.bias_source == 'fixed'), circuit.fixed_voltage,
        filter_1.pole, filter_1.gain, filter_1.difference_gain, axis.inertia_hub, hub_coulomb,
        axis.stiction_ratio * hub_coulomb, *np.zeros(3 * MODES)])
    for j in range(MODES):
        omega = 2.0 * math.pi * axis.mode_frequencies[j]
        inertia = axis.mode_inertias[j]
        p[MODE_1 + 3 * j:MODE_1 + 3 * j + 3] = (
            inertia, inertia * omega ** 2, 2.0 * axis.mode_damping_ratios[j] * omega * inertia)
    return p


def initial_state(drive: Drive) -> FloatArray:
    """Return the state at rest, shape (STATES,), with a settled torque share if so configured."""
    x = np.zeros(STATES)
    circuit = drive.torque_share.circuit
    if circuit.start == 'steady':
        x[X_2] = circuit.k_2 * circuit.fade_out_voltage / circuit.s_2
    return x


_Equation = Callable[..., Any]
_Compiler = Callable[[Any], Any]


def equations(compiler: _Compiler = lambda function: function,
              ) -> tuple[_Equation, _Equation, _Equation]:
    """
    Return the functions of the model, each compiled by `compiler`, such as numba.njit.

    rates(x, r, slip, threshold, p, dx) writes the time derivative of x at a command r [rad/s].
        The slip of a body is +1 or -1 if it slips forward or backward, and 0 if it sticks. With 2
        its rate decides, Eq. (2); a rate within threshold counts as zero [rad/s of a motor; at the
        hub divided by the gear ratio].
    guards(x, slip, p, g) writes a function for each body that falls through zero when the body
        stops or breaks away, shape (BODIES,).
    settle(x, slip, body, breaks, p): a stopped body sticks unless friction cannot hold it.
        If breaks is true a sticking body slips in any case; this is needed where the torque jumps
        beyond stiction and x is the state before the jump.
    """
    mode_torque, applied = _torques(compiler)
    guards, settle = _events(compiler, applied)
    return _rates(compiler, mode_torque, applied), guards, settle


def _torques(compiler: _Compiler) -> tuple[_Equation, _Equation]:
    """Return the torque of a mode on the hub, and that on a body but for its friction."""
    @compiler
    def contact(x, m, p):  # type: ignore[no-untyped-def]
        """Return twist, pressing torque of the upper and pulling torque of the lower flank."""
        first = 1 + MOTOR_STATES * m
        twist = x[first + ANGLE] - p[RATIO] * x[HUB_ANGLE]
        damping = p[DAMPING] * (x[first + RATE] - p[RATIO] * x[HUB_RATE])
        above = p[STIFFNESS] * (twist - p[HALF_GAP])
        below = p[STIFFNESS] * (twist + p[HALF_GAP])
        return min(above, above + damping), max(below, below + damping), damping

    @compiler
    def gear_torque(x, m, p):  # type: ignore[no-untyped-def]
        upper, lower, damping = contact(x, m, p)
        if upper > 0.0:
            return upper + max(damping, 0.0)
        if lower < 0.0:
            return lower + min(damping, 0.0)
        return 0.0

    @compiler
    def mode_torque(x, j, p):  # type: ignore[no-untyped-def]
        k = FIRST_MODE + 2 * j
        return (p[MODE_1 + 3 * j + 1] * (x[k] - x[HUB_ANGLE])
                + p[MODE_1 + 3 * j + 2] * (x[k + 1] - x[HUB_RATE]))

    @compiler
    def applied(x, body, p):  # type: ignore[no-untyped-def]
        """Return T_o of Eq. (8) on a body [N m]."""
        if body < 2:
            return (p[TORQUE_CONSTANT] * x[1 + MOTOR_STATES * body + CURRENT]
                    - gear_torque(x, body, p))
        torque = p[RATIO] * (gear_torque(x, 0, p) + gear_torque(x, 1, p))
        for j in range(MODES):
            torque += mode_torque(x, j, p)
        return torque

    return mode_torque, applied


def _acceleration(compiler: _Compiler, applied: _Equation) -> _Equation:
    """Return the acceleration of a body with friction."""
    @compiler
    def acceleration(x, body, slip, threshold, p):  # type: ignore[no-untyped-def]
        """Return a body's acceleration [rad/s^2], Eq. (2)-(8)."""
        if slip == 0:
            return 0.0
        torque = applied(x, body, p)
        if body < 2:
            rate, inertia = x[1 + MOTOR_STATES * body + RATE], p[ROTOR]
            coulomb, stiction = p[COULOMB], p[STICTION]
        else:
            rate, inertia = x[HUB_RATE], p[HUB]
            coulomb, stiction = p[HUB_COULOMB], p[HUB_STICTION]
            threshold = threshold / p[RATIO]
        if slip != 2:
            return (torque - slip * coulomb) / inertia
        if rate > threshold:
            return (torque - coulomb) / inertia
        if rate < -threshold:
            return (torque + coulomb) / inertia
        if torque > stiction:
            return (torque - stiction) / inertia
        if torque < -stiction:
            return (torque + stiction) / inertia
        return 0.0

    return acceleration


def _rates(compiler: _Compiler, mode_torque: _Equation, applied: _Equation) -> _Equation:
    """Return the function that writes the time derivative of the state."""
    acceleration = _acceleration(compiler, applied)

    @compiler
    def amplifier(x, m, p):  # type: ignore[no-untyped-def]
        """Return error, demand before its limit, and centre of the limit [article A]."""
        first = 1 + MOTOR_STATES * m
        sign = 2.0 * m - 1.0
        error = p[RATE_GAIN] * (x[0] - p[TACH_GAIN] * x[first + RATE]
                                + sign * p[BIAS_GAIN] * x[X_F])
        return error, error + x[first + INTEGRAL], p[CENTRE] * x[first + RATE]

    @compiler
    def rates(x, r, slip, threshold, p, dx):  # type: ignore[no-untyped-def]
        volts = p[POT] * min(max(x[X_2], p[LOW]), p[HIGH])
        if p[FIXED] != 0.0:
            volts = p[FIXED_VOLTAGE]
        current_1 = x[1 + CURRENT]
        current_2 = x[1 + MOTOR_STATES + CURRENT]
        dx[0] = (p[K_COMMAND] * r - x[0]) / p[TAU_1]
        dx[X_3] = -p[K_3] * (x[X_3] + p[CURRENT_VOLTS] * (current_1 + current_2))
        dx[X_2] = -p[S_2] * x[X_2] + p[K_2] * (p[FADE_OUT] + p[G_4] * abs(x[X_3]))
        dx[X_F] = -p[POLE] * x[X_F] + p[GAIN] * (volts - p[DIFFERENCE] * (current_2 - current_1))
        for m in range(2):
            first = 1 + MOTOR_STATES * m
            current, rate = x[first + CURRENT], x[first + RATE]
            error, demand, centre = amplifier(x, m, p)
            turning = acceleration(x, m, slip[m], threshold, p)
            dx[first + INTEGRAL] = error / p[T_2]
            way = 1.0 if error > 0.0 else -1.0
            excess = way * (demand - centre) - p[LIMIT]
            if excess > 0.0:
                # anti-windup: the integral keeps the demand on its limit
                slope = p[RATE_GAIN] * (dx[0] - p[TACH_GAIN] * turning
                                        + (2.0 * m - 1.0) * p[BIAS_GAIN] * dx[X_F])
                needed = way * (p[CENTRE] * turning - slope) if excess < _ON_LIMIT else 0.0
                dx[first + INTEGRAL] = way * min(max(needed, 0.0), abs(error) / p[T_2])
            limited = min(max(demand, centre - p[LIMIT]), centre + p[LIMIT])
            dx[first + DEMAND] = (limited - x[first + DEMAND]) / p[LAG]
            voltage = p[KAPPA] * (p[GAIN_SUM] * x[first + DEMAND] - p[FEEDBACK] * current)
            voltage = min(max(voltage, -p[V_MAX]), p[V_MAX])
            dx[first + CURRENT] = ((voltage - p[BACK_EMF] * rate) / p[KAPPA]
                                   - p[RESISTANCE] * current) / p[INDUCTANCE]
            dx[first + ANGLE] = rate
            dx[first + RATE] = turning
        dx[HUB_ANGLE] = x[HUB_RATE]
        dx[HUB_RATE] = acceleration(x, 2, slip[2], threshold, p)
        for j in range(MODES):
            k = FIRST_MODE + 2 * j
            dx[k] = x[k + 1]
            dx[k + 1] = -mode_torque(x, j, p) / p[MODE_1 + 3 * j]

    return rates


def _events(compiler: _Compiler, applied: _Equation) -> tuple[_Equation, _Equation]:
    """Return the guards of stopping and breaking away, and what a body does then."""
    @compiler
    def guards(x, slip, p, g):  # type: ignore[no-untyped-def]
        for body in range(3):
            # all rates at the motor shafts, so that they have the same scale
            rate = (p[RATIO] * x[HUB_RATE] if body == 2 else x[1 + MOTOR_STATES * body + RATE])
            if slip[body] != 0:
                g[body] = slip[body] * rate
            else:
                stiction = p[HUB_STICTION] if body == 2 else p[STICTION]
                g[body] = (stiction - abs(applied(x, body, p))) / stiction

    @compiler
    def settle(x, slip, body, breaks, p):  # type: ignore[no-untyped-def]
        stiction = p[HUB_STICTION] if body == 2 else p[STICTION]
        torque = applied(x, body, p)
        if slip[body] != 0:
            if body == 2:
                x[HUB_RATE] = 0.0
            else:
                x[1 + MOTOR_STATES * body + RATE] = 0.0
            torque = applied(x, body, p)
        elif breaks:
            slip[body] = 1 if torque > 0.0 else -1
            return
        slip[body] = 0
        # a solver locates the break-away only within its tolerance
        if torque >= (1.0 - _ALMOST) * stiction:
            slip[body] = 1
        elif torque <= -(1.0 - _ALMOST) * stiction:
            slip[body] = -1

    return guards, settle


def pieces(experiment: DriveExperiment) -> list[tuple[float, float, float, float]]:
    """
    Return the pieces of the rate command between its jumps and corners.

    Each is start [s], end [s], value at the start [rad/s] and slope [rad/s^2]. Raise ValueError
    where the waveform is not one of zero, square, saw_tooth.
    """
    end = experiment.duration
    command = {name.rpartition('.')[2]: value for name, value in experiment.settings.items()
               if name.startswith('test_signal.rate.')}
    kind = command.get('waveform', 'zero')
    if kind == 'zero':
        return [(0.0, end, 0.0, 0.0)]
    amplitude, half = command['amplitude'], 0.5 * command['period']
    found = []
    if kind == 'square':
        for n in range(math.ceil(end / half - 1e-9)):
            value = amplitude if n % 2 == 0 else -amplitude
            found.append((n * half, min((n + 1) * half, end), value, 0.0))
    elif kind == 'saw_tooth':
        slope = 2.0 * amplitude / half
        found.append((0.0, min(0.5 * half, end), 0.0, slope))
        for n in range(math.ceil((end - 0.5 * half) / half - 1e-9)):
            sign = -1.0 if n % 2 == 0 else 1.0
            start = (n + 0.5) * half
            found.append((start, min(start + half, end), -sign * amplitude, sign * slope))
    else:
        raise ValueError(f'{kind}: no pieces known')
    return found


READ = (1 + CURRENT, 1 + MOTOR_STATES + CURRENT, 1 + RATE, 1 + MOTOR_STATES + RATE, HUB_ANGLE)
# states from which the signals below are computed
READ_STATES = (*READ, X_2)
SIGNALS = ('motor_1/current', 'motor_2/current', 'motor_1/tach_rate', 'motor_2/tach_rate',
           'plant/encoder', 'torque_share/bias_voltage')


def readings(states: FloatArray, p: FloatArray) -> FloatArray:
    """Return the signals in SIGNALS of states of shape (STATES, n), shape (n, 6)."""
    bias = (np.full(states.shape[1], p[FIXED_VOLTAGE]) if p[FIXED] != 0.0
            else p[POT] * np.clip(states[X_2], p[LOW], p[HIGH]))
    return np.column_stack([*(states[k] for k in READ), bias])
