# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
The motion of a position-controlled servo that carries a pendulum.

The servo is a DC motor behind a gearbox, seen from its output shaft. A position gain sets the
duty of its bridge:

    duty = clip(k_p g (goal - position), -1, 1),    i = (duty V - k_t w) / R,
    (m l^2 + J) dw/dt = k_t i - m g l sin(q) - friction.

Friction holds the shaft wherever it can. Its load-dependent terms are those of M. Duclusaud,
G. Passault, V. Padois, O. Ly, 'Extended friction models for the physics simulation of servo
actuators' (2024). These and all other effects are zero by default. Torques and rates are positive
when the position grows.

All compiled code is in this file except `inner` and `compiled`. numba's own cache checks the file
of a kernel, so this kernel needs no digest and does not invalidate the cache of the drive.
"""

from __future__ import annotations

import math
from typing import Annotated, Final, get_type_hints, NamedTuple

from antenna_drive.physics.compiling import compiled
import numpy as np
from numpy.typing import NDArray
from simgap.laws.compiling import inner

FloatArray = NDArray[np.float64]


class Servo(NamedTuple):
    """The kernel's parameters in its order, see catalogue.py; the first three are above zero."""

    torque_constant: Annotated[float, 'N m/A']
    resistance: Annotated[float, 'ohm']
    armature_inertia: Annotated[float, 'kg m^2']
    coulomb_torque: Annotated[float, 'N m']
    viscous_friction: Annotated[float, 'N m s/rad']
    stribeck_torque: Annotated[float, 'N m']
    stribeck_rate: Annotated[float, 'rad/s']
    stribeck_shape: Annotated[float, '1']
    load_friction_motor: Annotated[float, '1']
    load_friction_external: Annotated[float, '1']
    load_stribeck_motor: Annotated[float, '1']
    load_stribeck_external: Annotated[float, '1']
    load_quadratic_motor: Annotated[float, '1/(N m)']
    load_quadratic_external: Annotated[float, '1/(N m)']
    load_square: Annotated[float, '1/(N m)']
    load_square_stribeck: Annotated[float, '1/(N m)']
    ageing: Annotated[float, '1']
    current_limit: Annotated[float, '1/A']
    friction_asymmetry: Annotated[float, '1']
    viscous_quadratic: Annotated[float, 'N m s^2/rad^2']
    viscous_thinning: Annotated[float, 's/rad']
    friction_temperature: Annotated[float, '1/K']
    friction_cosine: Annotated[float, '1']
    friction_sine: Annotated[float, '1']
    friction_cycles: Annotated[float, '1/rev']
    ripple_cosine: Annotated[float, 'N m']
    ripple_sine: Annotated[float, 'N m']
    ripple_cycles: Annotated[float, '1/rev']
    backlash: Annotated[float, 'rad']
    compliance: Annotated[float, 'rad/(N m)']
    saturation: Annotated[float, '1/A']
    winding_temperature: Annotated[float, '1/K']
    coasting: Annotated[float, '1']
    bridge_drop: Annotated[float, 'V']
    braking: Annotated[float, '1']
    supply_resistance: Annotated[float, 'ohm']
    gain_error: Annotated[float, '1']
    derivative_gain: Annotated[float, 's']
    dead_band: Annotated[float, 'rad']
    duty_limit: Annotated[float, '1']
    goal_slowness: Annotated[float, 's/rad']
    delay: Annotated[float, 's']
    position_offset: Annotated[float, 'rad']
    eccentricity_cosine: Annotated[float, 'rad']
    eccentricity_sine: Annotated[float, 'rad']
    load_moment: Annotated[float, '1']


UNITS: Final[dict[str, str]] = {
    name: hint.__metadata__[0]
    for name, hint in get_type_hints(Servo, include_extras=True).items()}
ORDER: Final = tuple(UNITS)

