# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a test sheet sets in the drive."""

from __future__ import annotations

import math
from typing import Any

from antenna_drive.diagnosis.circuits import CIRCUITS, constants, nearest_circuit
from antenna_drive.diagnosis.excitation import Bias
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.recording import sheet as sheets

# The parameters that a sheet's name of a circuit sets.


def as_the_sheet_says(sheet: sheets.TestSheet, drive: Drive) -> tuple[Drive, Bias]:
    """Return the drive and the source of bias of a test; as configured where a sheet is silent."""
    for word in CIRCUITS:
        circuit = getattr(sheet, word)
        # a corrected configuration has numbers of its own near those of the circuit
        if circuit is not None and nearest_circuit(drive, word) != circuit:
            drive = changed(drive, constants(word, circuit))
    if sheet.elevation_deg is not None:
        drive = changed(drive, {'plant.axis.start_elevation': math.radians(sheet.elevation_deg)})
    share = 'torque_share.circuit.'
    given = sheet.bias
    if isinstance(given, sheets.CircuitBias):
        changes: dict[str, Any] = {f'{share}bias_source': 'circuit'}
        if given.bias_pot is not None:
            changes[f'{share}bias_pot'] = given.bias_pot
        if given.start is not None:
            changes[f'{share}start'] = given.start
        return changed(drive, changes), Bias()
    if given is None:
        voltage = drive.torque_share.circuit.fixed_voltage
        return drive, Bias(voltage, voltage)
    voltage = given.voltage_V or 0.0
    drive = changed(drive, {f'{share}bias_source': 'fixed'})
    if isinstance(given, sheets.FixedStepBias):
        return drive, Bias(0.0, voltage, given.at_s or 0.0)
    return drive, Bias(voltage, voltage)
