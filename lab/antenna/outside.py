# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Effects outside the catalogue, which a diagnosis must answer with 'unknown'.

Even at its smallest size each leaves a gap that the tolerances cannot explain.
"""

from lab.antenna.effect import defects, Parameters
from lab.antenna.machine import DROPOUTS, Records
from lab.antenna.table import read_table
import numpy as np


def _which(values: Parameters) -> int:
    return int(values['motor']) - 1


def _dropouts(machine: Records, values: Parameters) -> None:
    random = np.random.default_rng(int(values['seed']))
    which = _which(values)
    machine.motors['dropout_length'][which] = values['length']
    slots = 1.0 + (28.0 / DROPOUTS) * (np.arange(DROPOUTS) + random.uniform(0.0, 0.8, DROPOUTS))
    machine.motors['dropout'][which] = slots


def _brake(machine: Records, values: Parameters) -> None:
    which = _which(values)
    machine.motors['brake'][which] = values['torque']
    machine.motors['brake_start'][which] = values['start']
    machine.motors['brake_end'][which] = values['start'] + values['length']


def _warm_motor(machine: Records, values: Parameters) -> None:
    which = _which(values)
    machine.motors['warm_torque'][which] = values['torque_loss']
    machine.motors['warm_resistance'][which] = 2.0 * values['torque_loss']
    machine.motors['warming_time'][which] = values['time']


OUTSIDE = defects(read_table('outside.yaml'), {
    'outside.warming_motor': _warm_motor,
    'outside.tach_dropouts': _dropouts,
    'outside.dragging_brake': _brake})