GRAVITY: Final = 9.80665
# Temperature at which the parameters hold [degC].
REFERENCE_TEMPERATURE: Final = 25.0
# The least compliance of the teeth [rad/(N m)] and their damping ratio.
_LEAST_COMPLIANCE: Final = 0.004
_CONTACT_DAMPING: Final = 0.3
# Rates are kept within this, so that a wild candidate stays finite [rad/s].
_RATE_LIMIT: Final = 200.0
# Time scale on which friction at rest grows with the logarithm of time [s].
_AGEING_TIME: Final = 0.02


@compiled
def swing(values: FloatArray, mass: float, length: float, gain: float, supply: float,
          time: FloatArray, goal: FloatArray, enabled: FloatArray, temperature: FloatArray,
          start: float, start_rate: float, step: float, out: FloatArray) -> None:
    """
    Simulate a servo with a pendulum in open loop: nothing is corrected from measurements.

    The integrator is a leapfrog of second order with steps of at most `step` [s]. Friction is an
    impulse that can bring the shaft to an exact stop. Values have the order and units of UNITS,
    shape (46,); the pendulum has `mass` [kg] and `length` [m]. `gain` is k_p g, duty per position
    error [1/rad]; `supply` is in [V]. Of shape (n,) are the rising `time` of the samples [s], the
    `goal` from each to the next [rad], `enabled`, 1 where the bridge drives, and `temperature`
    [degC]. The first sample has `start` [rad] and `start_rate` [rad/s]. `out` becomes position
    [rad], rate [rad/s], duty and current [A] at each sample, shape (n, 4); rate and current are
    those of the last step before it.
    """
    servo = _servo(values)
    armature = servo.armature_inertia
    weight = mass * GRAVITY * length * (1.0 + servo.load_moment)
    load_inertia = mass * length * length
    elastic = servo.backlash > 0.0 or servo.compliance > 0.0
    stiffness = 1.0 / max(servo.compliance, _LEAST_COMPLIANCE)
    contact = 2.0 * _CONTACT_DAMPING * math.sqrt(
        stiffness * load_inertia * armature / (load_inertia + armature))
    inertia = armature if elastic else armature + load_inertia

    n = time.size
    q, w = start, start_rate            # of the output shaft
    qm, wm = start, start_rate          # of the motor, seen from the output shaft
    t, asked = time[0], goal[0]
    held = 0                            # the sample whose goal and bridge state are in force
    current, stuck = 0.0, 0.0
    first = True
    for k in range(n):
        if k > 0:
            warming = temperature[k - 1] - REFERENCE_TEMPERATURE
            span = time[k] - t
            count = max(1, int(math.ceil(span / step - 1e-9)))
            if elastic:
                count *= 2  # the teeth are stiff
            h = span / count
            for _ in range(count):
                # the torques act on the rates from half a step ago to half a step ahead
                begin, end = t - 0.5 * h - servo.delay, t + 0.5 * h - servo.delay
                while held + 1 < n and time[held + 1] <= begin:
                    held += 1
                asked = _slewed(asked, _mean_held(goal, time, held, end, h), h, servo)
                on = _mean_held(enabled, time, held, end, h)
                duty = _duty(asked, _sensed(q, servo), w, gain, servo)
                if not elastic:
                    qm, wm = q, w
                current, torque, damping = _motor(duty, on, supply, qm, wm, warming, servo)
                gravity = -weight * math.sin(q + servo.position_offset)
                external = gravity
                if elastic:
                    external = -_tooth_torque(qm - q, wm - w, 0.5 * servo.backlash, stiffness,
                                              contact)
                level, drag = _friction(torque, external, qm, wm, warming, stuck, servo)
                # after the first step the rates are half a step behind
                kick = 0.5 * h if first else h
                first = False
                wm = _kicked(wm, kick, torque + damping * wm + external, level, damping + drag,
                             inertia)
                stuck = stuck + h if wm == 0.0 else 0.0
                if elastic:
                    w = _limited(w + kick * (gravity - external) / load_inertia)
                    q += h * w
                    qm += h * wm
                else:
                    w = wm
                    q += h * w
                t += h
            t = time[k]
        # the position is read after this sample's goal has come into force
        now = held
        while now + 1 < n and time[now + 1] <= time[k] - servo.delay + 1e-9:
            now += 1
        latest = asked if servo.goal_slowness > 0.0 else goal[now]
        sensed = _sensed(q, servo)
        out[k, 0] = sensed
        out[k, 1] = w
        out[k, 2] = enabled[k] * _duty(latest, sensed, w, gain, servo)
        out[k, 3] = current


