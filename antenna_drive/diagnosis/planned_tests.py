# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Planned tests: the built-in ones, and which effects a set of tests can tell apart."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from antenna_drive.diagnosis.excitation import SheetCommand
from antenna_drive.diagnosis.field_recording import PLANNED
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import (
    Chirp, CircuitBias, Multisine, Square, TestSheet, Triangle,
)
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order
from simgap.machine.process import with_process
from simgap.next_test.confusability import Confusability, confusability

BUILT_IN: Mapping[str, TestSheet] = {
    name: TestSheet(bias=CircuitBias(start='steady'), waveform=waveform, start='rest',
                    elevation_deg=elevation, parameter_tolerance=0.02)
    for name, elevation, waveform in (
        ('square', 45.0, Square(amplitude_deg_s=0.05, period_s=6.3, phase=0.25)),
        ('triangle', 30.0, Triangle(amplitude_deg_s=0.5, period_s=6.0, phase=0.0)),
        ('multisine', 60.0, Multisine(
            amplitude_deg_s=0.1, frequencies_hz=(0.2, 0.5, 0.9, 1.7, 3.1, 5.3),
            weights=(0.5, 0.4, 0.3, 0.2, 0.15, 0.1), phases=(0.0, 1.0, 2.0, 3.0, 4.0, 5.0),
            start_s=1.0)),
        ('chirp', 60.0, Chirp(
            amplitude_deg_s=0.06, f0_hz=0.1, f1_hz=8.0, duration_s=28.0, start_s=1.0)),
    )
}


def planned(sheet: TestSheet, duration: float, rate: float) -> Recording:
    """Return a planned test as a recording: its command, and readings of zero."""
    time = np.arange(int(duration * rate) + 1) / rate
    command = SheetCommand(sheet.waveform or Square(0.05, 6.3, 0.25))
    signals = {RATE_COMMAND: command(time), **{name: np.zeros(time.size) for name in SIGNALS}}
    return Recording.from_arrays(time, signals, sheet=sheet, notes={PLANNED: True})


def confusability_of(tests: Mapping[str, Recording], drive: Drive,
                     progress: Callable[[float], None] = lambda share: None,
                     threads: int = 2) -> Confusability:
    """Say which effects these tests, planned or made ones by name, can tell apart."""
    machine = AntennaMachine(tests, drive, threads)
    return confusability(with_process(machine.with_experiments([
        replace(e, measured=machine.predict({}, k))
        for k, e in enumerate(machine.experiments)])), progress)


def passing_for(found: Confusability, index: int, most: int) -> list[str]:
    """Return the effects that pass for one of them, the most alike first."""
    return [found.effects[j] for j in np.argsort(-found.alike[index])
            if j != index and found.alike[index, j] > found.limit][:most]


def groups(found: Confusability) -> list[list[str]]:
    """Return the groups of effects that pass for each other."""
    near, left, named = csr_array(found.alike > found.limit), list(range(len(found.effects))), []
    while left:
        group = breadth_first_order(near, left[0], return_predecessors=False).tolist()
        left = [j for j in left if j not in group]
        if len(group) > 1:
            named.append([found.effects[j] for j in group])
    return named


def separated(found: Confusability) -> float:
    """Return the share of all pairs of effects that can be distinguished."""
    pairs = found.alike[np.triu_indices(len(found.effects), 1)]
    return float(np.mean(pairs < found.limit)) if pairs.size else 1.0
