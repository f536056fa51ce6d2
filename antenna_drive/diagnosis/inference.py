# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a test sheet does not say and the recordings tell: the circuit, Filter 1 and the bias.

The bias voltage tells its source and the circuit, see `bias_inference`. Filter 1 shows in the
difference of the currents; the whole drive is simulated with either. A value that the sheet gives
is never overruled. A note says what was inferred, and by how much the next best value is worse.
"""

from __future__ import annotations

from collections.abc import Sequence

from antenna_drive.diagnosis.bias_inference import (
    CIRCUITS, CLEAR, CURRENTS, DOUBT, of_table, with_circuit, with_entries, with_sources,
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

    recordings : to be completed
    drive : the configuration, which holds for what cannot be inferred
    note : called with what was inferred, what is as configured, and what contradicts a sheet
    """
    if any(recording.is_planned for recording in recordings):
        for recording in recordings:
            _note_silence(recording, note)
        return list(recordings)
    found = with_sources(list(recordings), drive, note)
    found = with_circuit(found, drive, note)
    found = _with_filter_1(found, drive, note)
    for recording in found:
        _note_silence(recording, note)
    return found


def _note_silence(recording: FieldRecording, note: Note) -> None:
    for entry in ('circuit', 'filter_1', 'bias'):
        if getattr(recording.sheet, entry) is None:
            note(f'{recording.name}: the sheet does not give {entry}: as configured')


def _with_filter_1(recordings: list[FieldRecording], drive: Drive,
                   note: Note) -> list[FieldRecording]:
    """Return recordings whose sheets give Filter 1."""
    compared = [recording for recording in recordings
                if recording.readings.keys() & set(CURRENTS)]
    if not compared:
        return recordings

    def misfit(**entries: str) -> float:
        return _NOISE_A + float(np.mean([
            _misfit_of_currents(with_entries(recording, **entries), drive)
            for recording in compared]))

    misfits = {name: misfit(filter_1=name) for name in CIRCUITS}
    best, other = sorted(CIRCUITS, key=lambda name: misfits[name])
    worse = misfits[other] / misfits[best]
    given = {recording.sheet.filter_1 for recording in recordings} - {None}
    if not given and not of_table('filter_1', drive) and misfit() <= CLEAR * misfits[best]:
        note('filter_1: the configured constants fit as well: as configured')
        return recordings
    if given:
        if given == {other} and worse > DOUBT:
            note(f'the sheets give filter_1 {other}, the currents look like {best} ({other} fits '
                 f'{worse:.1f} times worse); the sheets are believed')
        best = str(given.pop())
    elif worse < CLEAR:
        known = {recording.sheet.circuit for recording in recordings} - {None}
        note(f'filter_1: {other} fits {worse:.2f} times worse than {best}, which tells nothing; '
             f"{'as the circuit' if known else 'as configured'}, unless a sheet says "
             f"'filter_1: {best}' or 'filter_1: {other}'")
        if not known:
            return recordings
        best = str(known.pop())
    else:
        note(f'filter_1 {best}: inferred, {other} fits {worse:.1f} times worse')
    # both are of Table 1, and were changed together
    circuit = best if of_table('circuit', drive) else None
    return [with_entries(recording, filter_1=recording.sheet.filter_1 or best,
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
                    bias.later(first.begin), time - first.begin, Longest(_STEP_S))
    off = recording.measured(time)[0] - batch.run(record_of(drive), plan)[:, :, 0]
    off = off[:, [AT[name] for name in CURRENTS]]
    if np.isfinite(off).any(axis=0).all():
        off = np.diff(off, axis=1)
    return float(np.nanmean(np.abs(off)))
