# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The cases of a trial: the effects of each antenna, drawn once and recorded.

A case follows entirely from its truth, noise included, and can be made again at any time.
"""

from collections.abc import Iterator, Sequence
import dataclasses
from typing import Any, TypeVar

from lab.antenna.days import apply_days, draw_days
from lab.antenna.effect import Defect
from lab.antenna.family import FAMILIES
from lab.antenna.imperfections import (
    apply_imperfections, draw_imperfections, imperfect_recording, spread_events,
)
from lab.antenna.machine import apply_tolerances, draw_tolerances, Records, reference_machine
from lab.antenna.programme import draw_sheets
from lab.antenna.real_antenna import FloatArray, simulate
from lab.antenna.sensors import record, sample_instants
from lab.antenna.sheet import CaseSheet, SensorGrade
from lab.antenna.wild_programme import draw_programme, LONGEST_S
import numpy as np

MIX = {'single': 0.55, 'pair': 0.15, 'none': 0.15, 'outside': 0.15}
SMALLEST_IN_PAIR = 0.25     # of the range of sizes: both effects must show
Truth = dict[str, Any]
Effect = TypeVar('Effect')


def case_name(number: int) -> str:
    """Return the name of a case, from 1."""
    return f'case_{number:04d}'


def draw_truths(count: int, seed: int, tolerance: float, *, sample_rate: float = 200.0,
                duration: float = 30.0, wild: bool = False, family: str = 'a',
                largest: float = 1.0, longest: float = LONGEST_S) -> list[Truth]:
    """
    Draw all cases of a trial, with the proportions of MIX in random order.

    Effects take turns, so that all are equally frequent; sizes are spread evenly over the share
    `largest` of their range. `tolerance` is the largest relative deviation of any parameter from
    the reference. Instead of `sample_rate` [Hz] and `duration` [s], wild cases draw imperfections
    and programmes of up to `longest` [s]. `family` is one of FAMILIES (all but 'a' only for
    wild cases).
    """
    forms = FAMILIES[family]
    random = np.random.default_rng([seed, 0])
    kinds = random.permutation(kinds_of(count))
    catalogue = list(forms.catalogue.values())
    singles = round_robin(catalogue, random)
    firsts, seconds = round_robin(catalogue, random), round_robin(catalogue, random)
    outsiders = round_robin(list(forms.outside.values()), random)
    sizes = {kind: iter(even_sizes(int(np.sum(kinds == kind)), random)) for kind in MIX}
    low = min(SMALLEST_IN_PAIR, largest)
    truths = []
    for number, kind in enumerate(kinds, start=1):
        own = np.random.default_rng([seed, number])
        effects: list[tuple[Defect, float]] = []
        if kind == 'single':
            effects = [(next(singles), largest * next(sizes['single']))]
        elif kind == 'outside':
            effects = [(next(outsiders), largest * next(sizes['outside']))]
        elif kind == 'pair':
            first = next(firsts)
            second = next(effect for effect in seconds if _compatible(first, effect))
            effects = [(first, low + (largest - low) * next(sizes['pair'])),
                       (second, float(own.uniform(low, largest)))]
        truths.append({
            'case': case_name(number), 'kind': str(kind),
            'effects': [{'id': effect.key, 'size': size, 'parameters': effect.draw(size, own)}
                        for effect, size in effects],
            'tolerance': tolerance, 'seed': [seed, number],
            **(_wild_tests(family, tolerance, longest, own) if wild
               else _tests(sample_rate, duration, tolerance, own))})
    return truths


def _tests(sample_rate: float, duration: float, tolerance: float,
           random: np.random.Generator) -> dict[str, Any]:
    return {'sample_rate_hz': sample_rate, 'duration_s': duration,
            'sheets': [sheet.plain() for sheet in draw_sheets(tolerance, duration, random)]}


def _wild_tests(family: str, tolerance: float, longest: float,
                random: np.random.Generator) -> dict[str, Any]:
    tests = draw_programme(FAMILIES[family].shapes, tolerance, longest, random)
    return {'family': family, 'sample_rate_hz': tests.sample_rate_hz,
            'durations_s': tests.durations_s, 'sheets': [s.plain() for s in tests.sheets],
            'given_sheets': tests.given, 'imperfections': draw_imperfections(random),
            **({'days': draw_days(len(tests.sheets), random)} if FAMILIES[family].days else {})}


def kinds_of(count: int) -> list[str]:
    """Return the kinds in the proportions of MIX, rounded to a total of `count`."""
    bounds = np.round(np.cumsum([0.0, *MIX.values()]) * count).astype(int)
    return [kind for kind, low, high in zip(MIX, bounds[:-1], bounds[1:])
            for _ in range(high - low)]


def round_robin(effects: Sequence[Effect], random: np.random.Generator) -> Iterator[Effect]:
    """Yield effects in turn and for ever, each round in another order."""
    while True:
        for k in random.permutation(len(effects)):
            yield effects[k]


def even_sizes(count: int, random: np.random.Generator) -> list[float]:
    """Return one size from each of `count` equal slices of 0 to 1, in random order."""
    slices = random.permutation(count)
    return [float(s) for s in (slices + random.uniform(0.0, 1.0, count)) / max(count, 1)]


def _compatible(first: Defect, second: Defect) -> bool:
    """Return whether two effects are distinct: neither contains the other."""
    place_1, name_1 = first.key.split('.')
    place_2, name_2 = second.key.split('.')
    if 'motors' in (place_1, place_2) and place_1.startswith('motor') and (
            place_2.startswith('motor')):
        return name_1 != name_2
    return first.key != second.key


def build_machine(truth: Truth, recording: int) -> Records:
    """Build the antenna of a case for a recording (from 0); wind and bad contacts are its own."""
    sheet = truth['sheets'][recording]
    machine = reference_machine(sheet['circuit'], sheet['filter_1'],
                                sheet['bias'].get('bias_pot', 0.7))
    random = np.random.default_rng([*truth['seed'], 1])
    apply_tolerances(machine, draw_tolerances(truth['tolerance'], random))
    if 'imperfections' in truth:
        apply_imperfections(machine, truth['imperfections'])
    if 'days' in truth:
        apply_days(machine, truth['days'], recording)
    for entry in truth['effects']:
        effect = FAMILIES[truth.get('family', 'a')].defect(entry['id'])
        values = dict(entry['parameters'])
        if 'seed' in values:
            values['seed'] += 1000000 * recording
        effect.change(machine, values)
    if 'durations_s' in truth:
        spread_events(machine, truth['durations_s'][recording])
    return machine


def sheet_of(truth: Truth, recording: int) -> CaseSheet:
    """Return the test sheet of one recording of a case."""
    plain = dict(truth['sheets'][recording])
    plain.pop('start')
    plain['sensors'] = SensorGrade(**plain['sensors'])
    known = {field.name for field in dataclasses.fields(CaseSheet)}
    return CaseSheet(**{name: value for name, value in plain.items() if name in known})


def make_recording(truth: Truth, recording: int) -> dict[str, FloatArray]:
    """
    Return the columns of one recording of a case (from 0) by name, each of shape (n,).

    Raise SimulationError where the antenna of this case cannot be integrated.
    """
    random = np.random.default_rng([*truth['seed'], 2 + recording])
    machine, sheet = build_machine(truth, recording), sheet_of(truth, recording)
    if 'imperfections' in truth:
        return imperfect_recording(machine, sheet, truth['imperfections'],
                                   truth['sample_rate_hz'], truth['durations_s'][recording],
                                   random, truth.get('days'))
    instants, stamps = sample_instants(truth['sample_rate_hz'], truth['duration_s'], random)
    place = (float(random.uniform(-1.0, 1.0)), float(random.uniform(-1.0, 1.0)))
    history = simulate(machine, sheet, instants, place)
    return record(history, machine, sheet.sensors, stamps, random)
