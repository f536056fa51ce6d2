# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How well a planned test would tell rivals apart.

The criterion is T-optimality: a test is good if a wrong rival fits badly however its numbers
follow (A. C. Atkinson, V. V. Fedorov, Biometrika 62, 57, 1975; for several rivals, the same
volume, 289). It goes back to W. G. Hunter, A. M. Reiner (Technometrics 7, 307, 1965), who hold
the numbers at their fitted values, and takes prior probabilities and prior knowledge of the
numbers into account as A. C. Ponce de Leon, A. C. Atkinson (Biometrika 78, 601, 1991) do. The
criterion of G. E. P. Box, W. J. Hill (Technometrics 9, 57, 1967) weighs rivals in the same way,
and sees a wrong rival's numbers through the variance of its prediction alone. With a hundred
tolerances, that variance is as large as the readings. How far the numbers can follow must be
known sample by sample, which T-optimality asks.

The lack of fit of every pair becomes probabilities as in a verdict. The logarithm of what the
true rival gets, in the mean over the rivals, is the information that the test is expected to give.

To first order the best that a rival can do is a projection (`separation`). That is a promise. A
fit of each rival to the readings of the others keeps or breaks it (`refitted`).

In most open verdicts, one answer names one effect more than the other. The simpler answer already
misses the readings by hundreds of units. The verdict is open because it doubts that the effect is
larger than its tolerance. A smaller deviation of the effect's size or a larger gain ends the
doubt: see `doubts`. Two such rivals are told apart by no more than the doubt falls
(`Separation.odds`). D_s-optimality asks for the same: A. C. Atkinson, A. N. Donev, R. D. Tobias,
Optimum Experimental Designs (2007), section 10.3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import permutations
import math

import numpy as np
from scipy import linalg
from simgap.fit.cholesky import factored, ROUNDING, solved
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_model_error
from simgap.fit.state import proper_precision
from simgap.machine.arrays import FloatArray, Point
from simgap.machine.effect import Parameter
from simgap.machine.machine import Machine
from simgap.next_test.rivals import Rival
from simgap.settings import DEFAULT, Settings
from simgap.verdict.doubts import Doubt

# A fit goes this many standard deviations away at most, and a difference quotient this far.
_FAR, _STEP = 8.0, 0.3
# A rival as good as impossible is no less probable than this.
_LEAST = 1e-12


@dataclass(frozen=True)
class Separation:
    """
    What a planned test tells of r rivals.

    Attributes
    ----------
    prior : probability of each rival before the test, shape (r,)
    lack : half the chi-square by which rival j fits worse than i if i is true, shape (r, r)
    channels : share of that which each signal gives; empty where it was not asked for
    points : where the fit of rival j to the readings of i ended, by (i, j); empty without fits
    odds : logarithm of the odds that rival j loses to i at most if i is true, because the verdict
        doubts an effect that only one of them names, shape (r, r); infinite for all other pairs
    shrunk : for each rival the share to which deviations of sizes shrink, by name

    """

    prior: FloatArray
    lack: FloatArray
    channels: Mapping[str, float] = field(default_factory=dict)
    points: Mapping[tuple[int, int], Point] = field(default_factory=dict)
    odds: FloatArray = field(default_factory=lambda: np.array(np.inf))
    shrunk: Sequence[Mapping[str, float]] = ()

    def evidence(self, temperature: float) -> FloatArray:
        """Return the logarithm of the odds that rival j loses to i if i is true, shape (r, r)."""
        return np.asarray(np.minimum(self.lack / temperature, self.odds))

    def posterior(self, temperature: float, caution: float = 1.0) -> FloatArray:
        """
        Return the probability of rival j after the test if i is true, shape (r, r).

        The evidence is divided by `caution`.
        """
        logits = np.log(np.maximum(self.prior, _LEAST)) - self.evidence(temperature) / caution
        weights = np.exp(logits - logits.max(axis=1, keepdims=True))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def expected(self, temperature: float) -> float:
        """Return the probability that the true rival is expected to get, if one of them is."""
        return float(self.prior @ np.diag(self.posterior(temperature)))

    def information(self, temperature: float, caution: float = 1.0) -> float:
        """Return the information on which rival is true that is expected, in nats."""
        after = np.maximum(np.diag(self.posterior(temperature, caution)), _LEAST)
        return float(self.prior @ np.log(after / np.maximum(self.prior, _LEAST)))

    def surely(self, temperature: float, sure: float) -> float:
        """Return how probable it is that the true rival gets at least the probability `sure`."""
        return float(self.prior @ (np.diag(self.posterior(temperature)) >= sure))

    def least_lack(self) -> FloatArray:
        """Return by how much two rivals are told apart at least, whichever is true, (r, r)."""
        return np.asarray(np.minimum(self.lack, self.lack.T))


