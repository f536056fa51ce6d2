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
>>> from antenna_drive.gap.diagnosis import diagnose          # doctest: +SKIP
>>> from antenna_drive.parameters import load                 # doctest: +SKIP
>>> from antenna_drive.recording.files import read_recording  # doctest: +SKIP
>>> recording = read_recording('field.csv')                   # doctest: +SKIP
>>> diagnose({'field': recording}, load()).summary()          # doctest: +SKIP

"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
import math
import time
from typing import Any

from antenna_drive.gap import residuals, unknown_input, verdict, where
from antenna_drive.gap.drive_model import DriveModel
from antenna_drive.gap.fit import Problem, pull_of, State
from antenna_drive.gap.model import FloatArray, Model, Motion
from antenna_drive.gap.search import Candidate, parameters_of, Search
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
_BLOCK_S = 1.0
# A gap that is less than this share of the energy is none.
_NO_GAP = 1e-3
_TURNS = ('each recording in turn, with the effect as the others have it; offsets within the '
          'tolerance were fitted to it, with the effect and without')
_HALVES = 'the second half of the recording, predicted from the first'
_RESAMPLES = 400
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
    problem = Problem(model)
    search = Search(problem, lambda share, doing: progress(0.9 * share, doing), threads)
    candidates = search.run()
    problem = search.whole
    model = problem.model
    none = candidates[0]
    # what is left is judged after a fit that has converged; the ranking compares like with like
    best = search.polished(verdict.best(candidates))
    excess = _excess(problem, best.state)
    raw = problem.residuals([{}])[0]
    left = _left(problem, raw, best)
    progress(0.9, 'how far it goes')
    how_far = _how_far(problem, none, best)
    loudest, fast, fast_left = _fast(problem, raw, best)
    point = best.state.point()
    unknown = verdict.unknown_probability(verdict.Remains(
        excess, left, fast, fast_left,
        max((form.strangeness(point) for form in best.forms), default=0.0),
        how_far['explained_fraction']['ci95'][1]))
    ranked = verdict.rank(candidates, unknown)
    entries: list[dict[str, Any]] = []
    for item in ranked[:_ENTRIES]:
        if item.probability >= _LEAST or item is ranked[0] or not item.candidate.effects:
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
    entries.sort(key=lambda entry: -entry['probability'])
    word = _word(entries[0]['effects'], unknown)
    motions = [model.motion(k) for k in range(len(model.experiments))]
    places: Sequence[unknown_input.Place] = ()
    if word in ('unknown_effect', 'partly_explained'):
        progress(0.95, 'where something unknown may have entered')
        lies, places = where.of_the_unknown(problem, model, none.state, loudest, fast)
    if word != 'unknown_effect':
        lies = where.of_effects(problem, model, ranked, none.state, best.state)
    result = {
        'verdict': word,
        'where': lies,
        'which': entries,
        'confusable': verdict.confusable(candidates) if best.effects else [],
        'how_far': how_far,
        'residual_tests': _tests(problem, best.state, excess, left, motions),
        'may_enter_at': [vars(place) for place in places if place.evidence > 0.0],
        'seconds': time.monotonic() - began,
        'notes': list(notes),
    }
    progress(1.0, 'done')
    return Diagnosis(result, model, none, best, candidates, notes)


def _word(top: list[str], unknown: float) -> str:
    if top == ['none']:
        return 'no_gap'
    if top == ['unknown']:
        return 'unknown_effect'
    return 'explained' if unknown < 0.3 else 'partly_explained'


def _excess(problem: Problem, state: State) -> float:
    """
    Return how much of the residual is no noise: the mean over tests and signals.

    Beyond what white noise of the same fast part would give, so that a sensor noisier than its
    sheet says raises no alarm; outliers are clipped.
    """
    found = []
    for k, experiment in enumerate(problem.experiments):
        z = np.clip(problem.shaped(state, k), -6.0, 6.0)
        # at rest the encoder's residual is a fraction of one step, and no noise at all
        found += [residuals.structure(z[:, c]) for c, channel in enumerate(experiment.channels)
                  if channel not in experiment.coarse and np.isfinite(z[:, c]).sum() > 50]
    return float(np.mean(np.maximum(found, -0.5))) if found else 0.0


