# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a page about a diagnosis says to an engineer with two minutes, as plain data."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from simgap.machine.contract import Experiment, FloatArray
from simgap.machine.diagram import Diagram
from simgap.report.curves import Panel
from simgap.report.law_picture import picture
from simgap.verdict.record import share_text, value_lines, Verdict
from simgap.verdict.sentence import headline, is_open, said

# An effect so probable is still open.
_OPEN = 0.05


def contents(verdict: Verdict, facts: Mapping[str, str] = MappingProxyType({})) -> dict[str, Any]:
    """Return what verdict.html lists; `facts` say what was diagnosed, with what."""
    effects = verdict.machine.catalogue
    what, sure, then = said(verdict)
    title, stop, more = what.partition('. ')
    suspicion = dict.fromkeys((effect.component for effect in effects.values()), 0.0)
    for answer in verdict.which:
        for component in {effects[name].component for name in answer.effects if name in effects}:
            suspicion[component] += answer.probability
    if verdict.word == 'unknown_effect':
        for part, share in verdict.planning.get('unnamed', {}).items():
            suspicion[part] = suspicion.get(part, 0.0) + share
    fraction = verdict.how_far['explained_fraction']
    diagram = verdict.machine.diagram or Diagram.of(suspicion)
    shares = diagram.shares(suspicion)
    panels, signals, alone = _curves(verdict)
    return {
        'title': title + stop.rstrip(), 'lead': f'{more} {sure}'.strip(), 'then': then,
        'facts': {'verdict': headline(verdict).capitalize(),
                  **dict.fromkeys(('machine', 'configuration', 'recordings'), ''),
                  'compared': _compared(verdict.machine.experiments), **facts},
        'result': verdict.as_data(), 'diagram': diagram,
        'blocks': [(block, min(shares.get(block.component, 0.0), 1.0))
                   for block in diagram.blocks],
        'causes': {name: effect.cause for name, effect in effects.items()},
        'numbers': [value_lines(answer.parameters) for answer in verdict.which],
        'explained': '' if fraction['value'] is None else share_text(fraction),
        'law': next((picture(place.law) for place in verdict.may_enter_at[:1] if place.law), None),
        'panels': panels, 'signals': signals, 'alone': alone, 'advice': _advice(verdict)}


def _compared(experiments: Sequence[Experiment]) -> str:
    """Return how much of each recording is compared, as far as that is known."""
    some: dict[tuple[str, float], float] = {}
    for experiment in experiments:
        if experiment.excerpt:
            key = experiment.excerpt.recording, experiment.excerpt.of_s
            some[key] = some.get(key, 0.0) + float(np.ptp(experiment.time))
    return ', '.join(f'{name} {compared:.0f} of {whole:.0f} s ({100.0 * compared / whole:.0f} '
                     'percent)' for (name, whole), compared in some.items() if whole > 0.0)


def _curves(verdict: Verdict) -> tuple[list[Panel], list[str], dict[str, float]]:
    """Return the panels with their signals, and what the effects alone move."""
    machine, fitted = verdict.machine, verdict.best.state.point()
    off = {p.name: 0.0 for form in verdict.best.forms for p in form.sizes}
    before, after, bare = machine.simulate(
        [verdict.none.state.point(), fitted, {**fitted, **off}])
    panels: list[Panel] = []
    signals: list[str] = []
    moved: list[FloatArray] = []
    for experiment, first, second, third in zip(machine.experiments, before, after, bare,
                                                strict=True):
        assert first is not None and second is not None and third is not None
        moved.append(second - third)
        for channel, pair in _of_experiment(experiment, first, second):
            panels += pair
            signals += [channel] * len(pair)
    rms = np.sqrt(np.nanmean(np.concatenate(moved) ** 2, axis=0)).tolist()
    alone = dict(zip(machine.experiments[0].channels, rms, strict=True)) if off else {}
    return panels, signals, alone


def _of_experiment(experiment: Experiment, before: FloatArray,
                   after: FloatArray) -> Iterator[tuple[str, tuple[Panel, Panel]]]:
    """Yield the channels that were read, that which gains most first, each with its panels."""
    gain = np.nansum(((experiment.measured - before) / experiment.noise) ** 2
                     - ((experiment.measured - after) / experiment.noise) ** 2, axis=0)
    for channel in np.argsort(-gain, kind='stable').tolist():
        name, unit = experiment.channels[channel], experiment.units[channel]
        time = experiment.recorded_time
        measured = experiment.measured[:, channel]
        simulated = {'before': before[:, channel], 'after': after[:, channel]}
        if np.isfinite(measured).any():
            yield name, (
                (experiment.name, name, unit, [
                    (key, time, values)
                    for key, values in {'measured': measured, **simulated}.items()]),
                (experiment.name, 'measured less simulated', unit, [
                    (key, time, measured - values) for key, values in simulated.items()]))


def _advice(verdict: Verdict) -> list[str]:
    """Return which tests would settle what is open, as the machine knows them."""
    if verdict.word in ('explained', 'no_gap') and not is_open(verdict):
        return []
    names = {name for group in verdict.confusable for name in group}
    for answer in verdict.which:
        if answer.probability > _OPEN:
            names |= {name for name in answer.effects if name in verdict.machine.catalogue}
    kinds = {name.partition('.')[2] for name in names}
    return [text for effects, text in verdict.machine.advice
            if not effects or kinds & set(effects)]