@inner
def _servo(v: FloatArray) -> Servo:
    # written out: a tuple that numba fills in a loop makes the kernel slower
    return Servo(
        v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11], v[12],
        v[13], v[14], v[15], v[16], v[17], v[18], v[19], v[20], v[21], v[22], v[23],
        v[24], v[25], v[26], v[27], v[28], v[29], v[30], v[31], v[32], v[33], v[34],
        v[35], v[36], v[37], v[38], v[39], v[40], v[41], v[42], v[43], v[44], v[45])


@inner
def _mean_held(values: FloatArray, time: FloatArray, k: int, end: float, h: float) -> float:
    """Return the mean of held values over the step h that ends at `end` and starts in sample k."""
    value = values[k]
    if k + 1 < time.size and time[k + 1] < end:
        value += (end - time[k + 1]) / h * (values[k + 1] - value)
    return value


@inner
def _slewed(asked: float, wanted: float, h: float, servo: Servo) -> float:
    """Return the goal that the firmware asks for after a step of h [rad]."""
    if servo.goal_slowness > 0.0:
        most = h / servo.goal_slowness
        return asked + min(max(wanted - asked, -most), most)
    return wanted


@inner
def _sensed(q: float, servo: Servo) -> float:
    """Return the reading of an encoder that is mounted off the axis [rad]."""
    cosine, sine = servo.eccentricity_cosine, servo.eccentricity_sine
    if cosine == 0.0 and sine == 0.0:
        return q
    return q + cosine * (math.cos(q) - 1.0) + sine * math.sin(q)


@inner
def _duty(asked: float, sensed: float, rate: float, gain: float, servo: Servo) -> float:
    """Return the duty that the firmware sets."""
    error = _toward_zero(asked - sensed, servo.dead_band)
    limit = 1.0 - servo.duty_limit
    return min(max(gain * (1.0 + servo.gain_error) * (error - servo.derivative_gain * rate),
                   -limit), limit)


@inner
def _motor(duty: float, on: float, supply: float, angle: float, rate: float, warming: float,
           servo: Servo) -> tuple[float, float, float]:
    """Return current [A], torque [N m] and how the torque falls with the rate [N m s/rad]."""
    kt = servo.torque_constant
    ohms = servo.resistance * max(1.0 + servo.winding_temperature * warming, 0.2)
    source, volts = servo.supply_resistance, supply
    if source > 0.0:
        # the supply carries the motor's current for a share of the time equal to the duty
        volts = (supply + source * duty * kt * rate / ohms) / (1.0 + source * duty * duty / ohms)
    emf_part = 1.0 - servo.coasting * (1.0 - abs(duty))
    driven = _toward_zero(duty * volts, servo.bridge_drop)
    current = on * (driven - emf_part * kt * rate) / ohms
    if servo.current_limit > 0.0:
        most = 1.0 / servo.current_limit
        current = min(max(current, -most), most)
    torque = kt * current
    if servo.saturation != 0.0:
        torque /= 1.0 + servo.saturation * abs(current)
    torque -= (1.0 - on) * servo.braking * kt * kt / ohms * rate
    damping = (on * emf_part + (1.0 - on) * servo.braking) * kt * kt / ohms
    if servo.ripple_cosine != 0.0 or servo.ripple_sine != 0.0:
        torque += _wave(servo.ripple_cosine, servo.ripple_sine, servo.ripple_cycles, angle)
    return current, torque, damping


