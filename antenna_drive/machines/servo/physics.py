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
r"""
The motion of a position-controlled servo that carries a pendulum.

The servo is a DC motor behind a gearbox, all seen from its output shaft, with a position gain
that sets the duty of its bridge:

    duty = clip(k_p g (goal - position), -1, 1),    i = (duty V - k_t w) / R,
    (m l^2 + J) dw/dt = k_t i - m g l sin(q) - friction,

where friction stops the shaft if it can. The friction budget with its load-dependent terms is
that of M. Duclusaud, G. Passault, V. Padois, O. Ly, 'Extended friction models for the physics
simulation of servo actuators' (2024); every term of it, and every other one here, is nought by
default. Positive torques and rates are those of a growing position.

The kernel is whole in this file, apart from the drive's physics: numba's own cache looks at the
file of a kernel, and so neither needs a digest nor disturbs that of the drive.
"""

from __future__ import annotations

import math
from typing import Final

from antenna_drive.physics.compiling import compiled, inner
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# The servo's numbers in the order in which the kernel takes them, with their units; what each
# is stands in machines/servo/catalogue.py. Nought means absent, but for the first three.
UNITS: Final[dict[str, str]] = {
    'torque_constant': 'N m/A',
    'resistance': 'ohm',
    'armature_inertia': 'kg m^2',
    'coulomb_torque': 'N m',
    'viscous_friction': 'N m s/rad',
    'stribeck_torque': 'N m',
    'stribeck_rate': 'rad/s',
    'stribeck_shape': '1',
    'load_friction_motor': '1',
    'load_friction_external': '1',
    'load_stribeck_motor': '1',
    'load_stribeck_external': '1',
    'load_quadratic_motor': '1/(N m)',
    'load_quadratic_external': '1/(N m)',
    'load_square': '1/(N m)',
    'load_square_stribeck': '1/(N m)',
    'ageing': '1',
    'current_limit': '1',
    'friction_asymmetry': '1',
    'viscous_quadratic': 'N m s^2/rad^2',
    'viscous_thinning': 's/rad',
    'friction_temperature': '1/K',
    'friction_cosine': '1',
    'friction_sine': '1',
    'friction_cycles': '1/rev',
    'ripple_cosine': 'N m',
    'ripple_sine': 'N m',
    'ripple_cycles': '1/rev',
    'backlash': 'rad',
    'compliance': 'rad/(N m)',
    'saturation': '1/A',
    'winding_temperature': '1/K',
    'coasting': '1',
    'bridge_drop': 'V',
    'braking': '1',
    'supply_resistance': 'ohm',
    'gain_error': '1',
    'derivative_gain': 's',
    'dead_band': 'rad',
    'duty_limit': '1',
    'goal_slowness': 's/rad',
    'delay': 's',
    'position_offset': 'rad',
    'eccentricity_cosine': 'rad',
    'eccentricity_sine': 'rad',
    'load_moment': '1',
}
ORDER: Final = tuple(UNITS)

GRAVITY: Final = 9.80665
# Temperature at which the numbers hold [degC].
REFERENCE_TEMPERATURE: Final = 25.0
# The teeth are never stiffer than this [rad/(N m)], and damp so much of the critical.
_LEAST_COMPLIANCE: Final = 0.004
_CONTACT_DAMPING: Final = 0.3


