# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the drive's nodes that make a test sheet come true."""

from antenna_drive.diagnosis.sheet_settings import as_the_sheet_says
from antenna_drive.emulator.units import home
from antenna_drive.emulator.wiring import TEST_SIGNAL
from antenna_drive.parameters.sets import changed, Drive, values
from antenna_drive.recording.sheet import FixedBias, FixedStepBias, TestSheet
from antenna_drive.recording.sheet_signal import settings_for
from simgap.errors import UserError
from simgap.inputs.schema import Value


def parameters_of(sheet: TestSheet, drive: Drive) -> dict[str, dict[str, Value]]:
    """
    Return what to set on each node, by unit and name, so that the drive runs a test.

    Raises UserError: there is no waveform, or the bias is to step in the middle of the test.
    """
    if sheet.waveform is None:
        raise UserError('waveform: is missing, there is nothing to play')
    if isinstance(sheet.bias, FixedStepBias):
        raise UserError('bias: fixed_step: a node plays circuit or fixed; set fixed_voltage by '
                        'hand when it is time')
    tested, bias = as_the_sheet_says(sheet, drive)
    if isinstance(sheet.bias, FixedBias):
        tested = changed(tested, {'torque_share.circuit.fixed_voltage': bias.after})
    found: dict[str, dict[str, Value]] = {}
    for (path, _, before), (_, _, after) in zip(values(drive), values(tested), strict=True):
        if before != after:
            unit, name = home(path)
            found.setdefault(unit, {})[name] = after
    found.setdefault(TEST_SIGNAL, {}).update(settings_for(sheet.waveform))
    return found
