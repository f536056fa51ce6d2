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
"""What a candidate leaves: how far that is from noise, in which signal, and what it depends on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from antenna_drive.diagnosis import residual_statistics as residuals
from antenna_drive.diagnosis.least_squares import Problem, State
from antenna_drive.diagnosis.machine import FloatArray, Motion
from antenna_drive.diagnosis.search import Candidate
from antenna_drive.diagnosis.verdict import Remains
import numpy as np


def remains(problem: Problem, best: Candidate, explained: float | None) -> Remains:
    """
    Return what the best candidate leaves, after a fit that has converged.

    Parameters
    ----------
    problem
        the whole tests
    best
        candidate
    explained
        upper end of the interval of what it explains of withheld tests, None without effects

    """
    raw = problem.residuals([{}])[0]
    loudest, fast, fast_left = _fast(problem, raw, best)
    point = best.state.point()
    strangeness = max((form.strangeness(point) for form in best.forms), default=0.0)
    return Remains(_excess(problem, best.state), _left(problem, raw, best), fast, fast_left,
                   strangeness, explained, loudest)


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


def tests(problem: Problem, state: State, left: Remains,
          motions: Sequence[Motion]) -> dict[str, Any]:
    """Return what is left in every signal and what it depends on, for the JSON."""
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
    return {'excess_over_noise': left.excess, 'share_left': left.left, 'signals': signals,
            'depends_on': residuals.dependences(problem.experiments, motions, zs)}
