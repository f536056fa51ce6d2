# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A body under a cascaded loop, with what may hang on it: the equations of the joint and the axis.

Friction is that of bristles which bend before they slip (C. Canudas de Wit et al., A new model for
control of systems with friction, IEEE Transactions on Automatic Control 40, 1995), with a level
that falls with the rate as a hyperbola. A step is split (G. Strang, 1968): half of it bends the
bristles at a constant rate, exactly; the bodies then move by the classical Runge-Kutta method with
these bristles; then the other half follows. Lags of the current are exact, too.

Torque and force, angle and position, inertia and mass are alike: read N m or N, rad or m.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from lab.antenna.compiled import compiled, inner
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

TICK_S = 1e-3       # of the controller
PARTS = 8           # steps of the integration in a tick


class Mechanism(NamedTuple):
    """The numbers of a machine; zero switches off what is not marked as needed."""

    motor: Annotated[float, 'kg m^2']               # the driven body; needed
    constant: Annotated[float, 'N m/A']             # driving torque per current; needed
    coulomb: Annotated[float, 'N m']                # friction of the motor; needed
    viscous: Annotated[float, 'N m s/rad']          # friction of the motor
    bristle: Annotated[float, 'rad']                # deflection at which bristles slip; needed
    bristle_damping: Annotated[float, '1']          # damping ratio of the motor on its bristles
    position_gain: Annotated[float, '1/s']          # of the loop, as the next four
    rate_limit: Annotated[float, 'rad/s']
    velocity_gain: Annotated[float, 'A s/rad']
    velocity_time: Annotated[float, 's']
    current_limit: Annotated[float, 'A']
    current_lag: Annotated[float, 's']              # of the current loop; needed
    digit: Annotated[float, 'rad']                  # of the encoder in the loop; needed
    load: Annotated[float, 'kg m^2'] = 0.0          # body behind the shaft; 0: the motor is all
    stiffness: Annotated[float, 'N m/rad'] = 0.0    # of the shaft
    damping: Annotated[float, 'N m s/rad'] = 0.0    # of the shaft
    half_gap: Annotated[float, 'rad'] = 0.0         # of the teeth between motor and shaft
    hung_share: Annotated[float, '1'] = 0.0         # share of the last body that hangs on a spring
    hung_hz: Annotated[float, 'Hz'] = 10.0          # frequency of what hangs
    hung_damping: Annotated[float, '1'] = 0.03      # damping ratio of what hangs
    constant_loss: Annotated[float, '1/A^2'] = 0.0  # saturation: constant / (1 + loss current^2)
    asymmetry: Annotated[float, '1'] = 0.0          # share of Coulomb: more forward, less backward
    stribeck: Annotated[float, 'N m'] = 0.0         # falls as 1 / (1 + rate / stribeck_rate)
    stribeck_rate: Annotated[float, 'rad/s'] = 1.0
    slope: Annotated[float, '1/rad'] = 0.0          # by which friction grows along the way
    spot: Annotated[float, '1'] = 0.0               # one place that rubs harder, as a share
    spot_at: Annotated[float, 'rad'] = 0.0
    spot_width: Annotated[float, 'rad'] = 1.0
    cooling: Annotated[float, '1'] = 0.0            # share of friction lost to warm grease
    cooling_time: Annotated[float, 's'] = 10.0
    brake: Annotated[float, 'N m'] = 0.0            # friction of a brake that drags for a while
    brake_from: Annotated[float, 's'] = 0.0
    brake_until: Annotated[float, 's'] = 0.0
    ripple: Annotated[float, 'N m'] = 0.0           # torque that repeats with the motor
    ripple_cycles: Annotated[float, '1/rad'] = 1.0
    ripple_phase: Annotated[float, 'rad'] = 0.0
    spring: Annotated[float, 'N m/rad'] = 0.0       # that pulls the motor to zero
    gravity: Annotated[float, 'N m'] = 0.0          # by the angle of the load behind the gear
    gravity_phase: Annotated[float, 'rad'] = 0.0
    gear: Annotated[float, '1'] = 1.0
    shake: Annotated[float, 'N m'] = 0.0            # torque on the last body at one frequency
    shake_hz: Annotated[float, 'Hz'] = 1.0
    encoder_error: Annotated[float, 'rad'] = 0.0    # cyclic, of that encoder
    encoder_cycles: Annotated[float, '1/rad'] = 1.0
    encoder_phase: Annotated[float, 'rad'] = 0.0
    slip: Annotated[float, 'rad'] = 0.0             # by which the encoder slips once
    slip_at: Annotated[float, 's'] = 0.0
    dead_zone: Annotated[float, 'A'] = 0.0          # of the amplifier, smooth
    delay: Annotated[float, 's'] = 0.0              # of the demand, as three equal lags


