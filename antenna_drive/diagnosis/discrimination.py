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
How well a planned test would tell rivals apart.

The criterion is T-optimality: a test is good if the rival that is wrong fits badly however its
numbers follow (A. C. Atkinson, V. V. Fedorov, Biometrika 62, 1975), with prior probabilities and
prior knowledge of the numbers (A. C. Ponce de Leon, A. C. Atkinson, Biometrika 78, 1991). Here all
tolerances follow, as far as the tests so far leave them free. To first order this is a projection;
`Separation` is therefore a promise, which a fit of each rival to the readings of the others keeps
or breaks.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

from antenna_drive.diagnosis.least_squares import LeastSquares, proper_precision
from antenna_drive.diagnosis.machine import FloatArray, Form, Machine, Parameter, Point
from antenna_drive.diagnosis.noise import with_model_error
from antenna_drive.diagnosis.rivals import Rival
from antenna_drive.diagnosis.settings import DEFAULT, Settings
import numpy as np
from scipy import linalg

# A fit goes this many standard deviations away at most, and a difference quotient this far.
_FAR, _STEP = 8.0, 0.3
# relative precision of a product of single-precision columns
_SINGLE = 1e-6


@dataclass(frozen=True)
class Separation:
    """
    What a planned test tells of r rivals.

    Attributes
    ----------
    prior : probability of each rival before the test, shape (r,)
    lack : half the chi-square by which rival j fits worse than i if i is true, shape (r, r)

    """

    prior: FloatArray
    lack: FloatArray

    def posterior(self, temperature: float) -> FloatArray:
        """Return the probability of rival j after the test if i is true, shape (r, r)."""
        logits = np.log(np.maximum(self.prior, 1e-12)) - self.lack / temperature
        weights = np.exp(logits - logits.max(axis=1, keepdims=True))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def expected(self, temperature: float) -> float:
        """Return the probability that the answer is right after the test, if one of them is."""
        return float(self.prior @ np.diag(self.posterior(temperature)))


def separation(machine: Machine, rivals: Sequence[Rival], inflated: float,
               settings: Settings = DEFAULT, follow: bool = True) -> Separation:
    """
    Return how well the planned tests of a machine would tell rivals apart.

    Parameters
    ----------
    machine
        in the planned tests; what they measured does not count
    rivals
        of a verdict, r of them
    inflated
        by what the cost's differences are divided
    settings
        thresholds
    follow
        False to leave the numbers as they are: more than can be told, found without derivatives

    Raises
    ------
    KeyError : the machine's catalogue lacks an effect or a form

    """
    forms = [rival.forms_of(machine) for rival in rivals]
    points = [known_to(machine, rival) for rival in rivals]
    readings = machine.simulate(points)
    likeliest = int(np.argmax([rival.probability for rival in rivals]))
    problem = LeastSquares(_measured(machine, readings[likeliest], settings), settings=settings)
    residuals = [problem.residuals(point) for point in points]
    lack = np.zeros((len(rivals), len(rivals)))
    for j, rival in enumerate(rivals):
        off = [residuals[j] - residual for residual in residuals]
        followed = _followed(problem, rival, forms[j], points[j], off, inflated) if follow else (
            np.zeros(len(rivals)))
        lack[:, j] = [0.5 * max(float(z @ z) - gain, 0.0) / inflated
                      for z, gain in zip(off, followed, strict=True)]
    prior = np.array([rival.probability for rival in rivals])
    return Separation(prior / prior.sum(), lack)


def refitted(machine: Machine, rivals: Sequence[Rival], inflated: float,
             settings: Settings = DEFAULT) -> Separation:
    """
    Return the same as `separation`, with each rival fitted to the readings of each other one.

    Parameters, errors raised : as in `separation`
    """
    points = [known_to(machine, rival) for rival in rivals]
    readings = machine.simulate(points)
    continued = [_Continued(machine, rival, inflated) for rival in rivals]
    lack = np.zeros((len(rivals), len(rivals)))
    for i, truth in enumerate(readings):
        measured = _measured(machine, truth, settings).experiments
        for j, rival in enumerate(continued):
            if i != j:
                problem = LeastSquares(rival.with_experiments(measured), settings=settings)
                state = problem.start(rival.nuisances, {})
                for _ in range(settings.planning.passes):
                    state = problem.refreshed(problem.fit(
                        state, settings.search.iterations), central=False)
                lack[i, j] = problem.fit(state, settings.search.iterations).cost / inflated
    prior = np.array([rival.probability for rival in rivals])
    return Separation(prior / prior.sum(), lack)


