# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Judge effects on a withheld test, to which offsets within the tolerance are fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from statistics import fmean

import numpy as np
from simgap.fit.broyden import weighted_product
from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import settled
from simgap.fit.state import FitState, prior_precision
from simgap.machine.contract import FloatArray, Form, Machine, Parameter
from simgap.machine.part import Part
from simgap.search.hypothesis import Hypothesis
from simgap.settings import Settings
from simgap.verdict.intervals import covariance, inflation


@dataclass(frozen=True)
class Withheld:
    """A test that was withheld."""

    name: str  # of the test
    time: FloatArray  # shape (n,) [s]
    # measured minus predicted without effects, as read, shape (n, c); NaN: not judged
    gap_before: FloatArray
    before: FloatArray  # in standard deviations of the noise, whitened
    gap_after: FloatArray | None = None  # with the effects that can be judged; None if none can
    after: FloatArray | None = None  # in standard deviations likewise
    judged: tuple[str, ...] = ()  # ids of these effects
    reasons: Mapping[str, str] = field(default_factory=dict)  # why others cannot be judged
    names: tuple[str, ...] = ()  # numbers of the judged effects
    values: FloatArray = field(default_factory=lambda: np.zeros(0))  # of these numbers
    drawn: FloatArray | None = None  # `after` with draws of them, shape (draws, n, c)


