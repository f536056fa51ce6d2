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
"""How far the gap shrinks once an effect is added, on data whose effect was withheld."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math
from typing import Any

from antenna_drive.diagnosis.least_squares import Problem
from antenna_drive.diagnosis.machine import FloatArray, Model
from antenna_drive.diagnosis.search import Candidate
import numpy as np

_BLOCK_S = 1.0
# A gap that is less than this share of the energy is none.
_NO_GAP = 1e-3
_TURNS = ('each recording in turn, with the effect as the others have it; offsets within the '
          'tolerance were fitted to it, with the effect and without')
_HALVES = 'the second half of the recording, predicted from the first'
_RESAMPLES = 400


def how_far(problem: Problem, none: Candidate, best: Candidate) -> dict[str, Any]:
    """
    Return the gap before and after, on data that the fits have not seen, for the JSON.

    Parameters
    ----------
    problem
        the whole tests
    none, best
        the candidates without and with the likeliest effects

    """
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
