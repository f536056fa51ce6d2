# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The equations of motion of the real antenna between two switchings, compiled.

`mode` holds the state of all switches: tooth contact, stick and slip, clamps. Within one mode the
equations are smooth. `margin` is positive for each switch as long as its state is valid. Symbols
and equation numbers are the article's; the equations are those of the reference model.
"""

import math
from typing import Any

from lab.antenna.compiled import compiled, inner
from lab.antenna.laws import (
    axis_friction, contact_torque, crossover, delayed, FloatArray, gear_deflection, lagged,
    load_torque, motor_friction, ripple_shape, viscous_torque,
)
from lab.antenna.machine import DROPOUTS, LAW_B, Records
from lab.antenna.waveform import command
import numpy as np
from numpy.typing import NDArray

ModeArray = NDArray[np.int64]

# State: the shared circuits, then one block for each motor, then the structure.
V_C, X_3, X_2, X_F = 0, 1, 2, 3
MOTOR_AT, MOTOR_SIZE = 4, 13
XI, V, I, W, THETA = 0, 1, 2, 3, 4              # integrator, demand, current, rate, angle
LAG_Z = 5                                        # state of the gear hysteresis
TACH, TACH_SLOPE = 6, 7                          # tachometer on an elastic coupling
DELAY_AT = 8                                     # four states of the delay
WARMTH = 12
AXIS_AT = MOTOR_AT + 2 * MOTOR_SIZE
THETA_A, W_A = AXIS_AT, AXIS_AT + 1
MODES_AT = AXIS_AT + 2                           # angle and rate of four appendages
ENCODER, ENCODER_RATE = MODES_AT + 8, MODES_AT + 9
DAHL = MODES_AT + 10
STATES = DAHL + 1

# Switches; those of the motors have one entry each, in the order motor 1, motor 2.
CONTACT, FRICTION, CLAMP, VOLTAGE = 0, 2, 4, 6   # each -1, 0 or +1
AXIS_FRICTION, SATURATION, LOAD_SIGN = 8, 9, 10  # LOAD_SIGN is the sign of x_3: -1 or +1
SWITCHES = 11

UNDER = 0.05       # range over which the clamp fades the integrator out [A]; the clamp is hard
MAINS = 2.0 * math.pi * 50.0


@compiled
def tach_reading(motor: Any, y: FloatArray, at: int, t: float, middle: float) -> float:
    """Return the tachometer's reading for loop and recorder [rad/s]."""
    rate = y[at + TACH] if motor.coupling_frequency > 0.0 else y[at + W]
    reading = (1.0 + motor.tach_error) * rate + motor.tach_offset
    if motor.tach_ripple != 0.0:
        angle = motor.tach_cycles * y[at + THETA] + motor.tach_phase
        if motor.law == LAW_B:
            # An eccentric coupling: two harmonics.
            reading += motor.tach_ripple * rate * (
                math.sin(angle) + 0.5 * math.sin(2.0 * angle + 0.8))
        else:
            # Commutation: the rounded tops of a rectified wave, without its mean.
            reading += motor.tach_ripple * rate * 2.0 * (
                math.sqrt(math.sin(0.5 * angle)**2 + 0.01) - 0.6499)
    if motor.hum != 0.0:
        reading += motor.hum * math.sin(MAINS * t)
    if motor.tach_dead_band > 0.0:
        reading -= motor.tach_dead_band * math.tanh(reading / motor.tach_dead_band)
    if motor.tach_saturation > 0.0:
        reading = motor.tach_saturation * math.tanh(reading / motor.tach_saturation)
    if motor.dropout_length > 0.0:
        for k in range(DROPOUTS):
            if motor.dropout[k] >= 0.0 and (
                    motor.dropout[k] < middle < motor.dropout[k] + motor.dropout_length):
                reading = 0.0
    return reading


@compiled
def bias_voltage(circuit: Any, test: Any, x_2: float, middle: float, switch: int) -> float:
    """Return v_b of Eq. (9), or the voltage of the source that replaces the circuit [V]."""
    if test.bias_source > 0.0:
        return test.bias_voltage if middle >= test.bias_at else 0.0
    if switch == 0:
        return circuit.bias_pot * x_2
    return circuit.bias_pot * (circuit.ceiling if switch > 0 else 0.0)


