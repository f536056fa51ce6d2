# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Many variants of one test, integrated as a whole and read straight at the samples' times.

The units' own equations (`physics`) are coupled continuously here, without the macro-steps of
`emulator.run`: one Runge-Kutta step covers the whole drive, ends at every sample and at every
jump of the command, and is cut where a tooth meets or a rotor sticks. This is the engine of the
diagnosis, which runs a test thousands of times with other parameters.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

from antenna_drive.emulator.coupling import Coupling
from antenna_drive.emulator.kernels import blocks, folders
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.wiring import DRIVE, Wiring
from antenna_drive.physics.compiling import generated
from antenna_drive.physics.integrator import located_runge_kutta, work_space
from antenna_drive.readings import SIGNALS
import numpy as np
from numpy.typing import NDArray

# Columns of the table of steps.
LENGTH, COMMAND, SLOPE, CURVE, TORQUE, TORQUE_SLOPE, FIXED_BIAS, CHANGE = range(8)
COLUMNS = 8

# What the table says of the test signals at t after the start of a step.
_TABLE = {
    'test_signal/rate_command': f'c[{COMMAND}] + (c[{SLOPE}] + c[{CURVE}] * t) * t',
    'test_signal/external_torque': f'c[{TORQUE}] + c[{TORQUE_SLOPE}] * t',
}
_FIXED_BIAS = 'torque_share.circuit.fixed_voltage'

_TEXT = """
@shared
def rates(t, x, mode, u, p, dx):
    c, {inputs} = u
    {rates}


@shared
def switch(t, x, mode, u, p, commit):
    c, {inputs} = u
    changed = False
    {switch}
    return changed


# What acts on the whole drive from outside is no faster than its states, but for jumps of the
# command: what they switch is located just behind them.
advance = located_runge_kutta(rates, switch, inputs_jump=False)


@inner
def sample(t, x, mode, u, p, y, out):
    c, {inputs} = u
    {sample}


@compiled
def run(p, numbers, changing, steps, keep, x, mode, inputs, work, y, out):
    drive = p[0]
    given = numbers[changing]
    drive.{fixed_bias} = steps[0, {bias_column}]
    {inputs}, = inputs
    u = (steps[0], {inputs})
    {start}
    for k in range(-1, steps.shape[0]):
        if k >= 0:
            u = (steps[k], {inputs})
            drive.{fixed_bias} = steps[k, {bias_column}]
            numbers[changing] = given + steps[k, {change_column}]
            advance(x, mode, u, drive, steps[k, {length_column}], 1, work)
        row = keep[k + 1]
        if row >= 0:
            t = steps[k, {length_column}] if k >= 0 else 0.0
            sample(t, x, mode, u, drive, y, out[row])
"""


@cache
def _kernel(wiring: Wiring, channels: tuple[str, ...]) -> tuple[Any, tuple[int, ...]]:
    """Return the compiled `run` of a wiring, read at `channels`, and how many inputs it wants."""
    coupling = Coupling(wiring, _TABLE)
    text = _TEXT.format(
        inputs=', '.join(f'u_{name}' for name in coupling.inputs), rates=coupling.rates(),
        switch=coupling.switch(), sample=coupling.sample(channels), start=coupling.start(),
        fixed_bias=_FIXED_BIAS, bias_column=FIXED_BIAS, change_column=CHANGE, length_column=LENGTH)
    names = {**coupling.functions, 'located_runge_kutta': located_runge_kutta}
    module = generated('batch', text, names, folders(wiring))
    return module.run.dispatcher, tuple(coupling.inputs.values())


@dataclass(frozen=True)
class Schedule:
    """
    What a test does to the drive, step by step of the integration, and where it is read.

    steps : shape (n, COLUMNS): length [s]; rate command as value, slope and half the curvature
        from the step's start on [rad/s, rad/s^2, rad/s^3]; torque on the axis, value and slope [N
        m, N m/s]; voltage of a fixed bias source [V]; change of the number at `changing`, in its
        own unit
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


def run(record: np.ndarray[Any, np.dtype[Any]], schedule: Schedule, wiring: Wiring = DRIVE,
        channels: tuple[str, ...] = SIGNALS) -> FloatArray:
    """
    Run one variant of the drive through a test.

    record : of wiring.parameters, from `record_of`, shape (1,); left as it is
    schedule : of the test
    wiring : which units there are and what feeds them
    channels : the outputs to be read, and states of units; by default the readings of a field test

    Returns an array of shape (rows, len(channels), 2): value and time derivative of each reading,
    SI units, article amperes; of a state the value alone.

    Raises UserError: units feed each other in a loop without a state in it.
    """
    units = blocks(wiring)
    states = sum(block.count_states(record[0][name]) for name, block in units.items())
    out = np.empty((schedule.rows, len(channels), 2))
    numbers = record.view(np.float64).copy()
    record = numbers.view(record.dtype)
    kernel, inputs = _kernel(wiring, channels)
    kernel(record, numbers, schedule.changing, schedule.steps, schedule.keep, np.zeros(states),
           np.zeros(sum(len(block.modes) for block in units.values()), np.int64),
           tuple(np.zeros((count, 2)) for count in inputs), work_space(states),
           np.zeros((max(len(block.outputs) for block in units.values()), 2)), out)
    return out
