# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The cases of a trial of joints and axes, drawn once and recorded.

A case follows entirely from its truth, including the noise. Each is drawn as a wild case of the
antenna: an effect, two, none, or one that the model lacks, with imperfections that no sheet lists.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from lab.antenna.cases import (
    case_name, even_sizes, kinds_of, MIX, round_robin, SMALLEST_IN_PAIR, Truth,
)
from lab.antenna.imperfections import draw_recorder, kept_rows, recorder_noise
from lab.antenna.sensors import STAMP_DIGIT_S, STAMP_ERROR_S
from lab.joints.machines import Cause, Kind, kind_of
from lab.joints.mechanism import FloatArray, Mechanism, simulate, TICK_S
from lab.joints.programme import draw_tests, RATES_HZ, reference, ticks_of
import numpy as np

# The drive holds the first position for so long before the recording begins.
BEFORE_S = 0.5
Moved = tuple[FloatArray, FloatArray, dict[str, FloatArray]]


def draw_truths(count: int, seed: int, machines: Sequence[str]) -> list[Truth]:
    """Draw all cases of a trial; machines, of machines.MACHINES, take turns within each kind."""
    random = np.random.default_rng([seed, 0])
    kinds = random.permutation(kinds_of(count))
    queues = {name: _Queues(kind_of(name), random) for name in machines}
    sizes = {kind: iter(even_sizes(int(np.sum(kinds == kind)), random)) for kind in MIX}
    seen = dict.fromkeys(MIX, 0)
    truths = []
    for number, kind in enumerate(map(str, kinds), start=1):
        name = machines[seen[kind] % len(machines)]
        seen[kind] += 1
        own = np.random.default_rng([seed, number])
        effects = queues[name].effects(kind, next(sizes[kind]), own)
        truths.append({
            'case': case_name(number), 'kind': kind, 'machine': name,
            'effects': [{'id': cause.key, 'size': size, 'parameters': cause.draw(size, own)}
                        for cause, size in effects],
            'deviations': kind_of(name).deviations(own), 'seed': [seed, number],
            'sample_rate_hz': int(own.choice(kind_of(name).table.get('rates', RATES_HZ))),
            'tests': draw_tests(kind_of(name).table, own),
            'imperfections': draw_imperfections(kind_of(name), own)})
    return truths


class _Queues:
    """The effects of one kind of machine, which take turns."""

    def __init__(self, kind: Kind, random: np.random.Generator) -> None:
        catalogue = list(kind.catalogue.values())
        self._singles, self._firsts, self._seconds = (
            round_robin(catalogue, random) for _ in range(3))
        self._outside: Iterator[Cause] = round_robin(list(kind.outside.values()), random)

    def effects(self, kind: str, size: float,
                random: np.random.Generator) -> list[tuple[Cause, float]]:
        """Return the effects of a case of this kind with their sizes."""
        if kind == 'single':
            return [(next(self._singles), size)]
        if kind == 'outside':
            return [(next(self._outside), size)]
        if kind == 'none':
            return []
        first, low = next(self._firsts), SMALLEST_IN_PAIR
        second = next(cause for cause in self._seconds if cause.key != first.key)
        return [(first, low + (1.0 - low) * size), (second, float(random.uniform(low, 1.0)))]


def draw_imperfections(kind: Kind, random: np.random.Generator) -> dict[str, Any]:
    """Draw the imperfections of a recorder; their limits are those of a wild case."""
    def within(limit: float) -> float:
        return float(random.uniform(-limit, limit))

    table = kind.table
    return {
        'gain': {name: within(share) for name, share in table['gain'].items()},
        'zero': {name: within(size) for name, size in table['zero'].items()},
        **draw_recorder(kind.readings, kind.readings, random)}


def moved(truth: Truth, recording: int, start: float) -> Moved:
    """
    Simulate one test (from 0) of a case, from `start` off the first reference.

    Return the times of the bus [s] and what it asks for, shape (n,) each; position and current at
    each tick of the controller, shape ((n - 1) ticks + 1,) each.
    """
    kind, test, rate = kind_of(truth['machine']), truth['tests'][recording], (
        truth['sample_rate_hz'])
    times = np.arange(int(round(rate * test['duration_s'])) + 1) / rate
    asked = reference(test, times)
    ticks = ticks_of(rate)
    count = (times.size - 1) * ticks + 1
    position, current = np.zeros(count), np.zeros(count)
    machine = Mechanism(**kind.numbers(truth['deviations'], truth['effects'], test['duration_s']))
    simulate(machine, asked, ticks, round(BEFORE_S / TICK_S), float(asked[0] + start), position,
             current)
    return times, asked, {'position': position, 'current': current}


def make_recording(truth: Truth, recording: int,
                   simulated: Callable[[Truth, int, float], Moved] = moved,
                   ) -> dict[str, FloatArray]:
    """Return the columns of a recording (from 0) of a case, shape (n,); `simulated` as `moved`."""
    random = np.random.default_rng([*truth['seed'], 2 + recording])
    kind, flaws, rate = kind_of(truth['machine']), truth['imperfections'], truth['sample_rate_hz']
    size = kind.table['start']
    times, asked, history = simulated(truth, recording, float(random.uniform(-size, size)))
    instants = TICK_S * np.arange(history['position'].size)
    columns = {'time_s': _stamps(times, flaws, random), kind.columns['reference']: asked}
    noise = recorder_noise(flaws, rate, random)
    for name in kind.readings:
        late = flaws['delay_samples'][name] / rate
        exact = np.interp(times - late, instants, history[name])
        columns[kind.columns[name]] = (
            exact * (1.0 + flaws['gain'].get(name, 0.0)) + flaws['zero'].get(name, 0.0)
            + kind.table['noise'][name] * noise(name, times.size))
    rows = kept_rows(times.size, flaws['missing_share'], random)
    return {name: column[rows] for name, column in columns.items()}


def _stamps(times: FloatArray, flaws: Mapping[str, Any],
            random: np.random.Generator) -> FloatArray:
    """Return the time stamps of a clock that is off, and drifts [s]."""
    error = np.clip(random.normal(0.0, STAMP_ERROR_S, times.size), -4e-4, 4e-4)
    drift = flaws['clock_drift_ppm_per_min'] / 60.0
    stamps = (times + error) * (1.0 + 1e-6 * (flaws['clock_ppm'] + 0.5 * drift * times))
    return np.asarray(np.round((stamps - stamps[0]) / STAMP_DIGIT_S) * STAMP_DIGIT_S)