@inner
def gear_derivative(motor: Any, structure: Any, y: FloatArray, dy: FloatArray, at: int,
                    which: int, mode: ModeArray, margin: FloatArray) -> float:
    """Return the gear torque; fill the derivative of its hysteresis and its margin [N m]."""
    x, x_rate, gap = gear_deflection(motor, structure, y[at + THETA], y[at + W], y[THETA_A],
                                     y[W_A])
    lag = y[at + LAG_Z]
    if motor.mesh_stiffness != 0.0:
        wave = math.sin(motor.mesh_stiffness_cycles * y[at + THETA])
        # Stiffness and damping of the teeth vary together.
        share = 1.0 + motor.mesh_stiffness * wave
    else:
        share = 1.0
    up = contact_torque(motor, x - gap, x_rate, lag)
    down = contact_torque(motor, -x - gap, -x_rate, -lag)
    touch = mode[CONTACT + which]
    gear = share * (up if touch > 0 else (-down if touch < 0 else 0.0))
    upper, lower = min(x - gap, up), min(-x - gap, down)
    if touch == 0:
        margin[CONTACT + which] = -max(upper, lower)
    else:
        margin[CONTACT + which] = upper if touch > 0 else lower
    dy[at + LAG_Z] = 0.0
    if motor.hysteresis != 0.0:
        if motor.law == LAW_B:
            # Bouc and Wen's with exponent 2.
            dy[at + LAG_Z] = (x_rate - abs(x_rate) * lag * abs(lag)) / 0.07
        else:
            dy[at + LAG_Z] = (x_rate - abs(x_rate) * lag) / 0.03
    return gear


@inner
def amplifier_derivative(motor: Any, circuit: Any, y: FloatArray, dy: FloatArray, at: int,
                         which: int, t: float, middle: float, mode: ModeArray,
                         margin: FloatArray) -> None:
    """Fill the derivatives of amplifier 1: PI on the rate error, clamped about the back-EMF."""
    reading = tach_reading(motor, y, at, t, middle)
    if motor.loop_crosstalk != 0.0:
        reading += motor.loop_crosstalk * y[2 * MOTOR_AT + MOTOR_SIZE - at + W]
    error = motor.rate_gain * (
        y[V_C] - motor.tach_gain * reading
        + motor.side * circuit.counter_torque_gain * y[X_F] + motor.input_offset)
    if motor.delay > 0.0:
        if motor.law == LAW_B:
            error = lagged(y, dy, at + DELAY_AT, error, motor.delay)
        else:
            error = delayed(y, dy, at + DELAY_AT, error, motor.delay)
    else:
        for k in range(4):
            dy[at + DELAY_AT + k] = 0.0
    xi, v = y[at + XI], y[at + V]
    wish = error + xi
    centre = motor.clamp_slope * y[at + W]
    above = wish - (centre + motor.current_limit)
    below = (centre - motor.current_limit) - wish
    clamp = mode[CLAMP + which]
    demand, integrate = wish, 1.0
    if clamp > 0:
        margin[CLAMP + which] = above
        demand = centre + motor.current_limit
        if error > 0.0:
            integrate = max(1.0 - max(above, 0.0) / UNDER, 0.0)
    elif clamp < 0:
        margin[CLAMP + which] = below
        demand = centre - motor.current_limit
        if error < 0.0:
            integrate = max(1.0 - max(below, 0.0) / UNDER, 0.0)
    else:
        margin[CLAMP + which] = -max(above, below)
    integrate += motor.windup * (1.0 - integrate)
    dy[at + XI] = integrate * error / motor.integral_time - motor.integrator_leak * xi
    if motor.slew_limit > 0.0:
        dy[at + V] = motor.slew_limit * math.tanh((demand - v) / (motor.lag * motor.slew_limit))
    else:
        dy[at + V] = (demand - v) / motor.lag


@inner
def armature_derivative(motor: Any, y: FloatArray, dy: FloatArray, at: int, which: int,
                        mode: ModeArray, margin: FloatArray) -> float:
    """Fill the derivatives of amplifier 2, armature and warmth; return the magnet's strength."""
    v, i, w = y[at + V], y[at + I], y[at + W]
    if motor.dead_zone > 0.0:
        v = crossover(v, motor.dead_zone, motor.law)
    if motor.bridge_error != 0.0:
        v *= 1.0 + motor.bridge_error * math.tanh(v / 0.3)
    voltage = motor.loop_gain * v - motor.feedback_gain * i
    limit = motor.voltage_limit
    rail = mode[VOLTAGE + which]
    if rail == 0:
        margin[VOLTAGE + which] = limit - abs(voltage)
    else:
        margin[VOLTAGE + which] = rail * voltage - limit
        voltage = rail * limit
    warmth = y[at + WARMTH]
    resistance = motor.resistance * (1.0 + motor.warm_resistance * warmth)
    strength = 1.0 / (1.0 + motor.warm_torque * warmth + motor.magnet_saturation * i * i)
    dy[at + WARMTH] = (i * i - warmth) / motor.warming_time
    dy[at + I] = (voltage / motor.ampere_scale - resistance * i
                  - strength * motor.back_emf * w) / motor.inductance
    return strength


