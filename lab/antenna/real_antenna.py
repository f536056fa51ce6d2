# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The real antenna: from a machine and a test sheet to the true signals.

    machine = reference_machine(circuit='new', filter_1='new')
    CATALOGUE['motor_2.torque_ripple'].change(machine, {...})
    history = simulate(machine, sheet, times)
"""

from dataclasses import dataclass
import math

from lab.antenna import equations, integrator, laws, waveform
from lab.antenna.equations import MOTOR_AT, MOTOR_SIZE
from lab.antenna.machine import Records
from lab.antenna.sheet import CaseSheet
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-8    # error of one step, relative to the size of each state


class SimulationError(RuntimeError):
    """The equations of this machine could not be integrated."""


@dataclass(frozen=True)
class TrueSignals:
    """The true signals at the requested times; arrays have shape (n,) unless noted."""

    time: FloatArray            # [s]
    command: FloatArray         # rate command [rad/s]
    current: FloatArray         # of motor 1 and 2, shape (2, n) [A]
    rate: FloatArray            # of the rotors, shape (2, n) [rad/s]
    tach: FloatArray            # readings of the tachometers in the loop, shape (2, n) [rad/s]
    axis_angle: FloatArray      # [rad]
    axis_rate: FloatArray       # [rad/s]
    encoder_angle: FloatArray   # of the encoder's own shaft [rad]
    bias: FloatArray            # bias voltage [V]
    state: FloatArray           # shape (n, equations.STATES)
    steps: int                  # the integrator counts these three
    rejected: int
    switchings: int


def start_state(machine: Records, sheet: CaseSheet, place: tuple[float, float]) -> FloatArray:
    """
    Return the state at rest, shape (equations.STATES,); the sheet says if the circuit has settled.

    `place` says where each motor lies in its gap, -1 to 1.
    """
    y = np.zeros(equations.STATES)
    circuit = machine.circuit[0]
    if sheet.bias['type'] == 'circuit' and sheet.bias.get('start', 'steady') == 'steady':
        y[equations.X_2] = circuit['k_2'] * circuit['fade_out'] / circuit['s_2']
    for which in range(2):
        motor = machine.motors[which]
        at = MOTOR_AT + which * MOTOR_SIZE
        y[at + equations.THETA] = place[which] * motor['half_gap']
        # Tooth errors shift the gap: iterate until the motor stands at its place.
        for _ in range(50):
            x, _, gap = laws.gear_deflection(
                motor, machine.structure[0], y[at + equations.THETA], 0.0, 0.0, 0.0)
            y[at + equations.THETA] -= 0.5 * (x - place[which] * gap)
    return y


def state_sizes(machine: Records) -> FloatArray:
    """Return the typical size of each state, which scales its error."""
    size = np.ones(equations.STATES)
    per_axis = 1.0 / float(machine.structure[0]['gear_ratio'])
    size[equations.AXIS_AT:] = per_axis
    size[equations.DAHL] = 1.0
    for which in range(2):
        at = MOTOR_AT + which * MOTOR_SIZE
        size[at + equations.DELAY_AT:at + equations.DELAY_AT + 4] = 1e-2
        size[at + equations.TACH_SLOPE] = 100.0
    return size


def simulate(machine: Records, sheet: CaseSheet, times: FloatArray,
             place: tuple[float, float] = (0.0, 0.0),
             tolerance: float = TOLERANCE) -> TrueSignals:
    """
    Simulate one test from rest and return the true signals at `times`, ascending from 0, (n,) [s].

    `place` says where each motor lies in its gap at the start, -1 to 1; `tolerance` is the largest
    error of one step. Raise SimulationError, which says where the integration failed.
    """
    test = sheet.record()
    end = float(times[-1])
    y = start_state(machine, sheet, place)
    mode = np.zeros(equations.SWITCHES, np.int64)
    mode[equations.LOAD_SIGN] = 1
    states = np.full((len(times), equations.STATES), math.nan)
    statistics = np.zeros(3, np.int64)
    edges = input_edges(machine, test[0], end)
    reason = integrator.integrate(machine, test[0], y, mode, edges, times, tolerance,
                                  state_sizes(machine), states, statistics)
    if reason != integrator.DONE:
        filled = int(np.count_nonzero(np.isfinite(states[:, 0])))
        what = {integrator.STEP_TOO_SMALL: 'the step became too small',
                integrator.NOT_FINITE: 'a state is not finite',
                integrator.CHATTER: 'a switch chatters',
                integrator.TOO_MANY_STEPS: 'too many steps'}[reason]
        raise SimulationError(f'{what} after sample {filled} of {len(times)}')
    return history_of(machine, test, times, states, edges, statistics)


def input_edges(machine: Records, test: np.void, end: float) -> FloatArray:
    """Return the times at which an input or its slope jumps [s]."""
    edges = list(waveform.corners(test, end))
    structure = machine.structure[0]
    edges.append(float(structure['ballast_at']))
    for motor in machine.motors:
        edges += [float(motor['brake_start']), float(motor['brake_end'])]
        if motor['dropout_length'] > 0.0:
            starts = motor['dropout'][motor['dropout'] >= 0.0]
            edges += [*starts, *(starts + motor['dropout_length'])]
    return np.array(sorted({float(t) for t in edges if 0.0 < t < end}), dtype=np.float64)


def history_of(machine: Records, test: NDArray[np.void], times: FloatArray, states: FloatArray,
               edges: FloatArray, statistics: NDArray[np.int64]) -> TrueSignals:
    bounds = np.concatenate(([0.0], edges, times[-1:]))
    stretch = np.minimum(np.searchsorted(bounds, times, side='right') - 1, len(edges))
    middles = 0.5 * (bounds[stretch] + bounds[stretch + 1])
    count = len(times)
    command, bias, tach = np.empty(count), np.empty(count), np.empty((2, count))
    equations.readings(times, middles, states, machine, test[0], command, bias, tach)
    encoder = (states[:, equations.ENCODER] if machine.structure[0]['encoder_frequency'] > 0.0
               else states[:, equations.THETA_A])
    columns = [MOTOR_AT + which * MOTOR_SIZE for which in range(2)]
    return TrueSignals(
        time=times, command=command,
        current=states[:, [at + equations.I for at in columns]].T,
        rate=states[:, [at + equations.W for at in columns]].T,
        tach=tach, axis_angle=states[:, equations.THETA_A],
        axis_rate=states[:, equations.W_A], encoder_angle=encoder, bias=bias, state=states,
        steps=int(statistics[0]), rejected=int(statistics[1]), switchings=int(statistics[2]))
