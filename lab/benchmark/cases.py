# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The cases of the benchmark: those of the joints' trial, with MuJoCo for the machine.

On top of a recorder's imperfections come what days bring: friction that differs a little from test
to test, wind, and a filter in the logger. A fourth test is kept back; its command is in the case.
"""

import json
from pathlib import Path

from lab.antenna.cases import Truth
from lab.antenna.imperfections import coloured
from lab.benchmark.mjcf import mjcf, Numbers
from lab.benchmark.running import simulate
from lab.joints import cases as joints
from lab.joints.machines import BENCHMARK, Kind, kind_of
from lab.joints.mechanism import FloatArray, TICK_S
from lab.joints.programme import draw_tests, reference, ticks_of
import numpy as np
from scipy.signal import lfilter

TESTS = 4               # three to diagnose, one kept back
COMMAND = 'command_d.csv'
SHEET = 'sheet.json'
WIND_HZ = 0.5
# Set apart from every sealed set: the seeds of practice begin here.
PRACTICE = 1_000_000_000


def draw_truths(count: int, seed: int, machines: list[str]) -> list[Truth]:
    """Draw all cases; machines, of BENCHMARK, take turns within each kind."""
    truths = joints.draw_truths(count, seed, machines)
    for number, truth in enumerate(truths, 1):
        random, table = np.random.default_rng([seed, number, 1]), kind_of(truth['machine']).table
        more = draw_tests(table, random)
        truth['tests'].append(more[int(random.integers(len(more)))])
        flaws = table['nuisances']
        truth['nuisances'] = {
            **{name: [1.0 + float(random.uniform(-flaws[name], flaws[name]))
                      for _ in range(TESTS)] for name in ('coulomb', 'viscous')},
            'wind': float(random.uniform(0.0, flaws['wind'])),
            'filter': float(random.uniform(0.0, flaws['filter']))}
    return truths


def asked_at_ticks(asked: FloatArray, ticks: int, begin: int) -> FloatArray:
    """
    Return what the controller is asked for at each tick, shape (begin + (n - 1) ticks + 1,).

    The bus sends `asked`, shape (n,), every `ticks`; the first holds for `begin` ticks before.
    """
    moments = np.arange((asked.size - 1) * ticks + 1)
    late = np.maximum((moments - 1) // ticks, 0)
    first = asked[np.maximum(late - 1, 0)]
    found = first + (asked[late] - first) * (moments - late * ticks) / ticks
    found[0] = asked[0]
    return np.concatenate([np.full(begin, asked[0]), found])


def moved(truth: Truth, recording: int, start: float) -> joints.Moved:
    """Simulate one test (from 0) of a case, as `lab.joints.cases.moved` does."""
    kind, test = kind_of(truth['machine']), truth['tests'][recording]
    numbers = kind.numbers(truth['deviations'], truth['effects'], test['duration_s'])
    flaws = truth['nuisances']
    for name in ('coulomb', 'viscous'):
        numbers[name] *= flaws[name][recording]
    return _run(kind, numbers, truth, recording, start, flaws['wind'], flaws['filter'])


def base_prediction(truth: Truth, recording: int) -> dict[str, FloatArray]:
    """Return what the data sheet's machine would read in a test, by column, shape (n,) each."""
    kind = kind_of(truth['machine'])
    times, _, history = _run(kind, kind.numbers({}, [], 1.0), truth, recording, 0.0, 0.0, 0.0)
    ticks = ticks_of(truth['sample_rate_hz'])
    return {'time_s': times, **{kind.columns[name]: values[::ticks]
                                for name, values in history.items()}}


def _run(kind: Kind, numbers: Numbers, truth: Truth, recording: int, start: float, wind: float,
         smooth: float) -> joints.Moved:
    test, rate = truth['tests'][recording], truth['sample_rate_hz']
    times = np.arange(int(round(rate * test['duration_s'])) + 1) / rate
    asked, begin = reference(test, times), round(joints.BEFORE_S / TICK_S)
    at_ticks = asked_at_ticks(asked, ticks_of(rate), begin)
    random = np.random.default_rng([*truth['seed'], 100 + recording])
    blows = wind * coloured(at_ticks.size, 1.0 / TICK_S, 1.0, WIND_HZ, random)
    history = simulate(BENCHMARK[kind.name], numbers, at_ticks, float(asked[0] + start), begin,
                       blows)
    if smooth > 0.0:
        keep = float(np.exp(-TICK_S / smooth))
        for name in history.keys() - {'position'}:
            history[name] = lfilter([1.0 - keep], [1.0, -keep], history[name])
    return times, asked, history


def make_recording(truth: Truth, recording: int) -> dict[str, FloatArray]:
    """Return the columns of one recording of a case (from 0) by name, each of shape (n,)."""
    kind, columns = kind_of(truth['machine']), joints.make_recording(truth, recording, moved)
    for name, digit in kind.table['digits'].items():
        column = kind.columns[name]
        columns[column] = digit * np.round(columns[column] / digit)
    return columns


def write_task(folder: Path, truth: Truth) -> None:
    """Write what a case has beside its recordings: data sheet, base model, command kept back."""
    kind, rate = kind_of(truth['machine']), truth['sample_rate_hz']
    sheet = {'machine': (name := BENCHMARK[kind.name]), 'sample_rate_hz': rate,
             'effects': sorted(kind.catalogue), **{key: kind.table[key] for key in (
                 'columns', 'nominal', 'tolerances', 'noise', 'digits', 'zero', 'gain')}}
    (folder / SHEET).write_text(json.dumps(sheet, indent=1) + '\n', encoding='utf-8')
    (folder / f'{name}.xml').write_text(mjcf(name, kind.table['nominal']), encoding='utf-8')
    test = truth['tests'][-1]
    times = np.arange(int(round(rate * test['duration_s'])) + 1) / rate
    rows = np.column_stack([times, reference(test, times)])
    np.savetxt(folder / COMMAND, rows, '%.9g', ',', comments='',
               header=f'time_s,{kind.columns["reference"]}')