@inner
def rotor_derivative(motor: Any, y: FloatArray, dy: FloatArray, at: int, which: int,
                     middle: float, gear: float, strength: float, mode: ModeArray,
                     margin: FloatArray) -> None:
    """Fill the derivatives of rotor and tachometer; `gear` is the gear torque [N m]."""
    w = y[at + W]
    torque = motor.torque_constant * strength * y[at + I]
    if motor.ripple != 0.0 or motor.current_ripple != 0.0:
        angle = motor.ripple_cycles * y[at + THETA] + motor.ripple_phase
        shape = ripple_shape(angle, motor.law)
        torque += motor.ripple * shape + motor.current_ripple * torque * shape
    applied = torque - gear
    slip = mode[FRICTION + which]
    if slip == 0:
        direction = 1.0 if applied >= 0.0 else -1.0
        stiction = motor_friction(motor, 0.0, direction, gear, middle)[1]
        margin[FRICTION + which] = stiction - abs(applied)
        dy[at + W] = 0.0
    else:
        kinetic = motor_friction(motor, w, slip * 1.0, gear, middle)[0]
        drag = slip * kinetic + viscous_torque(motor.viscous, w, 20.0, motor.law)
        if motor.eddy_brake != 0.0:
            # Rises with the rate, and falls beyond that of the greatest drag.
            part = w / motor.eddy_rate
            drag += motor.eddy_brake * 2.0 * part / (1.0 + part * part)
        margin[FRICTION + which] = slip * w
        dy[at + W] = (applied - drag) / motor.inertia
    dy[at + THETA] = w
    dy[at + TACH] = 0.0
    dy[at + TACH_SLOPE] = 0.0
    if motor.coupling_frequency > 0.0:
        omega = motor.coupling_frequency
        dy[at + TACH] = y[at + TACH_SLOPE]
        dy[at + TACH_SLOPE] = omega * omega * (w - y[at + TACH]) - 0.1 * omega * y[at + TACH_SLOPE]


@compiled
def motor_derivative(motor: Any, machine: Records, y: FloatArray, dy: FloatArray, at: int,
                     which: int, t: float, middle: float, mode: ModeArray,
                     margin: FloatArray) -> float:
    """Fill the derivatives and margins of one motor with its gear; return its gear torque."""
    gear = gear_derivative(motor, machine.structure[0], y, dy, at, which, mode, margin)
    amplifier_derivative(motor, machine.circuit[0], y, dy, at, which, t, middle, mode, margin)
    strength = armature_derivative(motor, y, dy, at, which, mode, margin)
    rotor_derivative(motor, y, dy, at, which, middle, gear, strength, mode, margin)
    return gear