@inner
def level(m: Mechanism, t: float, angle: float, rate: float) -> float:
    """Return the friction at which the bristles slip [N m]."""
    side = 1.0 if rate >= 0.0 else -1.0
    size = m.coulomb * (1.0 + side * m.asymmetry)
    size += m.stribeck / (1.0 + abs(rate) / m.stribeck_rate)
    if m.spot != 0.0:
        size *= 1.0 + m.spot * math.exp(-((angle - m.spot_at) / m.spot_width) ** 2)
    size *= max(1.0 + m.slope * angle, 0.05)
    if m.cooling != 0.0:
        size *= 1.0 - m.cooling * (1.0 - math.exp(-max(t, 0.0) / m.cooling_time))
    if m.brake_from < t < m.brake_until:
        size += m.brake
    return size


@inner
def accelerations(m: Mechanism, t: float, current: float, bent: float, q: float, w: float,
                  ql: float, wl: float, qh: float, wh: float) -> tuple[float, float, float]:
    """
    Return the accelerations of motor, load and what hangs [rad/s^2].

    `t` counts from the start of the recording [s]; `current` is in [A] and `bent` [rad] is the
    bristles' deflection. q, w, ql, wl, qh, wh are the bodies' angles [rad] and rates [rad/s].
    """
    stiff = m.coulomb / m.bristle
    bending = w - abs(w) * bent * stiff / level(m, t, q, w)
    thin = 1.0
    if m.cooling != 0.0:
        thin -= m.cooling * (1.0 - math.exp(-max(t, 0.0) / m.cooling_time))
    motor = (m.constant * current / (1.0 + m.constant_loss * current * current)
             - stiff * bent - 2.0 * m.bristle_damping * math.sqrt(stiff * m.motor) * bending
             - m.viscous * thin * w - m.spring * q)
    if m.ripple != 0.0:
        a = m.ripple_cycles * q + m.ripple_phase
        motor += m.ripple * (math.sin(a) + 0.3 * math.sin(2.0 * a + 1.0))
    shaken = m.shake * math.sin(2.0 * math.pi * m.shake_hz * t)
    last = m.load if m.load > 0.0 else m.motor
    hung, holding = m.hung_share * last, 0.0
    if hung > 0.0:
        turn = 2.0 * math.pi * m.hung_hz
        q_last, w_last = (ql, wl) if m.load > 0.0 else (q, w)
        holding = hung * turn * (turn * (q_last - qh) + 2.0 * m.hung_damping * (w_last - wh))
    if m.load <= 0.0:
        return ((motor + shaken - holding) / (m.motor - hung), 0.0,
                holding / hung if hung > 0.0 else 0.0)
    twist = q - ql
    if m.half_gap > 0.0:
        # the flanks are rounded: they carry fully a tenth of the gap later
        pressed = max(abs(twist) - m.half_gap, 0.0)
        touching = pressed / (pressed + 0.1 * m.half_gap)
        shaft = m.stiffness * math.copysign(pressed * touching, twist) + (
            m.damping * (w - wl) * touching)
    else:
        shaft = m.stiffness * twist + m.damping * (w - wl)
    weight = m.gravity * math.sin(ql / m.gear + m.gravity_phase) if m.gravity != 0.0 else 0.0
    return ((motor - shaft) / m.motor, (shaft + shaken + weight - holding) / (m.load - hung),
            holding / hung if hung > 0.0 else 0.0)


@inner
def bristles(m: Mechanism, t: float, bent: float, q: float, w: float, span: float) -> float:
    """Return the deflection of the bristles after a span at a constant rate, exactly [rad]."""
    stiff = m.coulomb / m.bristle
    slipping = level(m, t, q, w) / stiff
    if w == 0.0:
        return bent
    end = math.copysign(slipping, w)
    return end + (bent - end) * math.exp(-abs(w) * span / slipping)


