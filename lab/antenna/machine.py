# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
One antenna as records, described in machine.yaml: all constants and imperfections.

An imperfection is absent at zero; only effects set one.
"""

import math
from typing import Any, NamedTuple

from lab.antenna.table import read_table
import numpy as np
from numpy.typing import NDArray

GUST_WAVES = 24
DROPOUTS = 8

# The laws by which effects act: those of effects.py, or those of family_b.py.
LAW_A, LAW_B = 0.0, 1.0

# Fields that are arrays.
_SHAPES = {
    'dropout': (DROPOUTS,), 'mode_inertia': (3,), 'mode_frequency': (3,), 'mode_damping': (3,),
    'gust': (GUST_WAVES,), 'gust_frequency': (GUST_WAVES,), 'gust_phase': (GUST_WAVES,)}
_TABLE = read_table('machine.yaml')
SHARE: dict[str, dict[str, float]] = _TABLE['share']
FILTER_1: dict[str, dict[str, float]] = _TABLE['filter_1']
DESIGN: dict[str, Any] = {name: entry['value'] for name, entry in _TABLE['design'].items()}


def nominal(record: str, field: str) -> float:
    """Return the value of a field in the reference drive, 0 for an imperfection."""
    value: float = _TABLE[record][field].get('value', 0.0)
    return value


def _nominal_record(name: str) -> NDArray[Any]:
    """Return a record with the values of the table, shape (1,)."""
    record = np.zeros(1, [(field, np.float64, _SHAPES.get(field, ())) for field in _TABLE[name]])
    for field in _TABLE[name]:
        record[field] = nominal(name, field)
    return record


class Records(NamedTuple):
    """The records of one antenna: arrays of records, changed in place while it is built."""

    motors: NDArray[Any]        # shape (2,)
    structure: NDArray[Any]     # shape (1,)
    circuit: NDArray[Any]       # shape (1,)
    sensors: NDArray[Any]       # shape (1,)


# Constants with a manufacturing tolerance. A gear ratio is a ratio of tooth counts and has none.
TOLERANCED_MOTOR = (
    'rate_gain', 'integral_time', 'lag', 'current_limit', 'tach_gain', 'feedback_gain',
    'voltage_limit', 'resistance', 'inductance', 'torque_constant', 'inertia', 'coulomb',
    'stiction_ratio', 'stiffness', 'half_gap', 'contact_damping')
TOLERANCED_STRUCTURE = (
    'inertia', 'coulomb', 'stiction_ratio', 'mode_inertia', 'mode_frequency', 'mode_damping')
TOLERANCED_CIRCUIT = tuple(_TABLE['circuit'])[:-1]


def reference_machine(circuit: str = 'old', filter_1: str = 'old',
                      bias_pot: float = DESIGN['bias_pot']) -> Records:
    """
    Build the reference drive without any imperfection, with k_p = `bias_pot`.

    The share circuit and Filter 1 are those of Table 1, 'old' or 'new'.
    """
    machine = Records(np.repeat(_nominal_record('motors'), 2), _nominal_record('structure'),
                      _nominal_record('circuit'), _nominal_record('sensors'))
    _build_motors(machine.motors)
    _build_structure(machine.structure[0])
    _build_circuit(machine.circuit[0], circuit, filter_1, bias_pot)
    return machine


def _build_motors(motors: NDArray[Any]) -> None:
    scale = nominal('motors', 'ampere_scale')
    feedback_gain, back_emf = DESIGN['current_feedback_gain'], DESIGN['back_emf']
    built_resistance = nominal('motors', 'resistance') + feedback_gain
    motors['side'] = (-1.0, 1.0)
    motors['loop_gain'] = scale * built_resistance
    motors['feedback_gain'] = scale * feedback_gain
    motors['clamp_slope'] = back_emf / scale / built_resistance
    motors['back_emf'] = back_emf / scale
    motors['coulomb'] = DESIGN['motor_coulomb'] * nominal('motors', 'torque_constant')


def _build_structure(structure: Any) -> None:
    structure['coulomb'] = (DESIGN['axis_coulomb'] * nominal('motors', 'torque_constant')
                            * nominal('structure', 'gear_ratio'))
    structure['mode_inertia'] = DESIGN['mode_inertia']
    structure['mode_frequency'] = [2.0 * math.pi * f for f in DESIGN['mode_frequency']]


def _build_circuit(record: Any, circuit: str, filter_1: str, bias_pot: float) -> None:
    record['command_gain'] = DESIGN['command_scale'] * DESIGN['command_gain']
    for name, value in SHARE[circuit].items():
        record[name] = value
    record['bias_pot'] = bias_pot
    record['filter_gain'] = FILTER_1[filter_1]['gain']
    record['filter_pole'] = FILTER_1[filter_1]['pole']


class ToleranceFactors(NamedTuple):
    """Factors near 1 for all toleranced constants, in a fixed order."""

    motors: NDArray[np.float64]         # shape (2, len(TOLERANCED_MOTOR))
    structure: NDArray[np.float64]      # shape (n,), modes one by one
    circuit: NDArray[np.float64]        # shape (len(TOLERANCED_CIRCUIT),)


def draw_tolerances(tolerance: float, random: np.random.Generator) -> ToleranceFactors:
    """Draw one antenna's relative deviations from the reference, uniform within +-tolerance."""
    def factors(*shape: int) -> NDArray[np.float64]:
        return 1.0 + tolerance * random.uniform(-1.0, 1.0, shape)

    width = sum(_width(name) for name in TOLERANCED_STRUCTURE)
    return ToleranceFactors(factors(2, len(TOLERANCED_MOTOR)), factors(width),
                            factors(len(TOLERANCED_CIRCUIT)))


def _width(field: str) -> int:
    return math.prod(_SHAPES.get(field, ()))


def apply_tolerances(machine: Records, tolerances: ToleranceFactors) -> None:
    """Multiply every toleranced constant of the machine by its factor."""
    for column, name in enumerate(TOLERANCED_MOTOR):
        machine.motors[name] *= tolerances.motors[:, column]
    # A stronger magnet raises torque and back-EMF together.
    strength = tolerances.motors[:, TOLERANCED_MOTOR.index('torque_constant')]
    machine.motors['back_emf'] *= strength
    at = 0
    for name in TOLERANCED_STRUCTURE:
        width = _width(name)
        factor = tolerances.structure[at:at + width]
        machine.structure[name] *= factor if width > 1 else factor[0]
        at += width
    for column, name in enumerate(TOLERANCED_CIRCUIT):
        machine.circuit[name] *= tolerances.circuit[column]
