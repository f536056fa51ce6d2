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
Where something unknown enters: the part of the machine that a gap sits in, whatever causes it.

An input of any course over time is let into each part in turn: a torque on a shaft, a voltage in
an amplifier, a wrong reading. The model answers it pulse by pulse, and the answers are fitted to
what the offsets leave of the gap. The part whose input explains it with the least effort is the
likeliest. Pulses that are so far apart that the machine has come to rest between them share a run.

The measure is the marginal likelihood of a linear model whose inputs are random with a variance
that is chosen for each place (D. J. C. MacKay, Bayesian interpolation, Neural Computation 4,
1992, Eq. 2.9 and 3.2); the offsets, with the spread they are expected to have, are taken out of
both sides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from antenna_drive.diagnosis.least_squares import Problem, pull_of
from antenna_drive.diagnosis.machine import Experiment, FloatArray
import numpy as np
from scipy import linalg

# A pulse rises and falls in so much time each [s], and answers to it end after so much [s].
RISE_S = 0.15
ANSWER_S = 1.5
# A residual that is so many times as large as usual counts no more than that.
_OUTLIER = 6.0
# Variances of an input over that of the noise that are tried.
_RATIOS = np.logspace(-4.0, 4.0, 25)
# Residuals are no white noise: a difference of evidence counts for so much less.
_CAUTION = 0.02


@dataclass(frozen=True)
class Place:
    """
    A place where something unknown may have entered.

    Attributes
    ----------
    name : for people
    component : the part of the machine
    evidence : natural logarithm of how much likelier the gap is with an input there than without
    explained : share of the gap's energy that an input there explains, 0 to 1

    """

    name: str
    component: str
    evidence: float
    explained: float


def places(problem: Problem, point: Mapping[str, float]) -> list[Place]:
    """
    Return where something unknown may have entered, the likeliest first.

    Parameters
    ----------
    problem
        the model against its experiments
    point
        the offsets as they were fitted without any effect

    """
    here = dict(point)
    model = problem.model
    residual = problem.residuals([here])[0]
    level = max(problem.level(residual), 1e-9)
    weight = np.where(problem.valid, np.minimum(
        1.0, _OUTLIER * level / np.maximum(np.abs(residual), 1e-12)), 0.0) / level ** 2
    offsets = problem.columns(here, model.nuisances, residual, central=False).astype(float)
    inputs = _Inputs(residual, weight, offsets, pull_of(model.nuisances))
    found = []
    for entry in model.entries:
        answers: list[list[FloatArray]] = [[] for _ in problem.experiments]
        for shift in np.arange(0.0, ANSWER_S - 0.5 * RISE_S, RISE_S):
            pushed = model.pushed(here, entry, partial(_comb, shift=float(shift)))
            for k, experiment in enumerate(problem.experiments):
                rows = problem.rows(k)
                change = (residual[rows] - problem.scaled(k, pushed[k])).reshape(
                    experiment.measured.shape)
                answers[k] += _answers(experiment, change, float(shift))
        found.append(Place(entry.name, entry.component, *inputs.judged(
            [np.array(columns).T for columns in answers], problem)))
    for c, channel in enumerate(problem.experiments[0].channels):
        found.append(Place(f'reading of {channel}', channel, *inputs.judged(
            [_readings(experiment, c) for experiment in problem.experiments], problem)))
    return sorted(found, key=lambda place: -place.evidence)


def components(found: Sequence[Place]) -> dict[str, float]:
    """Return how likely each part of the machine is, by its best place; all sum to 1."""
    best: dict[str, float] = {}
    for place in found:
        best[place.component] = max(best.get(place.component, 0.0), place.evidence)
    top = max(best.values(), default=0.0)
    weight = {name: float(np.exp(_CAUTION * (value - top))) for name, value in best.items()}
    total = sum(weight.values())
    return {name: value / total for name, value in weight.items()}


def _starts(shift: float, end: float) -> Iterator[tuple[float, float]]:
    """Yield when each pulse of a comb begins [s], and its sign."""
    for i, start in enumerate(np.arange(shift, end, ANSWER_S)):
        yield float(start), 1.0 if i % 2 == 0 else -1.0


def _comb(time: FloatArray, shift: float) -> FloatArray:
    """Return pulses of alternating sign, the first beginning at `shift` [s]."""
    value = np.zeros_like(time)
    for start, sign in _starts(shift, float(time[-1]) + 1.0):
        value += sign * np.maximum(0.0, 1.0 - np.abs(time - start - RISE_S) / RISE_S)
    return value


def _answers(experiment: Experiment, change: FloatArray, shift: float) -> list[FloatArray]:
    """Return the answer to each pulse of a comb, without what lasts from the ones before."""
    found = []
    for start, sign in _starts(shift, float(experiment.time[-1]) - 2.0 * RISE_S):
        first, last = np.searchsorted(experiment.time, [start, start + ANSWER_S])
        answer = np.zeros_like(change)
        answer[first:last] = sign * (change[first:last] - change[first])
        found.append(answer.ravel())
    return found


def _readings(experiment: Experiment, channel: int) -> FloatArray:
    """Return a reading's own pulses, one in each column, shape (n c, pulses)."""
    starts = np.arange(0.0, float(experiment.time[-1]) - 2.0 * RISE_S, RISE_S)
    columns = np.zeros((*experiment.measured.shape, starts.size))
    columns[:, channel, :] = np.maximum(
        0.0, 1.0 - np.abs(experiment.time[:, np.newaxis] - starts - RISE_S) / RISE_S)
    return columns.reshape(-1, starts.size)


class _Inputs:
    """What is to be explained, with the offsets taken out."""

    def __init__(self, residual: FloatArray, weight: FloatArray, offsets: FloatArray,
                 pull: FloatArray) -> None:
        self._residual, self._weight, self._offsets = residual, weight, offsets
        weighted = offsets * weight[:, np.newaxis]
        square = offsets.T @ weighted + np.diag(pull)
        self._inverse = np.linalg.pinv(square, hermitian=True)
        self._slope = weighted.T @ residual
        self._weighted = weighted
        self._energy = float(residual @ (weight * residual)
                             - self._slope @ self._inverse @ self._slope)
        self._count = float(np.count_nonzero(weight))

    def judged(self, answers: Sequence[FloatArray], problem: Problem) -> tuple[float, float]:
        """Return evidence for an input with these answers, and the share that it explains."""
        squares, slopes, crosses = [], [], []
        for k, columns in enumerate(answers):
            rows = problem.rows(k)
            weighted = columns * self._weight[rows, np.newaxis]
            squares.append(columns.T @ weighted)
            slopes.append(weighted.T @ self._residual[rows])
            crosses.append(self._weighted[rows].T @ columns)
        cross = np.concatenate(crosses, axis=1)
        taken = cross.T @ self._inverse
        square = linalg.block_diag(*squares) - taken @ cross
        slope = np.concatenate(slopes) - taken @ self._slope
        size = float(np.trace(square)) / len(square)
        if size <= 0.0:
            return 0.0, 0.0
        values, vectors = np.linalg.eigh(0.5 * (square + square.T) / size)
        values = np.maximum(values, 0.0)
        along = (vectors.T @ slope) ** 2 / size
        best, share = 0.0, 0.0
        for ratio in _RATIOS:
            left = self._energy - float(np.sum(along / (values + 1.0 / ratio)))
            left = max(left / self._energy, 1e-9)
            evidence = -0.5 * (self._count * np.log(left)
                               + float(np.sum(np.log1p(ratio * values))))
            if evidence > best:
                best, share = float(evidence), 1.0 - left
        return best, share
