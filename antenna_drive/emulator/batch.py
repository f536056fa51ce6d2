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
Many variants of one test, integrated as a whole and read straight at the samples' times.

The units' own equations (`physics`) are coupled continuously here, without the macro-steps of
`emulator.run`: one Runge-Kutta step covers the whole drive, ends at every sample and at every
jump of the command, and is cut where a tooth meets or a rotor sticks. This is the engine of the
diagnosis, which runs a test thousands of times with other parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.physics import motor_drive, structure, torque_share
from antenna_drive.physics.compiling import compiled, inner, shared
from antenna_drive.physics.integrator import located_runge_kutta, work_space
from antenna_drive.physics.motor import ammeter, tachometer
import numpy as np
from numpy.typing import NDArray

CHANNELS = (
    'motor_1/ammeter', 'motor_2/ammeter', 'motor_1/tach_rate', 'motor_2/tach_rate',
    'plant/encoder', 'torque_share/bias_voltage',
)

# Where each unit's states and modes lie in those of the whole drive.
_M1, _M2 = 0, motor_drive.STATES
_SHARE = 2 * motor_drive.STATES
_PLANT = _SHARE + torque_share.STATES
_MODE_2 = motor_drive.MODES
_MODE_SHARE = 2 * motor_drive.MODES
_MODE_PLANT = _MODE_SHARE + torque_share.MODES
_MODES = _MODE_PLANT + structure.MODES
# Of the unit that has the most.
_OUTPUTS = max(motor_drive.OUTPUTS, torque_share.OUTPUTS, structure.OUTPUTS)

# Columns of the table of steps.
LENGTH, COMMAND, SLOPE, CURVE, TORQUE, TORQUE_SLOPE, FIXED_BIAS, CHANGE = range(8)
COLUMNS = 8


@inner
def _motor_inputs(t, x, u, p):  # type: ignore[no-untyped-def]
    """Write the inputs that both motors have at t into their place in u."""
    c, motor, share, _ = u
    share[0, 0] = x[_M1 + motor_drive.CURRENT]
    share[1, 0] = x[_M2 + motor_drive.CURRENT]
    motor[0, 0] = c[COMMAND] + (c[SLOPE] + c[CURVE] * t) * t
    motor[1, 0] = x[_SHARE + torque_share.COUNTER_TORQUE]
    motor[1, 1] = torque_share._counter_torque_rate(
        0.0, x[_SHARE:_PLANT], share, p.torque_share)
    motor[2, 0] = x[_PLANT + structure.ANGLE]
    motor[3, 0] = x[_PLANT + structure.RATE]


@shared
def _rates(t, x, mode, u, p, dx):  # type: ignore[no-untyped-def]
    c, motor, share, plant = u
    _motor_inputs(t, x, u, p)
    torque_share._rates(0.0, x[_SHARE:_PLANT], mode[_MODE_SHARE:_MODE_PLANT], share,
                        p.torque_share, dx[_SHARE:_PLANT])
    motor_drive._rates(0.0, x[:_M2], mode[:_MODE_2], motor, p.motor_1, dx[:_M2])
    motor_drive._rates(0.0, x[_M2:_SHARE], mode[_MODE_2:_MODE_SHARE], motor, p.motor_2,
                       dx[_M2:_SHARE])
    # a motor's impulse is the integral of its gear torque
    plant[structure.GEAR_TORQUE_1, 0] = dx[_M1 + motor_drive.IMPULSE]
    plant[structure.GEAR_TORQUE_2, 0] = dx[_M2 + motor_drive.IMPULSE]
    plant[structure.EXTERNAL_TORQUE, 0] = c[TORQUE] + c[TORQUE_SLOPE] * t
    structure._rates(0.0, x[_PLANT:], mode[_MODE_PLANT:], plant, p.plant.axis, dx[_PLANT:])


@shared
def _switch(t, x, mode, u, p, commit):  # type: ignore[no-untyped-def]
    c, motor, share, plant = u
    _motor_inputs(t, x, u, p)
    changed = motor_drive._switch(0.0, x[:_M2], mode[:_MODE_2], motor, p.motor_1, commit)
    if changed and not commit:
        return True
    changed |= motor_drive._switch(0.0, x[_M2:_SHARE], mode[_MODE_2:_MODE_SHARE], motor,
                                   p.motor_2, commit)
    if changed and not commit:
        return True
    changed |= torque_share._switch(0.0, x[_SHARE:_PLANT], mode[_MODE_SHARE:_MODE_PLANT], share,
                                    p.torque_share, commit)
    if changed and not commit:
        return True
    _, plant[structure.GEAR_TORQUE_1, 0] = motor_drive._gear(
        0.0, x[:_M2], mode[:_MODE_2], motor, p.motor_1)
    _, plant[structure.GEAR_TORQUE_2, 0] = motor_drive._gear(
        0.0, x[_M2:_SHARE], mode[_MODE_2:_MODE_SHARE], motor, p.motor_2)
    plant[structure.EXTERNAL_TORQUE, 0] = c[TORQUE] + c[TORQUE_SLOPE] * t
    changed |= structure._switch(0.0, x[_PLANT:], mode[_MODE_PLANT:], plant, p.plant.axis, commit)
    return changed