class Judge:
    """Judges a hypothesis on each test in turn."""

    def __init__(self, problem: LeastSquares, none: Hypothesis, best: Hypothesis,
                 groups: Sequence[str]) -> None:
        self._problem = problem
        self._groups = groups
        self._settings: Settings = problem.settings
        self._none, self._best = (h.with_jacobian(problem) for h in (none, best))
        self._start = {name: value for form in best.forms for name, value in form.start.items()}
        self._effects = {p.name for form in best.forms for p in form.parameters}
        self._nuisances = [p for p in best.state.parameters if p.name not in self._effects]

    def _fitted(self, problem: LeastSquares, part: Part, numbers: Sequence[Parameter],
                begin: Mapping[str, float], of_all: Hypothesis) -> FitState:
        """Fit some numbers to a part of the tests, with the derivatives of a fit to all."""
        # Where it begins has seen what is withheld; where it ends, the part alone decides. What
        # the part does not determine is not judged, see `_undetermined`.
        own, whole = part.parameters(numbers), of_all.state.jacobian
        column = {p.name: j for j, p in enumerate(of_all.state.parameters)}
        slopes = np.concatenate([whole[self._problem.rows(k)] for k in part.chosen])[
            :, [column[p.name] for p in own]]
        start = problem.start(own, dict(begin), slopes)
        return problem.fit(start, self._settings.search.iterations)

    def _trained(self, part: Part) -> tuple[LeastSquares, FitState, FitState]:
        """Return a part's problem, and its fits without and with the effects."""
        problem = self._problem.of(part)
        unaided = self._fitted(problem, part, self._none.state.parameters,
                               self._none.state.point(), self._none)
        if not self._best.effects:
            return problem, unaided, unaided
        # The effects are added to the fit without them. The values of the fit to all tests have
        # seen what is withheld: they serve only where they show that this ends in a worse minimum.
        point = {**unaided.point(), **self._start}
        for form in self._best.forms:
            point = min([point, *({**point, **trial} for trial in form.trials)],
                        key=lambda trial: problem.loss(problem.residuals(trial)))
        added = part.parameters([p for p in self._best.state.parameters
                                 if p.name in self._effects])
        fresh = problem.jacobian(point, added, None, central=True)
        start = problem.start((*unaided.parameters, *added), point,
                              np.column_stack([unaided.jacobian, fresh]))
        found = settled(problem, problem.fit(start, self._settings.search.iterations), 1)
        of_all = {name: value for name, value in self._best.state.point().items()
                  if name in {p.name for p in found.parameters}}
        if problem.start(found.parameters, of_all, found.base_jacobian).cost < (
                found.cost - self._settings.evidence.number):
            found = settled(problem, self._fitted(
                problem, part, self._best.state.parameters, of_all, self._best), 1)
        return problem, unaided, found

    def _undetermined(self, problem: LeastSquares, unaided: FitState, found: FitState,
                      ) -> tuple[dict[str, str], FloatArray]:
        """Return the reasons why effects cannot be judged, by id, and the fit's covariance."""
        own = [v for p, v in zip(found.parameters, inflation(problem, found), strict=True)
               if p.name in self._effects]
        posterior = covariance(found, fmean(own or [1.0]), self._settings.interval)
        price = self._settings.evidence.number
        gain = unaided.cost - found.cost
        reasons = {}
        for effect, form in self._best.items:
            if any(p.experiment is not None for p in form.parameters):
                reasons[effect] = 'its numbers belong to one test alone'
            elif gain < price:
                reasons[effect] = (f'the training data gain {max(gain, 0.0):.1f} by the effects, '
                                   f'less than the price of a parameter, {price:g}')
            else:
                ratio = _deviations(form, found, posterior)
                if ratio < 1.0:
                    reasons[effect] = ('the training data do not determine it: its value is '
                                       f'{ratio:.1f} standard deviations')
        return reasons, posterior

    def _unseen_labels(self, testing: Part, training: Part) -> dict[str, str]:
        """Return the reasons why effects cannot be judged whose label training does not have."""
        [test] = testing.experiments
        reasons = {}
        for effect, form in self._best.items:
            for key, value in {p.label for p in form.parameters if p.label}:
                if test.labels.get(key, '') == value and not any(
                        e.labels.get(key, '') == value for e in training.experiments):
                    reasons[effect] = f'no other test has the label {key}: {value}'
        return reasons

    def withheld(self, k: int) -> Withheld:
        """Judge on test k what the other tests have taught."""
        testing, part = self._parts(k)
        problem = self._problem.of(testing)
        bare = self._fitted(problem, testing, self._none.state.parameters,
                            self._none.state.point(), self._none)
        [test] = testing.experiments
        fold = Withheld(test.name, test.time, _gap(testing, bare.point()),
                        problem.of_test(bare.residual, 0))
        if not self._best.effects:
            return fold
        training, unaided, found = self._trained(part)
        reasons, posterior = self._undetermined(training, unaided, found)
        reasons = {**reasons, **self._unseen_labels(testing, part)}
        fold = replace(fold, reasons=reasons)
        numbers = self._numbers(reasons)
        if not numbers:
            return fold
        held = {**dict.fromkeys(self._effects, 0.0), **self._start,
                **{p.name: found.point()[p.name] for p in numbers}}
        holding = testing.holding(held)
        # the nuisances begin where all tests, or training and this test alone, have left them
        following = problem.of(holding)
        own = {p.name for p in testing.parameters(self._nuisances)}
        begin = min((self._best.state.point(), {**bare.point(), **found.point()}),
                    key=lambda point: following.loss(
                        following.residuals({name: point[name] for name in own})))
        state = self._fitted(following, holding, self._nuisances, begin, self._best)
        point = {**held, **state.point()}
        fold = replace(fold, reasons={**reasons, **self._unseen(problem, point, state.residual,
                                                                reasons)})
        return self._completed(fold, problem, point, state, found, posterior)

    def _parts(self, k: int) -> tuple[Part, Part]:
        """Return test k and all of other groups; of a single test its second and first half."""
        machine, groups = self._problem.machine, self._groups
        if len(machine.experiments) > 1:
            return Part(machine, [k]), Part(machine, [
                i for i, group in enumerate(groups) if group != groups[k]])
        whole = machine.experiments[k]
        middle = 0.5 * (whole.time[0] + whole.time[-1])  # a window may begin later than its run
        first = (whole.time < middle)[:, np.newaxis]
        testing, training = (
            Part(machine, [k], [replace(whole, measured=np.where(used, whole.measured, np.nan))])
            for used in (~first, first))
        return testing, training

    def _unseen(self, problem: LeastSquares, point: dict[str, float], residual: FloatArray,
                reasons: Mapping[str, str]) -> dict[str, str]:
        """Return the reasons why effects cannot be judged that a withheld test does not show."""
        # A limit that a test does not reach changes nothing there, whatever its derivative says.
        # `residual` is that at the point.
        unseen = {}
        for effect, form in self._best.items:
            if effect not in reasons:
                without = problem.residuals({**point, **{p.name: 0.0 for p in form.sizes}})
                if 0.5 * float(np.sum(np.square(residual - without))) < (
                        self._settings.evidence.number):
                    unseen[effect] = 'the withheld data do not show it'
        return unseen

    def _numbers(self, reasons: Mapping[str, str]) -> list[Parameter]:
        return [p for effect, form in self._best.items
                if effect not in reasons for p in form.parameters]

    def _completed(self, fold: Withheld, problem: LeastSquares, point: Mapping[str, float],
                   state: FitState, found: FitState, posterior: FloatArray) -> Withheld:
        """Return a fold with what remains, and with draws of the numbers that can be judged."""
        # `state` is a fit of the nuisances to the withheld test, at `point`; `found` and
        # `posterior` are the fit to the training data and its covariance
        numbers = self._numbers(fold.reasons)
        if not numbers:
            return fold
        names = [p.name for p in found.parameters]
        places = [names.index(p.name) for p in numbers]
        # rounding may leave the least variance just below zero
        draws = np.random.default_rng(0).multivariate_normal(
            found.x[places], posterior[np.ix_(places, places)], self._settings.held_out.draws,
            method='eigh', check_valid='ignore')
        drawn = problem.residuals_at([
            {**point, **{p.name: min(max(value, p.low), p.high)
                         for p, value in zip(numbers, draw, strict=True)}}
            for draw in draws.tolist()])
        # what a draw leaves once the offsets have followed it
        known = np.linalg.pinv(state.hessian + np.diag(prior_precision(state.parameters)))
        changes = (drawn - state.residual).T.astype(np.float32)
        steps = known @ weighted_product(state.jacobian, state.weight, changes)
        drawn = drawn - (state.jacobian @ steps.astype(np.float32)).T
        return replace(
            fold, judged=tuple(e for e in self._best.effects if e not in fold.reasons),
            gap_after=_gap(problem.machine, point),
            after=problem.of_test(state.residual, 0),
            names=tuple(p.name for p in numbers), values=found.x[places],
            drawn=np.array([problem.of_test(z, 0) for z in drawn]))


def _gap(machine: Machine, point: Mapping[str, float]) -> FloatArray:
    """Return measured minus predicted of a single test, shape (n, c)."""
    return machine.experiments[0].measured - machine.predict(point, 0)


def _deviations(form: Form, found: FitState, posterior: FloatArray) -> float:
    """Return how far the sizes of an effect are from zero, in standard deviations."""
    names = [p.name for p in found.parameters]
    places = [names.index(p.name) for p in form.sizes]
    sizes = found.x[places]
    square = float(sizes @ np.linalg.pinv(posterior[np.ix_(places, places)]) @ sizes)
    return math.sqrt(max(square, 0.0) / len(places))