def separation(machine: Machine, rivals: Sequence[Rival], inflated: float,
               settings: Settings = DEFAULT, follow: bool = True) -> Separation:
    """
    Return how well the planned tests of a machine would tell rivals apart, to first order.

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
        (Hunter and Reiner's criterion)

    Raises
    ------
    KeyError : the machine's catalogue lacks an effect or a form

    """
    points = [known_to(machine, rival) for rival in rivals]
    problem = _problem(machine, rivals, points, settings)
    residuals = np.array([problem.residuals(point) for point in points])
    prior, lack = _prior(rivals), np.zeros((len(rivals), len(rivals)))
    channels = problem.experiments[0].channels
    power = np.zeros(len(channels))
    shrunk: list[dict[str, float]] = []
    for j, rival in enumerate(rivals):
        off = residuals[j] - residuals
        price = np.zeros(len(rivals))
        rest = off
        if follow:
            price, rest, shares = _followed(problem, rival, points[j], off, inflated)
            shrunk.append(shares)
        lack[:, j] = 0.5 * (np.sum(rest ** 2, axis=1) + price) / inflated
        power += prior @ np.sum(rest.reshape(len(rivals), -1, power.size) ** 2, axis=1)
    if not follow:
        shrunk = [_shrunk_at_most(rivals, i, lack[i]) for i in range(len(rivals))]
    parts = power / max(float(power.sum()), _LEAST)
    return Separation(prior, lack, dict(zip(channels, parts.tolist(), strict=True)),
                      odds=_odds(rivals, lack, shrunk), shrunk=shrunk)


def refitted(machine: Machine, rivals: Sequence[Rival], inflated: float,
             settings: Settings = DEFAULT, shrunk: Sequence[Mapping[str, float]] = (),
             ) -> Separation:
    """
    Return the same as `separation`, with each rival fitted to the readings of each other one.

    The true rival is fitted as well, from a standard deviation away along each direction. A fit
    that sticks there would stick in a diagnosis, which compares two fits. What it leaves is no
    evidence against the others.

    Parameters
    ----------
    machine, rivals, inflated, settings
        as in `separation`
    shrunk
        what that has found of deviations; without it they stay as they are

    Raises
    ------
    as `separation`

    """
    points = [known_to(machine, rival) for rival in rivals]
    problem = _problem(machine, rivals, points, settings)
    readings = machine.simulate(points)
    left = np.zeros((len(rivals), len(rivals)))
    ends: dict[tuple[int, int], Point] = {}
    for j, rival in enumerate(rivals):
        own = _Continued(problem.machine, rival, inflated)
        jacobian = None
        for i, truth in enumerate(readings):
            fitted = LeastSquares(own.with_experiments([
                replace(e, measured=values) for e, values in zip(
                    problem.experiments, truth, strict=True) if values is not None]),
                settings=settings)
            if i == j:
                state = fitted.start(own.nuisances, own.elsewhere(), None)
            else:
                state = fitted.start(own.nuisances, {}, jacobian)
                # it depends on the point, and not on what was measured
                jacobian = state.base_jacobian
            state = fitted.fit(state, settings.search.iterations)
            for _ in range(settings.planning.passes):
                state = fitted.fit(fitted.refreshed(state), settings.search.iterations)
            left[i, j] = state.cost / inflated
            ends[i, j] = own.own(state.point())
    lack = np.maximum(left - np.diag(left)[:, np.newaxis], 0.0)
    shrunk = shrunk or [{} for _ in rivals]
    return Separation(_prior(rivals), lack, points=ends, odds=_odds(rivals, lack, shrunk),
                      shrunk=shrunk)