@inner
def moved(m: Mechanism, now: float, h: float, middle: float, bent: float, q: float, w: float,
          ql: float, wl: float, qh: float,
          wh: float) -> tuple[float, float, float, float, float, float]:
    """Return angles and rates after a step h of Runge and Kutta's fourth order."""
    a0, b0, c0 = accelerations(m, now, middle, bent, q, w, ql, wl, qh, wh)
    g = 0.5 * h
    a1, b1, c1 = accelerations(
        m, now + g, middle, bent, q + g * w, w + g * a0, ql + g * wl, wl + g * b0,
        qh + g * wh, wh + g * c0)
    a2, b2, c2 = accelerations(
        m, now + g, middle, bent, q + g * (w + g * a0), w + g * a1,
        ql + g * (wl + g * b0), wl + g * b1, qh + g * (wh + g * c0), wh + g * c1)
    a3, b3, c3 = accelerations(
        m, now + h, middle, bent, q + h * (w + g * a1), w + h * a2,
        ql + h * (wl + g * b1), wl + h * b2, qh + h * (wh + g * c1), wh + h * c2)
    q += h * (w + h * (a0 + a1 + a2) / 6.0)
    ql += h * (wl + h * (b0 + b1 + b2) / 6.0)
    qh += h * (wh + h * (c0 + c1 + c2) / 6.0)
    w += h * (a0 + 2.0 * a1 + 2.0 * a2 + a3) / 6.0
    wl += h * (b0 + 2.0 * b1 + 2.0 * b2 + b3) / 6.0
    wh += h * (c0 + 2.0 * c1 + 2.0 * c2 + c3) / 6.0
    return q, w, ql, wl, qh, wh


@inner
def encoder_reading(m: Mechanism, t: float, q: float) -> float:
    """Return what the encoder reads before it is rounded to its digit [rad]."""
    read = q
    if m.encoder_error != 0.0:
        a = m.encoder_cycles * q + m.encoder_phase
        read += m.encoder_error * (math.sin(a) + 0.25 * math.sin(2.0 * a))
    if m.slip != 0.0 and t >= m.slip_at:
        read += m.slip
    return read


@inner
def demanded(m: Mechanism, asked: float, read: float, before: float,
             integral: float) -> tuple[float, float]:
    """Return the current that the controller demands at a tick, and its integral [A]."""
    wanted_rate = min(max(m.position_gain * (asked - read), -m.rate_limit), m.rate_limit)
    error = wanted_rate - (read - before) / TICK_S
    grown = integral
    if m.velocity_time > 0.0:
        grown += m.velocity_gain * error * TICK_S / m.velocity_time
    demand = m.velocity_gain * error + grown
    if abs(demand) <= m.current_limit or demand * error < 0.0:
        integral = grown
    demand = min(max(demand, -m.current_limit), m.current_limit)
    if m.dead_zone > 0.0:
        demand -= m.dead_zone * math.tanh(demand / m.dead_zone)
    return demand, integral


@compiled
def simulate(m: Mechanism, reference: FloatArray, ticks: int, begin: int, start: float,
             angle: FloatArray, current: FloatArray) -> None:
    """
    Write the encoder's angle [rad] and the current [A] at each tick, (n - 1) ticks + 1 of them.

    The bus asks for the angles `reference`, shape (n,) [rad], `ticks` of the controller apart; the
    drive goes from one to the next while it waits for the one after. The machine rests at `start`
    [rad]; the first reference holds for `begin` ticks before the recording.
    """
    q = ql = qh = before = start
    w = wl = wh = bent = integral = flowing = one = two = three = 0.0
    h = TICK_S / PARTS
    fall = math.exp(-h / m.current_lag)
    slow = math.exp(-3.0 * h / m.delay) if m.delay > 0.0 else 0.0
    for tick in range(-begin, (reference.size - 1) * ticks + 1):
        t = tick * TICK_S
        asked = reference[0]
        if tick > 0:
            k = (tick - 1) // ticks
            asked = reference[max(k - 1, 0)]
            asked += (reference[k] - asked) * (tick - k * ticks) / ticks
        read = encoder_reading(m, t, q)
        if tick >= 0:
            angle[tick], current[tick] = read, flowing
        read = m.digit * math.floor(read / m.digit + 0.5)
        if tick == -begin:
            before = read
        demand, integral = demanded(m, asked, read, before, integral)
        before = read
        for part in range(PARTS):
            now = t + part * h
            # each lag follows the mean of the one before it
            mean = 0.5 * (one + demand + (one - demand) * slow)
            one = demand + (one - demand) * slow
            end = mean + (two - mean) * slow
            mean, two = 0.5 * (two + end), end
            end = mean + (three - mean) * slow
            mean, three = 0.5 * (three + end), end
            if m.delay <= 0.0:
                mean = demand
            after = mean + (flowing - mean) * fall
            middle = 0.5 * (flowing + after)
            flowing = after
            bent = bristles(m, now, bent, q, w, 0.5 * h)
            q, w, ql, wl, qh, wh = moved(m, now, h, middle, bent, q, w, ql, wl, qh, wh)
            bent = bristles(m, now + h, bent, q, w, 0.5 * h)
