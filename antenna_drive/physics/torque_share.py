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
"""
The torque-share circuit, Fig. 14 and Eq. (9)-(14), with Filter 1 behind it, Fig. 5.

States: x_3 of transfer function 3 [V], x_2 of transfer functions 2 and 4 [V], x_F of Filter 1 [V].
Mode: sign of x_3 (0 or 1), saturation of x_2 (-1 at the lower limit, +1 at the upper, 0 between).
Inputs: currents of both motors [article A]. Outputs: counter torque x_F [V], bias voltage [V].
"""

from __future__ import annotations

from antenna_drive.parameters.sets import Share, TorqueShare
from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.compiling import compiled, inner, shared
from antenna_drive.physics.filter_1 import counter_torque_rate
from antenna_drive.physics.integrator import located_runge_kutta
import numpy as np

LOAD, SHARE, COUNTER_TORQUE = range(3)
STATES = 3
NEGATIVE_LOAD, SATURATION = range(2)
MODES = 2
CURRENT_1, CURRENT_2 = range(2)
INPUTS = 2
OUTPUTS = 2
_AT_REST = np.zeros((INPUTS, 2))
# bias_source: where v_b comes from
CIRCUIT, FIXED = range(2)
# start: state of the circuit at t = 0
ZERO, STEADY = range(2)


@inner
def saturated(voltage: float, low: float, high: float) -> float:
    """Return the voltage kept between two limits, Eq. (10); all in V."""
    return min(max(voltage, low), high)


@inner
def steady_bias_voltage(current_sum: float, p: TorqueShare) -> float:
    """
    Return v_b of a current that does not change [V], Eq. (14).

    Parameters
    ----------
    current_sum
        i_1 + i_2 [article A]
    p
        TorqueShare

    """
    share = p.k_2 / p.s_2 * (p.fade_out_voltage
                             + p.g_4 * abs(p.current_to_voltage * current_sum))
    return p.bias_pot * saturated(share, p.saturation_low, p.saturation_high)


@inner
def _share_rate(x: FloatArray, p: TorqueShare) -> float:
    """Return the time derivative of x_2 [V/s], transfer functions 2 and 4."""
    return -p.s_2 * x[SHARE] + p.k_2 * (p.fade_out_voltage + p.g_4 * abs(x[LOAD]))


@inner
def _bias_voltage(x: FloatArray, p: TorqueShare) -> float:
    """Return v_b [V], Eq. (9), or the voltage of the source that is connected in its place."""
    if p.bias_source == FIXED:
        return p.fixed_voltage
    return p.bias_pot * saturated(x[SHARE], p.saturation_low, p.saturation_high)


@inner
def voltmeter(x: FloatArray, mode: IntArray, p: TorqueShare) -> tuple[float, float]:
    """Return the bias voltage as it is read, and its time derivative [V], [V/s]."""
    rate = 0.0
    if p.bias_source == CIRCUIT and mode[SATURATION] == 0:
        rate = p.voltmeter_gain * p.bias_pot * _share_rate(x, p)
    return p.voltmeter_gain * _bias_voltage(x, p), rate


@inner
def _counter_torque_rate(t: float, x: FloatArray, u: FloatArray, p: Share) -> float:
    return counter_torque_rate(
        x[COUNTER_TORQUE], _bias_voltage(x, p.circuit),
        u[CURRENT_1, 0] + u[CURRENT_1, 1] * t, u[CURRENT_2, 0] + u[CURRENT_2, 1] * t, p.filter_1)


@shared
def _rates(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Share, dx: FloatArray,
) -> None:
    share = p.circuit
    current_sum = u[CURRENT_1, 0] + u[CURRENT_2, 0] + (u[CURRENT_1, 1] + u[CURRENT_2, 1]) * t
    dx[LOAD] = -share.k_3 * (x[LOAD] + share.current_to_voltage * current_sum)
    dx[SHARE] = _share_rate(x, share)
    dx[COUNTER_TORQUE] = _counter_torque_rate(t, x, u, p)


@shared
def _switch(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Share, commit: bool,
) -> bool:
    negative = 1 if x[LOAD] < 0.0 else 0
    saturation = 0
    if x[SHARE] > p.circuit.saturation_high:
        saturation = 1
    elif x[SHARE] < p.circuit.saturation_low:
        saturation = -1
    changed = negative != mode[NEGATIVE_LOAD] or saturation != mode[SATURATION]
    if commit and changed:
        mode[NEGATIVE_LOAD] = negative
        mode[SATURATION] = saturation
    return changed


_advance = located_runge_kutta(_rates, _switch, STATES)


@compiled
def outputs(
        x: FloatArray, mode: IntArray, u: FloatArray, t: float, p: Share, y: FloatArray,
) -> None:
    """
    Write the outputs at t after the start of a macro-step, with their time derivatives.

    Parameters
    ----------
    x, mode
        states and mode at t, shapes (3,) and (2,)
    u
        inputs at the start of the macro-step, shape (2, 2)
    t
        [s]
    p
        record of TorqueShareUnit
    y
        receives value and derivative of each output, shape (2, 2)

    """
    y[0, 0] = x[COUNTER_TORQUE]
    y[0, 1] = _counter_torque_rate(t, x, u, p)
    y[1, 0], y[1, 1] = voltmeter(x, mode, p.circuit)


@compiled
def start(p: Share, x: FloatArray, mode: IntArray, y: FloatArray) -> None:
    """
    Write the initial state into x and mode, and its outputs into y; shapes as in `outputs`.

    Every state is zero; with start steady the circuit has settled at zero current.
    """
    share = p.circuit
    x[:] = 0.0
    mode[:] = 0
    if share.start == STEADY:
        x[SHARE] = share.k_2 * share.fade_out_voltage / share.s_2
    _switch(0.0, x, mode, _AT_REST, p, True)
    outputs(x, mode, _AT_REST, 0.0, p, y)


@compiled
def step(
        x: FloatArray, mode: IntArray, u: FloatArray, p: Share, h: float, steps: int,
        work: FloatArray, y: FloatArray,
) -> None:
    """
    Advance torque share and Filter 1 over one macro-step.

    Parameters
    ----------
    x, mode
        states and mode, advanced in place, shapes (3,) and (2,)
    u
        inputs, value and time derivative at the start of the macro-step, shape (2, 2)
    p
        record of TorqueShareUnit
    h
        macro-step [s]
    steps
        inner steps in it
    work
        from `integrator.work_space`
    y
        receives the outputs at the end, shape (2, 2)

    """
    _advance(x, mode, u, p, h, steps, work)
    outputs(x, mode, u, h, p, y)
