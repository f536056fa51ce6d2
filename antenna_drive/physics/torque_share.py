# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The torque-share circuit, Fig. 14 and Eq. (9)-(14), with Filter 1 behind it, Fig. 5.

States: x_3 of transfer function 3 [V], x_2 of transfer functions 2 and 4 [V], x_F of Filter 1 [V].
Modes: sign of x_3 (0 or 1), saturation of x_2 (-1 at the lower limit, +1 at the upper, 0 between).
Inputs: currents of both motors [article A].
"""

from antenna_drive.parameters.sets import Share, TorqueShare
from antenna_drive.physics.arrays import FloatArray, IntArray
from antenna_drive.physics.block import Block, Equation, held, output_rows, put, rows, Signal
from antenna_drive.physics.filter_1 import counter_torque_rate
from simgap.laws.compiling import inner, shared

STATE = rows('load', 'share', 'counter_torque')
MODE = rows('negative_load', 'saturation')
INPUT = rows('current_1', 'current_2')
OUTPUTS = (
    Signal('counter_torque', 'V', 'output of Filter 1'),
    Signal('bias_voltage', 'V', 'torque bias asked for, output of the torque-share circuit',
           exchanged=False),
)
OUTPUT = output_rows(OUTPUTS)
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

    current_sum : i_1 + i_2 [article A]
    p : TorqueShare
    """
    share = p.k_2 / p.s_2 * (p.fade_out_voltage
                             + p.g_4 * abs(p.current_to_voltage * current_sum))
    return p.bias_pot * saturated(share, p.saturation_low, p.saturation_high)


@inner
def _share_rate(x: FloatArray, p: TorqueShare) -> float:
    """Return the time derivative of x_2 [V/s], transfer functions 2 and 4."""
    return -p.s_2 * x[STATE.share] + p.k_2 * (p.fade_out_voltage + p.g_4 * abs(x[STATE.load]))


@inner
def _bias_voltage(x: FloatArray, p: TorqueShare) -> float:
    """Return v_b [V], Eq. (9), or the voltage of the source that is connected in its place."""
    if p.bias_source == FIXED:
        return p.fixed_voltage
    return p.bias_pot * saturated(x[STATE.share], p.saturation_low, p.saturation_high)


@inner
def voltmeter(x: FloatArray, mode: IntArray, p: TorqueShare) -> tuple[float, float]:
    """Return the bias voltage as it is read, and its time derivative [V], [V/s]."""
    rate = 0.0
    if p.bias_source == CIRCUIT and mode[MODE.saturation] == 0:
        rate = p.voltmeter_gain * p.bias_pot * _share_rate(x, p)
    return p.voltmeter_gain * _bias_voltage(x, p), rate


@inner
def _counter_torque_rate(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Share,
) -> float:
    """Return the time derivative of x_F [V/s]."""
    return counter_torque_rate(
        x[STATE.counter_torque], _bias_voltage(x, p.circuit),
        held(u, INPUT.current_1, t), held(u, INPUT.current_2, t), p.filter_1)


@shared
def rates(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Share, dx: FloatArray,
) -> None:
    """Write the time derivatives of the states."""
    share = p.circuit
    one, two = INPUT.current_1, INPUT.current_2
    current_sum = u[one, 0] + u[two, 0] + (u[one, 1] + u[two, 1]) * t
    dx[STATE.load] = -share.k_3 * (x[STATE.load] + share.current_to_voltage * current_sum)
    dx[STATE.share] = _share_rate(x, share)
    dx[STATE.counter_torque] = _counter_torque_rate(t, x, mode, u, p)


@inner
def _switched(x: FloatArray, mode: IntArray, p: TorqueShare, commit: bool) -> bool:
    negative = 1 if x[STATE.load] < 0.0 else 0
    saturation = 0
    if x[STATE.share] > p.saturation_high:
        saturation = 1
    elif x[STATE.share] < p.saturation_low:
        saturation = -1
    changed = negative != mode[MODE.negative_load] or saturation != mode[MODE.saturation]
    if commit and changed:
        mode[MODE.negative_load] = negative
        mode[MODE.saturation] = saturation
    return changed


@shared
def switch(
        t: float, x: FloatArray, mode: IntArray, u: FloatArray, p: Share, commit: bool,
) -> bool:
    """Return whether the modes no longer hold; write the new ones if `commit`."""
    return _switched(x, mode, p.circuit, commit)


@inner
def read(
        x: FloatArray, mode: IntArray, u: FloatArray, t: float, p: Share, y: FloatArray,
) -> None:
    """Write the outputs."""
    put(y, OUTPUT.counter_torque, x[STATE.counter_torque],
        _counter_torque_rate(t, x, mode, u, p))
    voltage, slope = voltmeter(x, mode, p.circuit)
    put(y, OUTPUT.bias_voltage, voltage, slope)


@inner
def start(p: Share, x: FloatArray, mode: IntArray) -> None:
    """Start from zero or, with start steady, from a circuit that has settled at no current."""
    share = p.circuit
    if share.start == STEADY:
        x[STATE.share] = share.k_2 * share.fade_out_voltage / share.s_2
    _switched(x, mode, share, True)


BLOCK = Block(
    kind=Share, bare='circuit', states=STATE, modes=MODE, inputs=INPUT, outputs=OUTPUTS,
    start=start, rates=rates, switch=switch, read=read,
    slopes={'counter_torque': Equation(_counter_torque_rate, ('current_1', 'current_2'))})
