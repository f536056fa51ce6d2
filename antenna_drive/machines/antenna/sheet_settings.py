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
"""What a test sheet sets in the drive."""

from __future__ import annotations

from functools import cache
import math
from typing import Any

from antenna_drive.machines.antenna.excitation import Bias
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.recording import sheet as sheets

# The parameters that a sheet's name of a circuit sets.
_CIRCUITS = {'circuit': ('torque_share.circuit', ('k_2', 's_2', 'k_3', 'g_4')),
             'filter_1': ('torque_share.filter_1', ('gain', 'pole'))}


@cache
def constants(entry: str, value: str) -> dict[str, float]:
    """Return the numbers of the configuration that 'circuit' or 'filter_1' of a sheet sets."""
    part, numbers = _CIRCUITS[entry]
    source: Any = load(f'{value}_circuit')
    for step in part.split('.'):
        source = getattr(source, step)
    return {f'{part}.{key}': getattr(source, key) for key in numbers}


def as_the_sheet_says(sheet: sheets.TestSheet, drive: Drive) -> tuple[Drive, Bias]:
    """Return the drive and the source of bias of a test; as configured where a sheet is silent."""
    for word in _CIRCUITS:
        circuit = getattr(sheet, word)
        if circuit is not None:
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
