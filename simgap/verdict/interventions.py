# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What an intervention changes: the numbers of the named effects under each value of a label."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.by_label import ByLabel, can_be_split
from simgap.machine.contract import FloatArray, Form, Parameter
from simgap.search.hypothesis import Hypothesis
from simgap.verdict.held_out import FITTED, held_out
from simgap.verdict.intervals import ci95, contrast_deviation

_ROUNDS = 2


def interventions(problem: LeastSquares, none: Hypothesis, best: Hypothesis,
                  threads: int = 1) -> list[dict[str, Any]]:
    """Return what each label of the whole tests changes, for the JSON; empty without labels."""
    machine = problem.machine
    if not isinstance(machine, ByLabel):
        return []
    return [_of_label(problem, machine, none, best, key, threads) for key in machine.labels.groups]


def _of_label(problem: LeastSquares, machine: ByLabel, none: Hypothesis, best: Hypothesis,
              key: str, threads: int) -> dict[str, Any]:
    groups = machine.labels.groups[key]
    numbers = _numbers(problem, machine, best, key) if best.effects else []
    common = _in_forms(problem, machine, best,
                       [machine.catalogue.whole(form) for form in best.forms])
    reach = held_out(
        problem, none, common, threads, groups,
        f'each value of {key} in turn, with the effect as the others have it; {FITTED}')
    return {
        'label': key,
        'tests': {value: [e.name for e, own in zip(problem.experiments, groups, strict=True)
                          if own == value] for value in dict.fromkeys(groups)},
        'differ': _effects(numbers, True), 'stay': _effects(numbers, False), 'numbers': numbers,
        'explained_fraction': reach['explained_fraction'], 'held_out': reach['held_out'],
        'folds': reach['folds']}


def _effects(numbers: Sequence[Mapping[str, Any]], differ: bool) -> list[str]:
    """Return the effects of which a number differs between the values, or those of which none."""
    differing = {item['effect'] for item in numbers if item['differs']}
    return [effect for effect in dict.fromkeys(item['effect'] for item in numbers)
            if (effect in differing) == differ]


def _numbers(problem: LeastSquares, machine: ByLabel, best: Hypothesis,
             key: str) -> list[dict[str, Any]]:
    bases = {effect: machine.catalogue.whole(form) for effect, form in best.items}
    chosen = {effect: machine.labels.split(form, key) for effect, form in bases.items()
              if can_be_split(form)}
    groups = machine.labels.groups[key]
    values = list(dict.fromkeys(groups))
    point = {value: machine.labels.in_test(best.state.point(), groups.index(value))
             for value in values}
    start = {p.name: point[value][base.name] for effect, form in chosen.items()
             for value in values for base, p in zip(
                 bases[effect].sizes, _of_value(form, key, value), strict=True)}
    forms = [chosen.get(effect, form) for effect, form in best.items]
    state = _fitted(problem, best, forms, {**point[values[0]], **best.state.point(), **start})
    found = []
    for effect, form in chosen.items():
        for j, base in enumerate(bases[effect].sizes):
            parameters = [_of_value(form, key, value)[j] for value in values]
            found.append({'effect': effect, 'number': base.name, 'unit': base.unit,
                          **_compared(problem, state, base, parameters, values)})
    return found


def _of_value(form: Form, key: str, value: str) -> list[Parameter]:
    return [p for p in form.sizes if p.label == (key, value)]


def _in_forms(problem: LeastSquares, machine: ByLabel, best: Hypothesis,
              forms: Sequence[Form]) -> Hypothesis:
    if tuple(forms) == best.forms:
        return best
    point = {**machine.labels.mean(best.state.point()), **best.state.point()}
    return Hypothesis(best.effects, tuple(forms), _fitted(problem, best, forms, point))


def _fitted(problem: LeastSquares, best: Hypothesis, forms: Sequence[Form],
            point: dict[str, float]) -> FitState:
    """Fit effects in other forms, beside the nuisances of a hypothesis."""
    gone = {p.name for form in best.forms for p in form.parameters}
    parameters = (*(p for p in best.state.parameters if p.name not in gone),
                  *(p for form in forms for p in form.parameters))
    state = problem.start(parameters, {p.name: point[p.name] for p in parameters}, central=True)
    for _ in range(_ROUNDS):
        state = problem.refreshed(problem.fit(state, problem.settings.search.iterations))
    return state


def _compared(problem: LeastSquares, state: FitState, base: Parameter,
              parameters: Sequence[Parameter], values: Sequence[str]) -> dict[str, Any]:
    """Return a number under each value, and what differs from the first of them."""
    names = [p.name for p in state.parameters]
    places = [names.index(p.name) for p in parameters]
    contrasts = np.eye(len(names))[places]

    # a difference is worth the price of a parameter; that is stricter than its interval
    worth = math.sqrt(2.0 * problem.settings.evidence.number)

    def estimated(contrast: FloatArray) -> tuple[float, float]:
        return float(contrast @ state.x), math.hypot(
            contrast_deviation(problem, state, contrast),
            problem.settings.noise.model_error * float(np.abs(contrast) @ np.abs(state.x)))

    by_value = {}
    for name, contrast in zip(values, contrasts, strict=True):
        value, deviation = estimated(contrast)
        by_value[name] = {'value': value, 'ci95': np.clip(
            ci95(value, deviation), base.low, base.high).tolist()}
    differences = []
    for name, contrast in zip(values[1:], contrasts[1:], strict=True):
        value, deviation = estimated(contrast - contrasts[0])
        differences.append({
            'from': values[0], 'to': name, 'value': value, 'ci95': ci95(value, deviation),
            'differs': abs(value) > max(worth * deviation, base.tolerance)})
    return {'values': by_value, 'differences': differences,
            'differs': any(item['differs'] for item in differences)}


def lines(labels: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what the labels change as people read it, a line for each number."""
    found = []
    for label in labels:
        for item in label['numbers']:
            name, key = item['number'].split('.', 2)[-1], label['label']
            unit = '' if item['unit'] == '1' else f' {item["unit"]}'
            sizes = ', '.join(f'{one["value"]:.3g}{unit} under {key} {value or "not given"}'
                              for value, one in item['values'].items())
            changes = [f'{one["value"]:+.3g}{unit} ({one["ci95"][0]:.3g} to {one["ci95"][1]:.3g}) '
                       f'from {one["from"] or "not given"} to {one["to"] or "not given"}'
                       for one in item['differences'] if one['differs']]
            word = 'differs by ' + ', '.join(changes) if changes else 'stays'
            found.append(f'{item["effect"]}: {name} {word}: {sizes}')
    return found
