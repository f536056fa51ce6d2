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
"""How far the gap shrinks once an effect is added, judged on data that were withheld."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from antenna_drive.diagnosis.hypothesis import Hypothesis
from antenna_drive.diagnosis.least_squares import LeastSquares
from antenna_drive.diagnosis.machine import FloatArray
import numpy as np

_TURNS = ('each recording in turn, with the effect as the others have it; offsets within the '
          'tolerance were fitted to it, with the effect and without')
_HALVES = 'the second half of the recording, predicted from the first'


def held_out(problem: LeastSquares, none: Hypothesis, best: Hypothesis) -> dict[str, Any]:
    """
    Return the gap before and after, on data that the fits have not seen, for the JSON.

    Parameters
    ----------
    problem
        the whole tests
    none, best
        the hypotheses without and with the likeliest effects

    """
    count = len(problem.experiments)
    channels = problem.experiments[0].channels
    none, best = (replace(h, state=problem.start(h.state.parameters, h.state.point()))
                  if h.state.jacobian.size == 0 else h for h in (none, best))
    before, after = [], []
    for k in range(count):
        unseen = [_withheld_residuals(problem, h, k) for h in (none, best)]
        before.append(unseen[0])
        after.append(unseen[1] if best.effects else unseen[0])
    samples = sum(np.isfinite(z).sum() for z in before)
    energy = [float(np.nansum(np.concatenate([np.ravel(z) for z in part]) ** 2) / samples)
              for part in (before, after)]
    fraction: float | None = None
    interval: list[float | None] = [None, None]
    if best.effects:
        block_s = problem.machine.time_scales.block_s
        blocks = np.concatenate([
            block_sums(problem.experiments[k].time, before[k], after[k], block_s)
            for k in range(count)])
        fraction, interval = _bootstrapped(blocks, problem)
    per_signal = {}
    for c, channel in enumerate(channels):
        pair = [np.concatenate([z[:, c] for z in part]) for part in (before, after)]
        if np.isfinite(pair[0]).any():
            per_signal[channel] = {'before': float(np.sqrt(np.nanmean(pair[0] ** 2))),
                                   'after': float(np.sqrt(np.nanmean(pair[1] ** 2)))}
    return {'before': math.sqrt(energy[0]), 'after': math.sqrt(energy[1]), 'noise_floor': 1.0,
            'explained_fraction': {'value': fraction, 'ci95': interval},
            'per_signal': per_signal,
            'held_out': _TURNS if count > 1 else _HALVES}


def _withheld_residuals(problem: LeastSquares, hypothesis: Hypothesis, k: int) -> FloatArray:
    """Return the residuals of an experiment that the effects were not fitted to, shape (n, c)."""
    settings, machine = problem.settings, problem.machine
    experiments = problem.experiments
    used = [np.full(e.time.size, i != k) for i, e in enumerate(experiments)]
    if len(experiments) == 1:
        used[0] = experiments[0].time < experiments[0].time[-1] / 2.0
    training = LeastSquares(machine, used, settings=settings)
    state = hypothesis.state
    fitted = training.fit(training.start(state.parameters, state.point(), state.jacobian),
                          settings.held_out.iterations)
    if len(experiments) == 1:
        whole = problem.residuals_of(
            problem.start(state.parameters, fitted.point(), state.jacobian), k)
        whole[used[0]] = np.nan
        return whole
    # The effect is as the other tests have it. The nuisances are no part of it: they are fitted
    # to the withheld test, with the effect and without.
    effects = {p.name for form in hypothesis.forms for p in form.parameters if p.experiment != k}
    own = [j for j, p in enumerate(fitted.parameters) if p.name not in effects]
    values = fitted.point()
    testing = _WithFixed(problem, k, {name: values[name] for name in effects})
    start = testing.start([fitted.parameters[j] for j in own], values, state.jacobian[:, own])
    return testing.residuals_of(testing.fit(start, settings.held_out.iterations), k)


class _WithFixed(LeastSquares):
    """The residuals of one experiment, with some parameters fixed."""

    def __init__(self, problem: LeastSquares, experiment: int, fixed: dict[str, float]) -> None:
        super().__init__(problem.machine, [np.full(e.time.size, i == experiment)
                                           for i, e in enumerate(problem.experiments)],
                         settings=problem.settings)
        self._fixed = fixed

    def residuals(self, point: dict[str, float], alone: int | None = None) -> FloatArray:
        return super().residuals({**self._fixed, **point}, alone)


def block_sums(time_s: FloatArray, before: FloatArray, after: FloatArray,
               block_s: float) -> FloatArray:
    """Return the energy before, after and of the noise in each block, shape (blocks, 3)."""
    block = (time_s / block_s).astype(int)
    count = int(block[-1]) + 1
    columns = [np.nansum(before ** 2, axis=1), np.nansum(after ** 2, axis=1),
               np.isfinite(before).sum(axis=1)]
    return np.column_stack([np.bincount(block, column, minlength=count) for column in columns])


def _bootstrapped(blocks: FloatArray,
                  problem: LeastSquares) -> tuple[float, list[float | None]]:
    """Return the explained fraction with its 95 percent interval by a block bootstrap."""
    settings = problem.settings.held_out
    random = np.random.default_rng(0)
    draws = [explained_fraction(blocks[random.integers(0, len(blocks), len(blocks))].sum(axis=0),
                                settings.no_gap) for _ in range(settings.resamples)]
    return (explained_fraction(blocks.sum(axis=0), settings.no_gap),
            [float(np.quantile(draws, 0.025)), float(np.quantile(draws, 0.975))])


def explained_fraction(sums: FloatArray, no_gap: float) -> float:
    """
    Return the explained share of the energy above the noise, at most 1; 0 if there is no gap.

    Parameters
    ----------
    sums
        energy before, after, and of the noise
    no_gap
        share of the energy below which there is no gap

    """
    before, after, noise = sums
    # with a floor above the energy that is left, more than all would be explained
    gap = before - min(noise, after)
    return float((before - after) / gap) if gap > no_gap * before else 0.0
