# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A position loop around the rate loop: the rate command that brings the encoder to a moving angle.

States: how far the commanded angle has moved from its start [rad], integral of the error [rad s].
Modes: the rate command at its limit (-1 at the lower, +1 at the upper, 0 between); the integral
stands still while it is there.
"""

from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.block import Block, Equation, held, output_rows, put, rest, rows, Signal
from own_position_loop.parameters import PositionLoop
from simgap.laws.compiling import inner, shared

STATE = rows('moved', 'integral')
MODE = rows('limited')
INPUT = rows('encoder')
OUTPUTS = (
    Signal('rate_command', 'rad/s', 'axis rate command of the position loop'),
    Signal('angle_error', 'rad', 'commanded angle minus encoder', exchanged=False),
)
OUTPUT = output_rows(OUTPUTS)


@inner
def _error(t: float, x: FloatArray, u: FloatArray, p: PositionLoop) -> float:
    """Return the angle error [rad]."""
    return p.angle + x[STATE.moved] - held(u, INPUT.encoder, t)


@inner
def _demand(t: float, x: FloatArray, u: FloatArray, p: PositionLoop) -> float:
    """Return the rate command before its limit [rad/s], with the track's rate fed forward."""
    return (p.track_rate + p.proportional_gain * _error(t, x, u, p)
            + p.integral_gain * x[STATE.integral])


@inner
def _command(t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: PositionLoop) -> float:
    """Return the rate command [rad/s]."""
    return min(max(_demand(t, x, u, p), -p.rate_limit), p.rate_limit)


@shared
def rates(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: PositionLoop, dx: FloatArray,
) -> None:
    """Write the time derivatives of the states."""
    dx[STATE.moved] = p.track_rate
    dx[STATE.integral] = _error(t, x, u, p) if mode[MODE.limited] == 0 else 0.0


@shared
def switch(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: PositionLoop, commit: bool,
) -> bool:
    """Return whether the rate command comes to its limit or leaves it; note it if `commit`."""
    demand = _demand(t, x, u, p)
    limited = 0
    if demand > p.rate_limit:
        limited = 1
    elif demand < -p.rate_limit:
        limited = -1
    changed = limited != mode[MODE.limited]
    if commit and changed:
        mode[MODE.limited] = limited
    return changed


@shared
def read(
        x: FloatArray, mode: IntArray, u: FloatArray, t: float, p: PositionLoop, y: FloatArray,
) -> None:
    """Write the outputs; the slope of the encoder is that at the start of the macro-step."""
    error, error_rate = _error(t, x, u, p), p.track_rate - u[INPUT.encoder, 1]
    slope = 0.0
    if mode[MODE.limited] == 0:
        slope = p.proportional_gain * error_rate + p.integral_gain * error
    put(y, OUTPUT.rate_command, _command(t, x, mode, u, p), slope)
    put(y, OUTPUT.angle_error, error, error_rate)


BLOCK = Block(
    kind=PositionLoop, states=STATE, modes=MODE, inputs=INPUT, outputs=OUTPUTS,
    start=rest, rates=rates, switch=switch, read=read,
    values={'rate_command': Equation(_command, ('encoder',))})
