# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a test sheet does not say and the recordings tell: the circuit, Filter 1 and the bias.

The bias voltage tells its source and the circuit, see `bias_inference`. Filter 1 shows in the
difference of the currents; the whole drive is simulated with either. A value that the sheet gives
is never overruled. A note says what was inferred, and by how much the next best value is worse.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from antenna_drive.diagnosis.bias_inference import (
    CURRENTS, of_table, told, with_circuit, with_entries, with_sources,
)
from antenna_drive.diagnosis.excitation import Longest, schedule
from antenna_drive.diagnosis.field_recording import FieldRecording, Note
from antenna_drive.diagnosis.sheet_settings import as_the_sheet_says
from antenna_drive.diagnosis.windows import first_window
from antenna_drive.emulator import batch
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import AT
from antenna_drive.recording.sheet import FixedStepBias
import numpy as np

# The drive is simulated for this long after its motion begins or the bias steps [s].
_SIMULATED_S, _STEP_S = 15.0, 5.3e-3
# A smaller misfit is noise and tells nothing.
_NOISE_A = 0.02


def completed(recordings: Sequence[FieldRecording], drive: Drive,
              note: Note) -> list[FieldRecording]:
    """
    Return recordings of one machine with what their sheets lack, as far as they tell it.

    `note` is called with what was inferred, is as configured, or contradicts a sheet.
    """
    found = list(recordings)
    if not any(recording.is_planned for recording in recordings):
        for infer in (with_sources, with_circuit, _with_filter_1):
            found = infer(found, drive, note)
    for recording in found:
        for entry in ('circuit', 'filter_1', 'bias'):
            if getattr(recording.sheet, entry) is None:
                note(f'{recording.name}: the sheet does not give {entry}: as configured')
    return found


def _with_filter_1(recordings: list[FieldRecording], drive: Drive,
                   note: Note) -> list[FieldRecording]:
    """Return recordings whose sheets give Filter 1."""
    compared = [recording for recording in recordings if recording.readings.keys() & set(CURRENTS)]
    if not compared:
        return recordings

    @cache
    def misfit(name: str | None) -> float:
        return _NOISE_A + float(np.mean([_misfit_of_currents(
            with_entries(recording, filter_1=name or recording.sheet.filter_1), drive)
            for recording in compared]))

    circuits = {recording.sheet.circuit for recording in recordings} - {None}
    named = told('filter_1', misfit, {recording.sheet.filter_1 for recording in recordings} - {
        None}, drive, note, 'the currents look', 'as the circuit' if circuits else 'as configured')
    if named == '' and circuits:
        named = circuits.pop()
    if not named:
        return recordings
    # both are of Table 1, and were changed together
    circuit = named if of_table('circuit', drive) else None
    return [with_entries(recording, filter_1=recording.sheet.filter_1 or named,
                         circuit=recording.sheet.circuit or circuit) for recording in recordings]


def _misfit_of_currents(recording: FieldRecording, drive: Drive) -> float:
    """Return by how much the difference of the currents is off [article A], in the mean."""
    drive, bias = as_the_sheet_says(recording.sheet, drive)
    first = first_window(recording)
    end = first.compared
    if isinstance(recording.sheet.bias, FixedStepBias):
        end = max(end, bias.at)
    time = recording.thinned(first.compared, end + _SIMULATED_S)
    plan = schedule(recording.command_between(first.begin, first.compared, float(time[-1])),
                    replace(bias, at=bias.at - first.begin), time - first.begin, Longest(_STEP_S))
    off = recording.measured(time)[0] - batch.run(record_of(drive), plan)[:, :, 0]
    off = off[:, [AT[name] for name in CURRENTS]]
    if np.isfinite(off).any(axis=0).all():
        off = np.diff(off, axis=1)
    return float(np.nanmean(np.abs(off)))
