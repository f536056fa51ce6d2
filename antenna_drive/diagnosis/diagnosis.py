# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
The diagnosis of a gap between a machine and its model: where, which effect, how far it shrinks.

Examples
--------
>>> from antenna_drive.diagnosis.diagnosis import diagnose          # doctest: +SKIP
>>> from antenna_drive.parameters import load                 # doctest: +SKIP
>>> from antenna_drive.recording.files import read_recording  # doctest: +SKIP
>>> recording = read_recording('field.csv')                   # doctest: +SKIP
>>> diagnose({'field': recording}, load()).summary()          # doctest: +SKIP

"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
import time
from typing import Any

from antenna_drive.diagnosis import localisation as where, unknown_input, verdict
from antenna_drive.diagnosis.elimination import doubted
from antenna_drive.diagnosis.held_out import how_far
from antenna_drive.diagnosis.lack_of_fit import remains, tests
from antenna_drive.diagnosis.least_squares import Problem, pull_of
from antenna_drive.diagnosis.machine import Model
from antenna_drive.diagnosis.search import Candidate, parameters_of, Search
from antenna_drive.machines.antenna.machine import DriveModel
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.recording import Recording
import numpy as np
try:
    from threadpoolctl import threadpool_limits
except ImportError:  # no ROS distribution names it: slower without, and not otherwise
    threadpool_limits = None

Progress = Callable[[float, str], None]
# How many entries of `which` are given beside 'unknown' and 'none', and what is left out below.
_ENTRIES = 12
_LEAST = 1e-4
# More numbers than these are not told one by one.
_TOLD = 12


@dataclass(frozen=True)
class Diagnosis:
    """
    What was found.

    Attributes
    ----------
    result : the JSON of docs/diagnosis.md, as plain data
    model : that was compared
    none, best : the fits without and with the likeliest effects
    candidates : everything that was fitted
    notes : what was inferred or is missing

    """

    result: dict[str, Any]
    model: Model
    none: Candidate
    best: Candidate
    candidates: Sequence[Candidate] = field(default_factory=tuple)
    notes: Sequence[str] = ()

    def summary(self) -> str:
        """Return the verdict in a few lines."""
        result = self.result
        lines = [_HEADLINES[result['verdict']]]
        for entry in result['which'][:3]:
            if entry['probability'] >= 0.01:
                names = ' and '.join(entry['effects'])
                lines.append(f'  {100.0 * entry["probability"]:5.1f} %  {names}')
                lines += [f'           {line}' for line in told(entry['parameters'])]
        for group in result['confusable']:
            lines.append('  these data cannot tell apart: ' + ', '.join(group))
        if result['may_enter_at']:
            place = result['may_enter_at'][0]
            lines.append(f'  what is not named most likely enters as {place["name"]}, which could '
                         f'explain {100.0 * place["explained"]:.0f} % of the gap')
        fraction = result['how_far']['explained_fraction']
        if fraction['value'] is not None:
            low, high = fraction['ci95']
            lines.append(f'  explains {100.0 * fraction["value"]:.0f} % of the gap '
                         f'({100.0 * low:.0f} to {100.0 * high:.0f}), judged on '
                         f'{result["how_far"]["held_out"]}')
        lines += [f'  note: {note}' for note in self.notes]
        return '\n'.join(lines)


_HEADLINES = {
    'no_gap': 'no gap: machine and model agree within tolerance and noise',
    'explained': 'explained: one of the known effects closes the gap',
    'partly_explained': 'partly explained: a known effect closes some of the gap',
    'unknown_effect': 'unknown effect: nothing in the catalogue closes the gap',
}


def told(parameters: Mapping[str, Any]) -> list[str]:
    """Return the values of an entry's parameters as people read them, a line each."""
    if len(parameters) > _TOLD:
        # a gust: a course over time, which no one reads number by number
        return [f'{len(parameters)} numbers over time, see the JSON']
    return [f'{name.split(".", 2)[-1]} = {item["value"]:.4g} '
            + ('' if item['unit'] == '1' else f'{item["unit"]} ')
            + f'({item["ci95"][0]:.4g} to {item["ci95"][1]:.4g})'
            for name, item in parameters.items()]


def diagnose(recordings: Mapping[str, Recording], drive: Drive,
             progress: Progress = lambda share, doing: None, threads: int = 2) -> Diagnosis:
    """
    Say where a real drive and its model part, which effect is behind it, and how far it goes.

    Parameters
    ----------
    recordings
        of one machine, by name, with their test sheets
    drive
        the configuration of the model
    progress
        called with the share that is done, 0 to 1, and what is being done
    threads
        how many simulations at once

    Raises
    ------
    UserError : a recording cannot be used; the message says which and why

    """
    began = time.monotonic()
    model = DriveModel(recordings, drive, threads)
    found = diagnosed(model, progress, threads, model.notes)
    found.result['seconds'] = time.monotonic() - began
    return found