def _left(problem: Problem, raw: FloatArray, best: Candidate) -> float:
    """Return the share of the raw gap above the noise that the best candidate leaves."""
    noise = 0.0
    energy = np.zeros(2)
    for k, experiment in enumerate(problem.experiments):
        z = problem.shaped(best.state, k)
        first = raw[problem.rows(k)].reshape(experiment.measured.shape)
        for c in range(len(experiment.channels)):
            if experiment.channels[c] in experiment.coarse or not np.isfinite(z[:, c]).any():
                continue
            white = 0.5 * float(np.nanmean(np.diff(z[:, c]) ** 2))
            energy += [min(float(np.nanmean(z[:, c] ** 2)), 1e6) - white,
                       min(float(np.mean(first[:, c] ** 2)), 1e6) - white]
            noise += white
    return float(np.clip(energy[0] / max(energy[1], 0.05 * noise), 0.0, 1.0))


def _fast(problem: Problem, raw: FloatArray, best: Candidate) -> tuple[str, float, float]:
    """
    Return the signal whose fast part is the loudest, how loud, and what share was there before.

    In the variance of its sensor's noise, the mean over the tests.
    """
    signal, loudest, share = '', 0.0, 1.0
    for c, channel in enumerate(problem.experiments[0].channels):
        pairs = []
        for k, experiment in enumerate(problem.experiments):
            z = problem.shaped(best.state, k)[:, c]
            if np.isfinite(z).sum() < 50:
                continue
            first = raw[problem.rows(k)].reshape(experiment.measured.shape)[:, c]
            # a coarse reading at rest is a fraction of a step off, slow or fast, and never more
            loud = residuals.power if channel in experiment.coarse else residuals.fast
            pairs.append([loud(z), loud(first)])
        if pairs:
            now, before = np.mean(pairs, axis=0)
            if now > loudest:
                signal, loudest = channel, float(now)
                share = float(np.clip((now - 1.0) / max(before - 1.0, 1e-3), 0.0, 1.0))
    return signal, loudest, share


def _tests(problem: Problem, state: State, excess: float, left: float,
           motions: Sequence[Motion]) -> dict[str, Any]:
    signals: dict[str, Any] = {}
    zs = [problem.shaped(state, k) for k in range(len(problem.experiments))]
    for c, channel in enumerate(problem.experiments[0].channels):
        z = np.concatenate([part[:, c] for part in zs])
        if np.isfinite(z).any():
            signals[channel] = {
                'rms': float(np.sqrt(np.nanmean(z ** 2))),
                'slow_excess': float(np.mean([residuals.structure(part[:, c]) for part in zs])),
                'greatest_correlation': max(residuals.correlation(part[:, c]) for part in zs),
            }
    return {'excess_over_noise': excess, 'share_left': left, 'signals': signals,
            'depends_on': residuals.dependences(problem.experiments, motions, zs)}


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


# -- how far --------------------------------------------------------------------------------------