class _Continued(Machine):
    """
    A machine whose numbers count from where the tests so far have left them.

    Each of its numbers is a standard deviation along one direction that the tests have left free.
    """

    def __init__(self, machine: Machine, rival: Rival, inflated: float) -> None:
        """Take a rival's numbers and their covariance."""
        numbers = [*machine.nuisances,
                   *(p for form in rival.forms_of(machine) for p in form.parameters)]
        self._machine = machine
        self._known = [p for p in numbers if p.name in rival.names]
        self._centre = np.array([rival.point[p.name] for p in self._known])
        values, vectors = np.linalg.eigh(rival.covariance_of([p.name for p in self._known]))
        self._directions = vectors * np.sqrt(np.maximum(values, 0.0))
        free = [Parameter(f'direction {k}', '1', -_FAR, _FAR, _STEP, 1.0 / np.sqrt(inflated))
                for k in range(len(self._known))]
        super().__init__(machine.experiments,
                         [*free, *(p for p in numbers if p.name not in rival.names)])
        self._free = [p.name for p in free]

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the readings of one experiment."""
        return self._machine.predict(self._own(point), experiment)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = np.inf) -> list[list[FloatArray | None]]:
        """Return the readings of several variants; see `Machine.simulate`."""
        return self._machine.simulate([self._own(point) for point in points], only, until)

    def low_fidelity(self) -> Machine:
        """Return the same with the faster machine."""
        other = copy(self)
        other._machine = self._machine.low_fidelity()
        return other

    def _own(self, point: Point) -> dict[str, float]:
        """Return a point in the machine's own numbers, each within its bounds."""
        along = np.array([point.get(name, 0.0) for name in self._free])
        values = self._centre + self._directions @ along
        return {**{name: value for name, value in point.items() if name not in self._free},
                **{p.name: float(min(max(value, p.low), p.high))
                   for p, value in zip(self._known, values, strict=True)}}


def _followed(problem: LeastSquares, rival: Rival, forms: Sequence[Form], point: dict[str, float],
              off: Sequence[FloatArray], inflated: float) -> FloatArray:
    """Return by how much each chi-square falls as a rival's numbers follow, shape (r,)."""
    numbers = [*problem.machine.nuisances, *(p for form in forms for p in form.parameters)]
    jacobian = problem.jacobian(point, numbers, problem.residuals(point), central=False)
    known = (jacobian.T @ jacobian).astype(float) + _precision(rival, numbers, inflated)
    scale = np.sqrt(np.diag(known))
    factor = linalg.cho_factor(known / np.outer(scale, scale) + _SINGLE * np.eye(scale.size))
    slopes = np.array([(jacobian.T @ z.astype(np.float32)).astype(float) for z in off]) / scale
    return np.asarray(np.sum(slopes * linalg.cho_solve(factor, slopes.T).T, axis=1))


def known_to(machine: Machine, rival: Rival) -> dict[str, float]:
    """Return a rival's values as far as the planned tests have these numbers."""
    own = {p.name for form in rival.forms_of(machine) for p in form.parameters}
    own |= {p.name for p in machine.nuisances}
    return {name: value for name, value in rival.point.items() if name in own}


def _measured(machine: Machine, readings: Sequence[FloatArray | None],
              settings: Settings) -> Machine:
    """Return the machine with readings as measured, and with the error that a model may have."""
    experiments = [replace(e, measured=values) for e, values in zip(
        machine.experiments, readings, strict=True) if values is not None]
    return machine.with_experiments(with_model_error(experiments, settings.noise))


def _precision(rival: Rival, numbers: Sequence[Parameter], inflated: float) -> FloatArray:
    """Return what is known of a planned test's numbers, from tests so far or from priors."""
    precision = np.diag(proper_precision(numbers))
    places = [j for j, p in enumerate(numbers) if p.name in rival.names]
    known = rival.covariance_of([numbers[j].name for j in places])
    scale = np.sqrt(np.maximum(np.diag(known), 1e-30))
    inverse = linalg.pinvh(known / np.outer(scale, scale)) / np.outer(scale, scale)
    # the costs are divided by the inflation in the end, which the covariance holds already
    precision[np.ix_(places, places)] = inverse * inflated
    return precision
