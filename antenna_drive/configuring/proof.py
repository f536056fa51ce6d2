# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a configured drive gives the figures of its sheet back, each from a run of its own."""

import math
from typing import NamedTuple

from antenna_drive.article.readings import step_response
from antenna_drive.configuring.derived import kappa
from antenna_drive.configuring.sheet import Sheet
from antenna_drive.emulator.run import Run, simulate
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.readings import of, TACHOMETER
import numpy as np

# A figure is given back if it is this close.
_SHARE = 0.05
_DURATION_S, _MEAN_OVER_S = 30.0, 20.0
_STEP_AT_S = 1.0
_MOTOR_RATE = of(TACHOMETER)[0].signal


class Check(NamedTuple):
    """A figure of the sheet and what the configured drive gives; None where nothing is given."""

    what: str
    unit: str
    wanted: float | None
    obtained: float

    @property
    def holds(self) -> bool:
        """Return whether the drive gives the figure back."""
        if self.wanted is None:
            return math.isfinite(self.obtained)
        return abs(self.obtained - self.wanted) <= _SHARE * abs(self.wanted)


def checks(sheet: Sheet, drive: Drive) -> list[Check]:
    """Run the drive and return what it gives beside the sheet."""
    found = []
    for name in ('slow', 'fast'):
        rate, wanted = sheet[f'friction.{name}_rate'], sheet[f'friction.{name}_current']
        run = _at_rate(drive, rate, _DURATION_S)
        after = run.time > _DURATION_S - _MEAN_OVER_S
        current = float(np.mean((run['motor_1/current'] + run['motor_2/current'])[after]))
        found.append(Check(f'current at {math.degrees(rate):g} deg/s, both motors', 'real A',
                           wanted, kappa(sheet) * current))
    standing = simulate(drive, _DURATION_S)
    difference = standing['motor_2/current'] - standing['motor_1/current']
    response = step_response(standing.time, difference)
    limit = drive.motor_1.motor.current_limit
    found.append(Check('bias at standstill', 'percent', 100.0 * sheet['bias.share'],
                       100.0 * response.final / limit))
    found.append(Check('settling time of the bias', 's', None, response.settling_s))
    rate = sheet['friction.fast_rate']
    run = _at_rate(drive, rate, 6.0 + _STEP_AT_S)
    kept = run.time >= _STEP_AT_S
    moved = step_response(run.time[kept] - _STEP_AT_S, run[_MOTOR_RATE][kept])
    found.append(Check(f'overshoot of the motor rate, step of {math.degrees(rate):g} deg/s',
                       'percent', None, 100.0 * moved.overshoot))
    return found


def _at_rate(drive: Drive, rate: float, duration_s: float) -> Run:
    """Return a run with a step of the rate command [rad/s]."""
    command = 'test_signal.rate.'
    return simulate(changed(drive, {
        f'{command}waveform': 'step', f'{command}amplitude': rate,
        f'{command}start_after': _STEP_AT_S}), duration_s)
