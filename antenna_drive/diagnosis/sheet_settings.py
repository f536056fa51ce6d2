# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a test sheet sets in the drive, or in its nodes: circuits of Table 1, elevation, bias."""

from functools import cache
import math
from operator import attrgetter
from typing import Any

from antenna_drive.diagnosis.excitation import Bias
from antenna_drive.emulator.units import home
from antenna_drive.emulator.wiring import TEST_SIGNAL
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import changed, Drive, values
from antenna_drive.recording import sheet as sheets
from antenna_drive.recording.sheet_signal import settings_for
from simgap.errors import UserError
from simgap.inputs.schema import Value

CIRCUITS = ('new', 'old')
# The numbers that a test sheet's name of a circuit stands for.
_NUMBERS = {'circuit': ('torque_share.circuit', ('k_2', 's_2', 'k_3', 'g_4')),
            'filter_1': ('torque_share.filter_1', ('gain', 'pole'))}


@cache
def constants(entry: str, name: str) -> dict[str, float]:
    """Return the numbers that 'circuit' or 'filter_1' of a sheet stands for, by dotted name."""
    return _numbers(load(f'{name}_circuit'), entry)


def nearest_circuit(drive: Drive, entry: str) -> str:
    """Return the named circuit whose numbers are nearest to those of a drive."""
    here = _numbers(drive, entry)

    def distance(name: str) -> float:
        there = constants(entry, name)
        ratios = [here[path] / there[path] for path in here]
        return sum(abs(math.log(ratio)) if ratio > 0.0 else math.inf for ratio in ratios)

    return min(CIRCUITS, key=distance)


def _numbers(drive: Drive, entry: str) -> dict[str, float]:
    part, keys = _NUMBERS[entry]
    return {path: float(attrgetter(path)(drive)) for path in (f'{part}.{key}' for key in keys)}


def as_the_sheet_says(sheet: sheets.TestSheet, drive: Drive) -> tuple[Drive, Bias]:
    """Return the drive and the source of bias of a test; as configured where a sheet is silent."""
    changes: dict[str, Any] = {}
    for entry in _NUMBERS:
        circuit = getattr(sheet, entry)
        # a corrected configuration has numbers of its own near those of the circuit
        if circuit is not None and nearest_circuit(drive, entry) != circuit:
            changes |= constants(entry, circuit)
    if sheet.elevation_deg is not None:
        changes['plant.axis.start_elevation'] = math.radians(sheet.elevation_deg)
    share, given = 'torque_share.circuit', sheet.bias
    if isinstance(given, sheets.CircuitBias):
        said = {'bias_source': 'circuit', 'bias_pot': given.bias_pot, 'start': given.start}
        changes |= {f'{share}.{name}': value for name, value in said.items() if value is not None}
        return changed(drive, changes), Bias()
    if given is None:
        voltage = drive.torque_share.circuit.fixed_voltage
        return changed(drive, changes), Bias(voltage, voltage)
    voltage = given.voltage_V or 0.0
    source = (Bias(0.0, voltage, given.at_s or 0.0) if isinstance(given, sheets.FixedStepBias)
              else Bias(voltage, voltage))
    return changed(drive, {**changes, f'{share}.bias_source': 'fixed'}), source


def parameters_of(sheet: sheets.TestSheet, drive: Drive) -> dict[str, dict[str, Value]]:
    """
    Return what to set on each node, by unit and name, so that the drive runs a test.

    Raises UserError: there is no waveform, or the bias is to step in the middle of the test.
    """
    if sheet.waveform is None:
        raise UserError('waveform: is missing, there is nothing to play')
    if isinstance(sheet.bias, sheets.FixedStepBias):
        raise UserError('bias: fixed_step: a node plays circuit or fixed; set fixed_voltage by '
                        'hand when it is time')
    tested, bias = as_the_sheet_says(sheet, drive)
    if isinstance(sheet.bias, sheets.FixedBias):
        tested = changed(tested, {'torque_share.circuit.fixed_voltage': bias.after})
    found: dict[str, dict[str, Value]] = {}
    for (path, _, before), (_, _, after) in zip(values(drive), values(tested), strict=True):
        if before != after:
            unit, name = home(path)
            found.setdefault(unit, {})[name] = after
    found.setdefault(TEST_SIGNAL, {}).update(settings_for(sheet.waveform))
    return found