@compiled
def structure_derivative(structure: Any, y: FloatArray, dy: FloatArray, t: float,
                         middle: float, elevation: float, gears: float, mode: ModeArray,
                         margin: FloatArray) -> None:
    """Fill the derivatives and the margin of hub, appendages and encoder."""
    theta_a, w_a = y[THETA_A], y[W_A]
    applied = structure.gear_ratio * gears + load_torque(structure, theta_a, t, middle, elevation)
    for k in range(4):
        angle, rate = y[MODES_AT + 2 * k], y[MODES_AT + 2 * k + 1]
        if k < 3:
            inertia, omega = structure.mode_inertia[k], structure.mode_frequency[k]
            zeta = structure.mode_damping[k]
        else:
            inertia, omega = structure.extra_inertia, structure.extra_frequency
            zeta = structure.extra_damping
        twist = angle - theta_a
        if k == 0 and structure.mode_play > 0.0:
            twist -= structure.mode_play * math.tanh(twist / structure.mode_play)
        acceleration = -omega * omega * twist - 2.0 * zeta * omega * (rate - w_a)
        if k == 0 and structure.mode_friction != 0.0:
            acceleration -= (structure.mode_friction / inertia
                             * math.tanh((rate - w_a) / structure.mode_friction_rate))
        applied -= inertia * acceleration
        dy[MODES_AT + 2 * k] = rate
        dy[MODES_AT + 2 * k + 1] = acceleration
    dy[DAHL] = 0.0
    if structure.dahl != 0.0:
        applied -= structure.dahl * structure.coulomb * y[DAHL]
        dy[DAHL] = (w_a - abs(w_a) * y[DAHL]) / structure.dahl_travel
    slip = mode[AXIS_FRICTION]
    kinetic, stiction = axis_friction(structure, theta_a, w_a, t)
    if slip == 0:
        margin[AXIS_FRICTION] = stiction - abs(applied)
        dy[W_A] = 0.0
    else:
        margin[AXIS_FRICTION] = slip * w_a
        drag = slip * kinetic + viscous_torque(structure.viscous, w_a, 1.3e-3, structure.law)
        dy[W_A] = (applied - drag) / structure.inertia
    dy[THETA_A] = w_a
    dy[ENCODER] = 0.0
    dy[ENCODER_RATE] = 0.0
    if structure.encoder_frequency > 0.0:
        omega = structure.encoder_frequency
        dy[ENCODER] = y[ENCODER_RATE]
        dy[ENCODER_RATE] = (
            omega * omega * (theta_a - y[ENCODER])
            + 2.0 * structure.encoder_damping * omega * (w_a - y[ENCODER_RATE]))


@compiled
def derivative(t: float, middle: float, y: FloatArray, mode: ModeArray, machine: Records,
               test: Any, dy: FloatArray, margin: FloatArray) -> None:
    """
    Fill the derivative `dy` of the state `y`, both (STATES,), and the margins of all switches.

    `t` is the time [s]. `middle` [s] lies strictly inside the present interval between two jumps
    of an input and selects the side of a jump. `test` is a waveform.TEST record. `mode` and
    `margin` have shape (SWITCHES,); a margin is negative where its switch must be thrown.
    """
    circuit = machine.circuit[0]
    first, second = y[MOTOR_AT + I], y[MOTOR_AT + MOTOR_SIZE + I]
    x_3, x_2 = y[X_3], y[X_2]
    rate = command(test, t, middle)
    dy[V_C] = (circuit.command_gain * rate - y[V_C]) / circuit.command_lag
    dy[X_3] = -circuit.k_3 * (x_3 + circuit.current_to_voltage * (first + second))
    load = mode[LOAD_SIGN] * x_3
    dy[X_2] = -circuit.s_2 * x_2 + circuit.k_2 * (circuit.fade_out + circuit.g_4 * load)
    if circuit.command_leak != 0.0:
        dy[X_2] += circuit.command_leak * y[V_C]
    margin[LOAD_SIGN] = load
    saturation = mode[SATURATION]
    if saturation > 0:
        margin[SATURATION] = x_2 - circuit.ceiling
    elif saturation < 0:
        margin[SATURATION] = -x_2
    else:
        margin[SATURATION] = min(x_2, circuit.ceiling - x_2)
    bias = bias_voltage(circuit, test, x_2, middle, saturation)
    dy[X_F] = -circuit.filter_pole * y[X_F] + circuit.filter_gain * (
        bias - circuit.difference_gain * (second - first))
    gears = 0.0
    for which in range(2):
        gears += motor_derivative(
            machine.motors[which], machine, y, dy, MOTOR_AT + which * MOTOR_SIZE, which, t,
            middle, mode, margin)
    structure_derivative(machine.structure[0], y, dy, t, middle, test.elevation, gears, mode,
                         margin)


@compiled
def readings(times: FloatArray, middles: FloatArray, states: FloatArray, machine: Records,
             test: Any, commands: FloatArray, biases: FloatArray, tachs: FloatArray) -> None:
    """
    Fill the signals that follow from the states, shape (n, STATES).

    Commands [rad/s] and biases [V] have shape (n,), tachs [rad/s] (2, n). Times and middles, shape
    (n,) [s], are those of `derivative`.
    """
    circuit = machine.circuit[0]
    for k in range(len(times)):
        commands[k] = command(test, times[k], middles[k])
        x_2 = min(max(states[k, X_2], 0.0), circuit.ceiling)
        biases[k] = bias_voltage(circuit, test, x_2, middles[k], 0)
        for which in range(2):
            tachs[which, k] = tach_reading(
                machine.motors[which], states[k], MOTOR_AT + which * MOTOR_SIZE, times[k],
                middles[k])