# What acts on the whole drive from outside is no faster than its states, but for jumps of the
# command: what they switch is located just behind them.
_advance = located_runge_kutta(_rates, _switch, inputs_jump=False)


@inner
def _read(x, dx, mode, drive, out):  # type: ignore[no-untyped-def]
    """Write what the sensors say, and how fast it changes, at a state and its derivative."""
    for m in range(2):
        first = _M1 if m == 0 else _M2
        p = drive.motor_1 if m == 0 else drive.motor_2
        current, rate = first + motor_drive.CURRENT, first + motor_drive.RATE
        out[m, 0] = ammeter(x[current], p.ammeter)
        out[m, 1] = p.ammeter.gain * dx[current]
        out[2 + m, 0] = tachometer(x[rate], x[first + motor_drive.ANGLE], p.tachometer)
        out[2 + m, 1] = p.tachometer.gain * dx[rate]
    out[4, 0] = structure.encoder(x[_PLANT + structure.ANGLE], drive.plant.encoder)
    out[4, 1] = x[_PLANT + structure.RATE]
    out[5, 0], out[5, 1] = torque_share.voltmeter(
        x[_SHARE:_PLANT], mode[_MODE_SHARE:_MODE_PLANT], drive.torque_share.circuit)


@compiled
def _run(  # type: ignore[no-untyped-def]
        p, numbers, changing, steps, keep, x, dx, mode, motor, share, plant, work, y, out):
    """Run one variant over a table of steps; write what the sensors say into out."""
    drive = p[0]
    given = numbers[changing]
    u = (steps[0], motor, share, plant)
    motor_drive.start(drive.motor_1, x[:_M2], mode[:_MODE_2], y)
    motor_drive.start(drive.motor_2, x[_M2:_SHARE], mode[_MODE_2:_MODE_SHARE], y)
    torque_share.start(drive.torque_share, x[_SHARE:_PLANT], mode[_MODE_SHARE:_MODE_PLANT], y)
    structure.start(drive.plant, x[_PLANT:], mode[_MODE_PLANT:], y)
    for k in range(-1, steps.shape[0]):
        if k >= 0:
            u = (steps[k], motor, share, plant)
            drive.torque_share.circuit.fixed_voltage = steps[k, FIXED_BIAS]
            numbers[changing] = given + steps[k, CHANGE]
            _advance(x, mode, u, drive, steps[k, LENGTH], 1, work)
        row = keep[k + 1]
        if row < 0:
            continue
        t = steps[k, LENGTH] if k >= 0 else 0.0
        _rates(t, x, mode, u, drive, dx)
        _read(x, dx, mode, drive, out[row])


@dataclass(frozen=True)
class Schedule:
    """
    What a test does to the drive, step by step of the integration, and where it is read.

    Attributes
    ----------
    steps : shape (n, COLUMNS): length [s]; rate command as value, slope and half the curvature
        from the step's start on [rad/s, rad/s^2, rad/s^3]; torque on the axis, value and slope
        [N m, N m/s]; voltage of a fixed bias source [V]; change of the number at `changing`, in
        its own unit
    keep : shape (n + 1,): the row of the result at the start and after each step, -1 for none
    changing : which number of the drive's record changes over time, see `records.place_of`

    """

    steps: FloatArray
    keep: NDArray[np.int64]
    changing: int = 0

    @property
    def rows(self) -> int:
        """Return how many samples a run gives."""
        return int(self.keep.max()) + 1


def run(record: np.ndarray[Any, np.dtype[Any]], schedule: Schedule) -> FloatArray:
    """
    Run one variant of the drive through a test.

    Parameters
    ----------
    record
        of Drive, from `record_of`, shape (1,); left as it is
    schedule
        of the test

    Returns
    -------
    array of shape (rows, len(CHANNELS), 2): value and time derivative of each reading, SI units,
    article amperes

    """
    states = _PLANT + structure.states(int(record[0]['plant']['axis']['mode_inertias_count']))
    out = np.empty((schedule.rows, len(CHANNELS), 2))
    numbers = record.view(np.float64).copy()
    record = numbers.view(record.dtype)
    record['torque_share']['circuit']['fixed_voltage'] = schedule.steps[0, FIXED_BIAS]
    _run(record, numbers, schedule.changing, schedule.steps, schedule.keep,
         np.zeros(states), np.zeros(states), np.zeros(_MODES, np.int64),
         np.zeros((motor_drive.INPUTS, 2)), np.zeros((torque_share.INPUTS, 2)),
         np.zeros((structure.INPUTS, 2)), work_space(states), np.zeros((_OUTPUTS, 2)), out)
    return out


def run_all(jobs: Sequence[tuple[np.ndarray[Any, np.dtype[Any]], Schedule]],
            executor: Executor | None = None) -> list[FloatArray]:
    """Run many variants, in the threads of `executor` if there is one; see `run`."""
    if executor is None:
        return [run(*job) for job in jobs]
    return list(executor.map(lambda job: run(*job), jobs))