def _how_far(problem: Problem, none: Candidate, best: Candidate) -> dict[str, Any]:
    """Return the gap before and after, on data that the fits have not seen."""
    count = len(problem.experiments)
    channels = problem.experiments[0].channels
    none, best = (replace(c, state=problem.start(c.state.parameters, c.state.point()))
                  if c.state.jacobian.size == 0 else c for c in (none, best))
    before, after = [], []
    for k in range(count):
        unseen = [_unseen(problem, candidate, k) for candidate in (none, best)]
        before.append(unseen[0])
        after.append(unseen[1] if best.effects else unseen[0])
    floor = 1.0
    seen = [np.isfinite(z).sum() for z in before]
    energy = [float(np.nansum(np.concatenate([np.ravel(z) for z in part]) ** 2) / sum(seen))
              for part in (before, after)]
    fraction: float | None = None
    interval: list[float | None] = [None, None]
    if best.effects:
        sums = [_blocks(problem.experiments[k].time, before[k], after[k]) for k in range(count)]
        blocks = np.concatenate(sums)
        fraction = _fraction(blocks.sum(axis=0))
        random = np.random.default_rng(0)
        draws = [_fraction(blocks[random.integers(0, len(blocks), len(blocks))].sum(axis=0))
                 for _ in range(_RESAMPLES)]
        interval = [float(np.quantile(draws, 0.025)), float(np.quantile(draws, 0.975))]
    per_signal = {}
    for c, channel in enumerate(channels):
        pair = [np.concatenate([z[:, c] for z in part]) for part in (before, after)]
        if np.isfinite(pair[0]).any():
            per_signal[channel] = {'before': float(np.sqrt(np.nanmean(pair[0] ** 2))),
                                   'after': float(np.sqrt(np.nanmean(pair[1] ** 2)))}
    return {'before': math.sqrt(energy[0]), 'after': math.sqrt(energy[1]), 'noise_floor': floor,
            'explained_fraction': {'value': fraction, 'ci95': interval},
            'per_signal': per_signal,
            'held_out': _TURNS if count > 1 else _HALVES}


def _unseen(problem: Problem, candidate: Candidate, k: int) -> FloatArray:
    """Return the residuals of an experiment that the machine's parameters were not fitted to."""
    experiments = problem.experiments
    used = [np.full(e.time.size, i != k) for i, e in enumerate(experiments)]
    half = experiments[k].time[-1] / 2.0
    if len(experiments) == 1:
        used[0] = experiments[0].time < half
    training = Problem(problem.model, used)
    state = candidate.state
    fitted = training.start(state.parameters, state.point(), state.jacobian)
    fitted = training.fit(fitted, 6)
    if len(experiments) > 1:
        # The effect is as the other tests have it. Offsets within the tolerance are no part of
        # it: they are fitted to the withheld test alone, with the effect and without.
        effects = {p.name for form in candidate.forms for p in form.parameters
                   if p.experiment != k}
        own = [j for j, p in enumerate(fitted.parameters) if p.name not in effects]
        values = fitted.point()
        fixed = {name: values[name] for name in effects}
        testing = _Held(problem.model, [np.full(e.time.size, i == k)
                                        for i, e in enumerate(experiments)], fixed)
        parts = [fitted.parameters[j] for j in own]
        here = testing.start(parts, values, state.jacobian[:, own])
        fitted = testing.fit(here, 6)
        return testing.shaped(fitted, k)
    whole = problem.shaped(problem.start(state.parameters, fitted.point(), state.jacobian), k)
    whole[used[0]] = np.nan
    return whole


class _Held(Problem):
    """A problem some of whose parameters are held."""

    def __init__(self, model: Model, used: Sequence[Any], fixed: dict[str, float]) -> None:
        super().__init__(model, used)
        self._fixed = fixed

    def residuals(self, points: Sequence[dict[str, float]],
                  alone: int | None = None) -> list[FloatArray]:
        return super().residuals([{**self._fixed, **point} for point in points], alone)


def _blocks(time_s: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """Return energy before, after and of noise in each block of a second, shape (blocks, 3)."""
    block = (time_s / _BLOCK_S).astype(int)
    count = int(block[-1]) + 1
    columns = [np.nansum(before ** 2, axis=1), np.nansum(after ** 2, axis=1),
               np.isfinite(before).sum(axis=1)]
    return np.column_stack([np.bincount(block, column, minlength=count) for column in columns])


def _fraction(sums: FloatArray) -> float:
    """Return the explained share of the energy above the noise, at most 1; 0 of nothing."""
    before, after, floor = sums
    # a floor above what is left would explain more than all
    gap = before - min(floor, after)
    return float((before - after) / gap) if gap > _NO_GAP * before else 0.0
