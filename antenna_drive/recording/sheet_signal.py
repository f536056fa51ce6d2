# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive's test signal for the waveform of a test sheet."""

import math
from pathlib import Path

from antenna_drive.parameters.sets import values
from antenna_drive.parameters.waveforms import Waveform
from antenna_drive.recording import sheet as sheets
from simgap.errors import UserError
from simgap.inputs.schema import Value

_DEGREE = math.pi / 180.0


def test_signal_of(waveform: sheets.Waveform) -> Waveform:
    """Return the drive's test signal that plays the waveform of a test sheet."""
    if isinstance(waveform, sheets.Knots):
        rates = waveform.rates_deg_s or (0.0,)
        greatest = max(map(abs, rates)) or 1.0
        return Waveform(waveform='knots', amplitude=greatest * _DEGREE,
                        knot_times=waveform.times_s or (0.0,),
                        knot_values=tuple(rate / greatest for rate in rates))
    amplitude = float(waveform.amplitude_deg_s or 0.0) * _DEGREE
    if isinstance(waveform, (sheets.Square, sheets.Triangle)):
        kind = 'square' if isinstance(waveform, sheets.Square) else 'saw_tooth'
        return Waveform(waveform=kind, amplitude=amplitude, period=waveform.period_s or 1.0,
                        phase=waveform.phase or 0.0)
    start = waveform.start_s or 0.0
    if isinstance(waveform, sheets.Multisine):
        return Waveform(waveform='multisine', amplitude=amplitude, start_after=start,
                        frequencies=waveform.frequencies_hz or (),
                        weights=waveform.weights or (), phases=waveform.phases or ())
    return Waveform(waveform='chirp', amplitude=amplitude, start_after=start,
                    sweep_from=waveform.f0_hz or 0.0, sweep_to=waveform.f1_hz or 0.0,
                    sweep_time=waveform.duration_s or 1.0)


def settings_for(waveform: sheets.Waveform) -> dict[str, Value]:
    """Return the settings of the node test_signal that play the waveform of a test sheet."""
    return {name: value for name, _, value in values(test_signal_of(waveform))
            # it is commanded from outside
            if name != 'external'}


def settings_of(path: Path) -> dict[str, Value]:
    """
    Return the settings that play the waveform of the test sheet in a file.

    The other entries of the sheet, such as the circuit, are for other nodes or for people.

    Raises UserError: the file cannot be read, an entry is not allowed, or it has no waveform.
    """
    waveform = sheets.load_sheet(path).waveform
    if waveform is None:
        raise UserError(f'{path}: waveform: is missing, so there is nothing to play')
    return settings_for(waveform)