def deviations(machine: Machine, rival: Rival, inflated: float,
               settings: Settings = DEFAULT) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """
    Return how well the planned tests of a machine would determine the numbers of a rival.

    Parameters
    ----------
    machine, inflated, settings
        as in `separation`
    rival
        of a verdict

    Returns
    -------
    names of its m known numbers, and their covariances before and after, shape (m, m) each

    """
    point = known_to(machine, rival)
    problem = _problem(machine, [rival], [point], settings)
    numbers = _numbers(machine, rival)
    jacobian = problem.jacobian(point, numbers, problem.residuals(point), central=False)
    known = (jacobian.T @ jacobian).astype(float) + _precision(rival, numbers, inflated)
    names = [p.name for p in numbers if p.name in rival.names]
    places = [j for j, p in enumerate(numbers) if p.name in rival.names]
    scale = np.sqrt(np.diag(known))
    unit = np.outer(scale, scale)
    inverse = solved(factored(known / unit, ROUNDING), np.eye(scale.size)) / unit
    return (tuple(names), rival.covariance_of(names),
            np.asarray(inflated * inverse[np.ix_(places, places)]))


class _Continued(Machine):
    """
    A machine whose numbers count from where the tests so far have left them.

    Each of its numbers is a standard deviation along one direction that the tests have left free.
    """

    def __init__(self, machine: Machine, rival: Rival, inflated: float) -> None:
        """Take a rival's numbers and their covariance."""
        numbers = _numbers(machine, rival)
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
        return self._machine.predict(self.own(point), experiment)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = np.inf) -> list[list[FloatArray | None]]:
        """Return the readings of several variants; see `Machine.simulate`."""
        return self._machine.simulate([self.own(point) for point in points], only, until)

    def low_fidelity(self) -> Machine:
        """Return the same with the faster machine."""
        other = copy(self)
        other._machine = self._machine.low_fidelity()
        return other

    def elsewhere(self) -> dict[str, float]:
        """Return a point a standard deviation away along each direction, to one side or other."""
        signs = np.random.default_rng(0).choice([-1.0, 1.0], len(self._free))
        return dict(zip(self._free, signs.tolist(), strict=True))

    def own(self, point: Point) -> dict[str, float]:
        """Return a point in the machine's own numbers, each within its bounds."""
        along = np.array([point.get(name, 0.0) for name in self._free])
        values = self._centre + self._directions @ along
        return {**{name: value for name, value in point.items() if name not in self._free},
                **{p.name: float(min(max(value, p.low), p.high))
                   for p, value in zip(self._known, values, strict=True)}}


def known_to(machine: Machine, rival: Rival) -> dict[str, float]:
    """Return a rival's values as far as the planned tests have these numbers."""
    own = {p.name for p in _numbers(machine, rival)}
    return {name: value for name, value in rival.point.items() if name in own}


def _numbers(machine: Machine, rival: Rival) -> list[Parameter]:
    return [*machine.nuisances, *(p for form in rival.forms_of(machine) for p in form.parameters)]


def _prior(rivals: Sequence[Rival]) -> FloatArray:
    prior = np.array([rival.probability for rival in rivals])
    return np.asarray(prior / prior.sum())


def _odds(rivals: Sequence[Rival], lack: FloatArray, shrunk: Sequence[Mapping[str, float]],
          ) -> FloatArray:
    """Return what doubts leave of the evidence, see `Separation.odds`."""
    odds = np.full(lack.shape, np.inf)
    for i, j in permutations(range(len(rivals)), 2):
        one, other = rivals[i], rivals[j]
        more = set(one.named) - set(other.named)
        if more and set(other.named) < set(one.named) and more <= set(one.doubts):
            odds[[i, j], [j, i]] = sum(
                _ended(doubt, one.deviation(doubt.size), shrunk[i].get(doubt.size, 1.0),
                       float(lack[i, j]))
                for doubt in (one.doubts[effect] for effect in sorted(more)))
    return odds


def _ended(doubt: Doubt, known: float, share: float, gain: float) -> FloatArray:
    """
    Return the logarithms of the odds by which a test moves a doubt, shape (2,).

    By how much the doubt falls if the effect is there, and by how much the effect does if not.

    Parameters
    ----------
    doubt
        before the test
    known, share
        deviation of its size from the readings alone, and the share to which that shrinks
    gain
        that the test adds if the effect is there

    """
    # what follows from a tolerance, or from how tests differ, does not shrink
    after = replace(doubt, deviation=math.sqrt(max(
        doubt.deviation ** 2 - (1.0 - share ** 2) * known ** 2, _LEAST)))
    # a gain that no fit has told will not be told by the next one either
    there = replace(after, gain=doubt.gain + gain if doubt.gain else 0.0)
    # the size of what is not there goes to zero as it gets certain
    absent = replace(after, excess=doubt.excess * share ** 2)
    return doubt.slope * np.log([there.certainty / doubt.certainty,
                                 doubt.certainty / absent.certainty])