@compiled
def swing(values: FloatArray, mass: float, length: float, gain: float, supply: float,
          time: FloatArray, goal: FloatArray, enabled: FloatArray, temperature: FloatArray,
          start: float, start_rate: float, step: float, out: FloatArray) -> None:
    """
    Simulate a servo with a pendulum, free of any correction from what was measured.

    A leapfrog of the second order; friction is an impulse that stops the shaft where it can, so
    that it sticks exactly.

    Parameters
    ----------
    values
        the numbers of UNITS, in that order, shape (46,)
    mass, length
        of the pendulum [kg], [m]
    gain
        duty per position error, k_p g [1/rad]
    supply
        voltage [V]
    time
        of the samples, rising, shape (n,) [s]
    goal
        position asked for from each sample to the next, shape (n,) [rad]
    enabled
        1 where the bridge drives, 0 where it is off, shape (n,)
    temperature
        of the servo, shape (n,) [degC]
    start, start_rate
        at the first sample [rad], [rad/s]
    step
        of integration, at most [s]
    out
        position [rad], rate [rad/s], duty and current [A] at each sample, rate and current
        as of the last step before it, shape (n, 4); written

    """
    kt, resistance, armature, coulomb, viscous = (
        values[0], values[1], values[2], values[3], values[4])
    stribeck, stribeck_rate, stribeck_shape = values[5], values[6], values[7]
    motor_share, external_share = values[8], values[9]
    motor_stribeck, external_stribeck = values[10], values[11]
    motor_square, external_square = values[12], values[13]
    square, square_stribeck, ageing, current_limit = values[14], values[15], values[16], values[17]
    asymmetry, windage, thinning, warmth = values[18], values[19], values[20], values[21]
    friction_cosine, friction_sine, friction_cycles = values[22], values[23], values[24]
    ripple_cosine, ripple_sine, ripple_cycles = values[25], values[26], values[27]
    backlash, compliance = values[28], values[29]
    saturation, winding, coasting, drop, braking = (
        values[30], values[31], values[32], values[33], values[34])
    source = values[35]
    gain_error, derivative, dead_band, duty_limit, slowness, delay = (
        values[36], values[37], values[38], values[39], values[40], values[41])
    offset, eccentric_cosine, eccentric_sine, moment = (
        values[42], values[43], values[44], values[45])
    stuck = 0.0

    weight = mass * GRAVITY * length * (1.0 + moment)
    load_inertia = mass * length * length
    elastic = backlash > 0.0 or compliance > 0.0
    stiffness = 1.0 / max(compliance, _LEAST_COMPLIANCE)
    contact = 2.0 * _CONTACT_DAMPING * math.sqrt(
        stiffness * load_inertia * armature / (load_inertia + armature))
    inertia = armature if elastic else armature + load_inertia
    has_stribeck = (stribeck != 0.0 or motor_stribeck != 0.0 or external_stribeck != 0.0
                    or motor_square != 0.0 or external_square != 0.0
                    or square_stribeck != 0.0)
    law, limit = gain * (1.0 + gain_error), 1.0 - duty_limit

    n = time.size
    q, w = start, start_rate            # of the output shaft
    qm, wm = start, start_rate          # of the motor, seen from the output shaft
    t = time[0]
    asked = goal[0]
    k_goal, k_on = 0, 0                 # the samples whose goal and bridge state are in force
    duty, current = 0.0, 0.0
    first = True
    for k in range(n):
        if k > 0:
            span = time[k] - t
            count = max(1, int(math.ceil(span / step - 1e-9)))
            if elastic:
                count *= 2  # the teeth are stiff
            h = span / count
            for _ in range(count):
                # this kick acts from half a step ago to half a step ahead; a change of the goal
                # within that time counts with its part of it
                begin, end = t - 0.5 * h - delay, t + 0.5 * h - delay
                while k_goal + 1 < n and time[k_goal + 1] <= begin:
                    k_goal += 1
                wanted = goal[k_goal]
                if k_goal + 1 < n and time[k_goal + 1] < end:
                    part = (end - time[k_goal + 1]) / h
                    wanted += part * (goal[k_goal + 1] - wanted)
                while k_on + 1 < n and time[k_on + 1] <= begin:
                    k_on += 1
                on = enabled[k_on]
                if k_on + 1 < n and time[k_on + 1] < end:
                    on += (end - time[k_on + 1]) / h * (enabled[k_on + 1] - on)
                if slowness > 0.0:
                    most = h / slowness
                    asked += min(max(wanted - asked, -most), most)
                else:
                    asked = wanted

                # the rates are half a step behind: bring the first there
                half = 0.5 * h if first else h
                first = False

                duty = _duty(asked, _sensed(q, eccentric_cosine, eccentric_sine), w, law,
                             derivative, dead_band, limit)
                warm = temperature[k - 1] - REFERENCE_TEMPERATURE
                ohms = resistance * max(1.0 + winding * warm, 0.2)
                if not elastic:
                    qm, wm = q, w
                size = abs(duty)
                volts = supply
                if source > 0.0:
                    # the battery feels the motor's current for the duty's part of the time
                    volts = ((supply + source * duty * kt * wm / ohms)
                             / (1.0 + source * duty * duty / ohms))
                emf_part = 1.0 - coasting * (1.0 - size)
                driven = duty * volts
                if drop > 0.0:
                    driven = (max(driven - drop, 0.0) if driven > 0.0
                              else min(driven + drop, 0.0))
                current = on * (driven - emf_part * kt * wm) / ohms
                if current_limit > 0.0:
                    current = min(max(current, -1.0 / current_limit), 1.0 / current_limit)
                torque = kt * current
                if saturation != 0.0:
                    torque /= 1.0 + saturation * abs(current)
                torque -= (1.0 - on) * braking * kt * kt / ohms * wm
                # how fast the motor's torque falls with its rate
                damping = (on * emf_part + (1.0 - on) * braking) * kt * kt / ohms
                gravity = -weight * math.sin(q + offset)
                if ripple_cosine != 0.0 or ripple_sine != 0.0:
                    phase = ripple_cycles * qm
                    torque += ripple_cosine * math.cos(phase) + ripple_sine * math.sin(phase)

                external = gravity
                if elastic:
                    twist = qm - q
                    play = 0.5 * backlash
                    through = 0.0
                    if twist > play:
                        through = max(stiffness * (twist - play) + contact * (wm - w), 0.0)
                    elif twist < -play:
                        through = min(stiffness * (twist + play) + contact * (wm - w), 0.0)
                    external = -through

                level = coulomb
                if asymmetry != 0.0:
                    level *= 1.0 + (asymmetry if wm >= 0.0 else -asymmetry)
                mesh = 1.0
                if friction_cosine != 0.0 or friction_sine != 0.0:
                    # it is what presses the teeth together that rubs more here than there
                    phase = friction_cycles * qm
                    mesh += friction_cosine * math.cos(phase) + friction_sine * math.sin(phase)
                level += abs(external * external_share - torque * motor_share)
                level += square * torque * torque
                if has_stribeck:
                    extra = stribeck + abs(external * external_stribeck - torque * motor_stribeck)
                    extra += square_stribeck * torque * torque
                    if external * torque < 0.0:
                        if abs(external) < abs(torque):
                            extra += external_square * external * external
                        elif abs(external) > abs(torque):
                            extra += motor_square * torque * torque
                    level += extra * math.exp(-(abs(wm) / stribeck_rate) ** stribeck_shape)
                level *= max(mesh, 0.0)
                drag = viscous
                if thinning != 0.0:
                    drag /= 1.0 + thinning * abs(wm)
                drag += windage * abs(wm)
                if warmth != 0.0:
                    factor = max(1.0 + warmth * warm, 0.0)
                    level *= factor
                    drag *= factor
                level = max(level, 0.0)
                if ageing > 0.0 and stuck > 0.0:
                    level *= 1.0 + ageing * math.log(1.0 + stuck / 0.02)

                # damping is taken in the middle of the step, friction as what stops the shaft
                total = damping + drag
                free = (wm + half * (torque + damping * wm + external
                                     - 0.5 * total * wm) / inertia)
                stopping = half * level / inertia
                free = max(free - stopping, 0.0) if free > 0.0 else min(free + stopping, 0.0)
                wm = free / (1.0 + 0.5 * half * total / inertia)
                wm = min(max(wm, -200.0), 200.0)
                stuck = stuck + h if wm == 0.0 else 0.0
                if elastic:
                    w += half * (gravity - external) / load_inertia
                    w = min(max(w, -200.0), 200.0)
                    q += h * w
                    qm += h * wm
                else:
                    w = wm
                    q += h * w
                t += h
            t = time[k]
        # the goal of this sample is in force when the position is read
        k_now = k_goal
        while k_now + 1 < n and time[k_now + 1] <= time[k] - delay + 1e-9:
            k_now += 1
        now = asked if slowness > 0.0 else goal[k_now]
        sensed = _sensed(q, eccentric_cosine, eccentric_sine)
        out[k, 0] = sensed
        out[k, 1] = w
        out[k, 2] = enabled[k] * _duty(now, sensed, w, law, derivative, dead_band, limit)
        out[k, 3] = current


@inner
def _sensed(q: float, cosine: float, sine: float) -> float:
    """Return what an encoder beside the axis reads [rad]."""
    if cosine == 0.0 and sine == 0.0:
        return q
    return q + cosine * (math.cos(q) - 1.0) + sine * math.sin(q)


@inner
def _duty(asked: float, sensed: float, rate: float, law: float, derivative: float,
          dead_band: float, limit: float) -> float:
    """Return the duty that the firmware sets."""
    error = asked - sensed
    if dead_band > 0.0:
        error = max(error - dead_band, 0.0) if error > 0.0 else min(error + dead_band, 0.0)
    return min(max(law * (error - derivative * rate), -limit), limit)