def diagnosed(model: Model, progress: Progress = lambda share, doing: None, threads: int = 2,
              notes: Sequence[str] = ()) -> Diagnosis:
    """
    Diagnose any machine that is modelled, in the experiments that its model holds.

    Parameters
    ----------
    model
        see `Model`
    progress
        called with the share that is done, 0 to 1, and what is being done
    threads
        how many candidates are fitted at once
    notes
        what was inferred or is missing

    """
    # whole fits are made side by side: matrices within a fit need no threads of their own
    with threadpool_limits(1, 'blas') if threadpool_limits else nullcontext():
        return _diagnosed(model, progress, threads, notes)


def _diagnosed(model: Model, progress: Progress, threads: int,
               notes: Sequence[str]) -> Diagnosis:
    began = time.monotonic()
    search = Search(Problem(model), lambda share, doing: progress(0.9 * share, doing), threads)
    # what is left is judged after a fit that has converged; the ranking compares like with like
    candidates, best = doubted(search, search.run())
    # the noise is that of the motion which was found
    problem, model = search.whole, search.whole.model
    none = candidates[0]
    progress(0.9, 'how far it goes')
    reach = how_far(problem, none, best)
    left = remains(problem, best, reach['explained_fraction']['ci95'][1])
    unknown = verdict.unknown_probability(left)
    ranked = verdict.rank(candidates, unknown)
    entries = _entries(ranked, unknown)
    word = _word(entries[0]['effects'], unknown)
    motions = [model.motion(k) for k in range(len(model.experiments))]
    places: Sequence[unknown_input.Place] = ()
    if word in ('unknown_effect', 'partly_explained'):
        progress(0.95, 'where something unknown may have entered')
        lies, places = where.of_the_unknown(problem, none.state, left.loudest, left.fast)
    if word != 'unknown_effect':
        lies = where.of_effects(problem, ranked, none.state, best.state)
    result = {
        'verdict': word,
        'where': lies,
        'which': entries,
        'confusable': verdict.confusable(candidates) if best.effects else [],
        'how_far': reach,
        'residual_tests': tests(problem, best.state, left, motions),
        'may_enter_at': [vars(place) for place in places if place.evidence > 0.0],
        'seconds': time.monotonic() - began,
        'notes': list(notes),
    }
    progress(1.0, 'done')
    return Diagnosis(result, model, none, best, candidates, notes)


def _entries(ranked: Sequence[verdict.Ranked], unknown: float) -> list[dict[str, Any]]:
    """Return the likeliest hypotheses for the JSON, 'none' and 'unknown' among them."""
    entries: list[dict[str, Any]] = []
    likeliest = set(ranked[0].candidate.effects)
    for item in ranked[:_ENTRIES]:
        # a pair's members alone, and nothing, are told however improbable they are
        if item.probability >= _LEAST or set(item.candidate.effects) <= likeliest:
            entries.append({'effects': list(item.candidate.effects) or ['none'],
                            'probability': item.probability,
                            'parameters': _parameters(item.candidate)})
    if ['none'] not in [entry['effects'] for entry in entries]:
        share = next(r.probability for r in ranked if not r.candidate.effects)
        entries.append({'effects': ['none'], 'probability': share, 'parameters': {}})
    entries.append({'effects': ['unknown'], 'probability': unknown, 'parameters': {}})
    total = sum(entry['probability'] for entry in entries)
    for entry in entries:
        entry['probability'] /= total
    return sorted(entries, key=lambda entry: -entry['probability'])


def _word(top: list[str], unknown: float) -> str:
    if top == ['none']:
        return 'no_gap'
    if top == ['unknown']:
        return 'unknown_effect'
    return 'explained' if unknown < 0.3 else 'partly_explained'


def _parameters(candidate: Candidate) -> dict[str, Any]:
    """Return the values of a candidate's effects with intervals of 95 percent."""
    state = candidate.state
    pull = pull_of(state.parameters)
    curvature = state.hessian + np.diag(pull)
    scale = np.sqrt(np.maximum(np.diag(curvature), 1e-30))
    covariance = np.linalg.pinv(curvature / np.outer(scale, scale)) / np.outer(scale, scale)
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    names = [p.name for p in state.parameters]
    found = {}
    for parameter, value in parameters_of(candidate):
        wide = 1.96 * float(spread[names.index(parameter.name)])
        found[parameter.name] = {
            'value': value, 'ci95': [max(value - wide, parameter.low),
                                     min(value + wide, parameter.high)],
            'unit': parameter.unit}
    return found