def _shrunk_at_most(rivals: Sequence[Rival], i: int, lack: FloatArray) -> dict[str, float]:
    """Return the share to which deviations of a rival shrink if no other number follows."""
    found: dict[str, float] = {}
    for doubt in rivals[i].doubts.values():
        for j, other in enumerate(rivals):
            apart = rivals[i].point[doubt.size] - other.point.get(doubt.size, 0.0)
            if j != i and apart:
                share = 1.0 / math.sqrt(
                    1.0 + 2.0 * lack[j] * (rivals[i].deviation(doubt.size) / apart) ** 2)
                found[doubt.size] = max(share, found.get(doubt.size, 0.0))
    return found


def _problem(machine: Machine, rivals: Sequence[Rival], points: Sequence[Point],
             settings: Settings) -> LeastSquares:
    """Return the planned tests as the likeliest rival makes them, with a model's usual error."""
    likeliest = int(np.argmax([rival.probability for rival in rivals]))
    [readings] = machine.simulate([points[likeliest]])
    experiments = [replace(e, measured=values) for e, values in zip(
        machine.experiments, readings, strict=True) if values is not None]
    return LeastSquares(machine.with_experiments(with_model_error(experiments, settings.noise)),
                        settings=settings)


def _followed(problem: LeastSquares, rival: Rival, point: dict[str, float], off: FloatArray,
              inflated: float) -> tuple[FloatArray, FloatArray, dict[str, float]]:
    """
    Return what remains of differences after a rival's numbers have followed them.

    Parameters
    ----------
    problem, rival, point, inflated
        the planned tests, and the rival where it is
    off
        differences in standard deviations, shape (r, n)

    Returns
    -------
    what the steps away from what is known add to each chi-square, shape (r,), the differences that
    are left, in standard deviations, shape (r, n), and the share to which the deviation of each
    size in doubt shrinks

    """
    numbers = _numbers(problem.machine, rival)
    if not numbers:
        return np.zeros(len(off)), off, {}
    jacobian = problem.jacobian(point, numbers, problem.residuals(point), central=False)
    precision = _precision(rival, numbers, inflated)
    known = (jacobian.T @ jacobian).astype(float) + precision
    scale = np.sqrt(np.diag(known))
    slopes = (off.astype(np.float32) @ jacobian).astype(float) / scale
    factor = factored(known / np.outer(scale, scale), ROUNDING)
    steps = solved(factor, slopes.T).T / scale
    in_doubt = {doubt.size for doubt in rival.doubts.values()}
    shares = {}
    for place, name in enumerate(p.name for p in numbers):
        if name in in_doubt:
            unit = np.eye(scale.size)[place]
            variance = inflated * solved(factor, unit)[place] / scale[place] ** 2
            shares[name] = min(math.sqrt(max(variance, 0.0)) / rival.deviation(name), 1.0)
    # summed directly: the difference of two large sums in single precision cannot resolve it
    return (np.asarray(np.sum((steps @ precision) * steps, axis=1)),
            np.asarray(off - steps @ jacobian.T), shares)


def _precision(rival: Rival, numbers: Sequence[Parameter], inflated: float) -> FloatArray:
    """Return what is known of a planned test's numbers, from tests so far or from priors."""
    precision = np.diag(proper_precision(numbers))
    places = [j for j, p in enumerate(numbers) if p.name in rival.names]
    if not places:
        return precision
    known = rival.covariance_of([numbers[j].name for j in places])
    scale = np.sqrt(np.maximum(np.diag(known), 1e-30))
    unit = np.outer(scale, scale)
    # the digits of a file leave eigenvalues near zero of either sign: well known, not unknown
    values, vectors = linalg.eigh(known / unit)
    inverse = vectors / np.maximum(values, ROUNDING * values[-1]) @ vectors.T / unit
    # the costs are divided by the inflation in the end, which the covariance holds already
    precision[np.ix_(places, places)] = inverse * inflated
    return precision
