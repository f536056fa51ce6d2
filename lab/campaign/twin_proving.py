# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a twin says of a simulated test, played to it in simulated time.

The core has no clock of its own, so an hour is played as fast as the computer goes. What it says
is what it would have said in real time.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters.loading import load
from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.recording import Recording, unit_of
from antenna_drive.recording.sheet import parse_sheet
from antenna_drive.twin.growing import diagnosed, look_of
from antenna_drive.twin.sequential import decided, Look, Rule
from antenna_drive.twin.tuned import tuned
from antenna_drive.twin.watch import GAP, Twin, TwinSettings
import numpy as np
from simgap.logs.channel import make_channel, NANOSECONDS

# So much arrives between two looks of the twin [s].
PIECE_S = 0.1


def recording_of(columns: Mapping[str, FloatArray], sheet: Mapping[str, Any]) -> Recording:
    """
    Return a field test that was simulated, as a recording.

    columns : by name, NaN where there is no sample
    sheet : plain data of the test sheet
    """
    stamps = np.round(columns['time_s'] * NANOSECONDS).astype(np.int64)
    channels = {}
    for name, values in columns.items():
        if name in FIELD_COLUMNS:
            there = np.isfinite(values)
            channels[FIELD_COLUMNS[name]] = make_channel(
                name, unit_of(FIELD_COLUMNS[name]) or '1', stamps[there], values[there])
    return Recording(channels, sheet=parse_sheet(sheet))


def played(twin: Twin, columns: Mapping[str, FloatArray]) -> Iterator[float]:
    """
    Give a recording to a twin piece by piece; yield the time of the last sample after each [s].

    twin : to be advanced
    columns : of a field test, by name; NaN where there is no sample
    """
    time = columns['time_s']
    stamps = np.round(time * NANOSECONDS).astype(np.int64).tolist()
    signals = [(FIELD_COLUMNS[name], values.tolist()) for name, values in columns.items()
               if name in FIELD_COLUMNS]
    edges = np.searchsorted(time, np.arange(0.0, time[-1] + PIECE_S, PIECE_S)[1:])
    first = 0
    for last in edges.tolist():
        for k in range(first, last):
            for name, values in signals:
                twin.put(name, stamps[k], values[k])
        twin.advance()
        if last > first:
            yield float(time[last - 1])
        first = last


def watched(columns: Mapping[str, FloatArray], sheet: Mapping[str, Any], onset_s: float,
            settings: TwinSettings | None = None) -> dict[str, Any]:
    """
    Return what a twin says of a test in which an effect is switched on.

    columns : of the recording
    sheet : plain data of the test sheet
    onset_s : when the effect is switched on; the end of the test if it never is [s]
    settings : of the twin

    Returns `alarms` before the onset: time [s] and signals of each; `told_after_s`: time from the
    onset to the first sign of a gap, None if there is none; `since_s`: the beginning that the twin
    states, after the onset [s]; `gaps`: what it says; `tuning`; blocks `judged` and `unjudged`.
    """
    twin = Twin(load(), parse_sheet(sheet), settings, tune=tuned)
    alarms: list[dict[str, Any]] = []
    told: dict[str, Any] = {'told_after_s': None, 'since_s': None, 'gaps': []}
    before = ''
    for time in played(twin, columns):
        if twin.state == GAP and before != GAP:
            gaps = twin.gaps()
            if time < onset_s:
                alarms.append({'time_s': time, 'gaps': list(map(str, gaps))})
            else:
                told = {'told_after_s': time - onset_s, 'gaps': list(map(str, gaps)),
                        'since_s': min(gap.since_ns for gap in gaps) / NANOSECONDS - onset_s}
                break
        before = twin.state
    return {'alarms': alarms, **told, 'tuning': twin.tuned,
            'judged': twin.judge.blocks - twin.judge.unjudged, 'unjudged': twin.judge.unjudged}


def grown(tests: Sequence[Recording], lengths_s: Sequence[float], looks_s: Sequence[float],
          rule: Rule = Rule()) -> tuple[float | None, list[tuple[Look, dict[str, Any]]]]:
    """
    Return what looks at tests tell while they are made, one after the other.

    tests, lengths_s : the recordings, and how long each of them is [s]
    looks_s : when to look [s of testing]; once the rule has stopped, only the last look is made
    rule : when to stop

    Returns when the rule stopped, None if it did not; and each look with the result of its
    diagnosis.
    """
    drive, found, stopped = load(), [], None
    for seconds in looks_s:
        if stopped is not None and seconds < looks_s[-1]:
            continue
        there, lengths, left = {}, [], seconds
        for number, (test, length) in enumerate(zip(tests, lengths_s, strict=True), 1):
            if left > 0.0:
                lengths.append(min(left, length))
                # the last sample is within, whatever its time is rounded to
                there[f'test {number}'] = test.between(0.0, lengths[-1] + 1e-6)
            left -= length
        result = diagnosed(there, drive)
        found.append((look_of(result, lengths), result))
        if stopped is None and decided([look for look, _ in found], rule):
            stopped = seconds
    return stopped, found