@inner
def _tooth_torque(twist: float, rate: float, play: float, stiffness: float,
                  contact: float) -> float:
    """Return the torque through teeth that push but do not pull [N m]."""
    if twist > play:
        return max(stiffness * (twist - play) + contact * rate, 0.0)
    if twist < -play:
        return min(stiffness * (twist + play) + contact * rate, 0.0)
    return 0.0


@inner
def _friction(torque: float, external: float, angle: float, rate: float, warming: float,
              stuck: float, servo: Servo) -> tuple[float, float]:
    """Return the friction level [N m] and the viscous coefficient [N m s/rad]."""
    level = servo.coulomb_torque
    if servo.friction_asymmetry != 0.0:
        level *= 1.0 + (servo.friction_asymmetry if rate >= 0.0 else -servo.friction_asymmetry)
    level += abs(external * servo.load_friction_external - torque * servo.load_friction_motor)
    level += servo.load_square * torque * torque
    stribeck = _stribeck(torque, external, servo)
    if stribeck != 0.0:
        level += stribeck * math.exp(-(abs(rate) / servo.stribeck_rate) ** servo.stribeck_shape)
    # the mesh varies with the angle, and with it the force between the teeth
    if servo.friction_cosine != 0.0 or servo.friction_sine != 0.0:
        mesh = _wave(servo.friction_cosine, servo.friction_sine, servo.friction_cycles, angle)
        level *= max(1.0 + mesh, 0.0)
    drag = servo.viscous_friction
    if servo.viscous_thinning != 0.0:
        drag /= 1.0 + servo.viscous_thinning * abs(rate)
    drag += servo.viscous_quadratic * abs(rate)
    if servo.friction_temperature != 0.0:
        factor = max(1.0 + servo.friction_temperature * warming, 0.0)
        level *= factor
        drag *= factor
    level = max(level, 0.0)
    if servo.ageing > 0.0 and stuck > 0.0:
        level *= 1.0 + servo.ageing * math.log(1.0 + stuck / _AGEING_TIME)
    return level, drag


@inner
def _stribeck(torque: float, external: float, servo: Servo) -> float:
    """Return by how much friction at rest exceeds friction in motion [N m]."""
    if (servo.stribeck_torque == 0.0 and servo.load_stribeck_motor == 0.0
            and servo.load_stribeck_external == 0.0 and servo.load_square_stribeck == 0.0
            and servo.load_quadratic_motor == 0.0 and servo.load_quadratic_external == 0.0):
        return 0.0
    extra = servo.stribeck_torque + abs(external * servo.load_stribeck_external
                                        - torque * servo.load_stribeck_motor)
    extra += servo.load_square_stribeck * torque * torque
    if external * torque < 0.0:
        if abs(external) < abs(torque):
            extra += servo.load_quadratic_external * external * external
        elif abs(external) > abs(torque):
            extra += servo.load_quadratic_motor * torque * torque
    return extra


@inner
def _kicked(rate: float, h: float, torque: float, level: float, damping: float,
            inertia: float) -> float:
    """Return the rate after h: damping in the middle of the step, friction as an impulse."""
    free = rate + h * (torque - 0.5 * damping * rate) / inertia
    free = _toward_zero(free, h * level / inertia)
    return _limited(free / (1.0 + 0.5 * h * damping / inertia))


@inner
def _wave(cosine: float, sine: float, cycles: float, angle: float) -> float:
    """Return a wave of the angle."""
    return cosine * math.cos(cycles * angle) + sine * math.sin(cycles * angle)


@inner
def _toward_zero(value: float, by: float) -> float:
    """Return a value brought closer to zero, but not beyond."""
    if by == 0.0:
        return value
    return max(value - by, 0.0) if value > 0.0 else min(value + by, 0.0)


@inner
def _limited(rate: float) -> float:
    return min(max(rate, -_RATE_LIMIT), _RATE_LIMIT)
