# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Judge effects on a withheld test, to which offsets within the tolerance are fitted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from statistics import fmean

import numpy as np
from simgap.fit.broyden import weighted_product
from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import led, settled, with_initial_conditions
from simgap.fit.state import FitState, prior_precision
from simgap.machine.contract import FloatArray, Form, Machine, Parameter
from simgap.search.hypothesis import Hypothesis
from simgap.search.training import begun, Part, Slopes, trained
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
        none, best = (h.with_jacobian(problem) for h in (none, best))
        self._none, self._best = none, best
        self._without, self._with = (Slopes.of(problem, h.state) for h in (none, best))
        self._start: dict[str, float] = {}
        for form in best.forms:
            self._start.update(form.start)
        self._effects = {p.name for form in best.forms for p in form.parameters}
        self._nuisances = [p for p in best.state.parameters if p.name not in self._effects]
        if best.effects or len(problem.experiments) == 1:
            at = with_initial_conditions(problem, self._start)
            self._neutral = Slopes.of(problem, problem.start(best.state.parameters, at))

    def _trained(self, part: Part) -> tuple[LeastSquares, FitState, FitState]:
        """Return a part's problem, and its fits without and with the effects."""
        problem = LeastSquares(part, settings=self._settings)
        own = part.parameters(self._best.state.parameters)
        start = begun(part, self._best.forms, self._start, self._settings)
        found = trained(part, own, start, [
            slopes.for_part(part, own) for slopes in (self._neutral, self._with)], self._settings)
        if not self._best.effects:
            return problem, found, found
        if problem.leaves_much(found) and not self._best.has_course:
            found = led(problem, found, self._settings.search)
        found = self._finished(problem, found)
        # The fit without effects begins where the one with them ended. It is run to its end only
        # where that could matter.
        bare = part.parameters(self._none.state.parameters)
        unaided = problem.fit(
            problem.start(bare, found.point(), self._without.for_part(part, bare)),
            self._settings.held_out.iterations)
        search = self._settings.search
        if unaided.cost < (1.0 + search.doubtful) * found.cost or problem.leaves_much(found):
            options = self._settings.held_out
            unaided = settled(problem, unaided, search, options.passes, options.iterations)
            found = self._finished(problem, min(
                found, self._added(problem, part, unaided), key=lambda s: s.cost))
        return problem, unaided, self._taken_over(problem, found)

    def _taken_over(self, problem: LeastSquares, found: FitState) -> FitState:
        """Return a training fit whose effects alone stand for their numbers."""
        # Only they are taken to the withheld test. What a tolerance has of them would be lost.
        at, _ = self._problem.machine.nuisances.take_over(found.point(), self._best.forms)
        if at == found.point():
            return found
        return problem.start(found.parameters, at, found.jacobian)

    def _finished(self, problem: LeastSquares, found: FitState) -> FitState:
        """Go on with a training fit while it is in a local minimum and gains."""
        # It gets fresh derivatives. Initial conditions that were chosen before the fit may not be
        # the best after it, and are chosen again.
        options = self._settings.held_out
        for _ in range(options.further_passes):
            if not self._in_local_minimum(problem, found):
                break
            begin, before = found.point(), found.cost
            starts = [found]
            if (at := with_initial_conditions(problem, begin)) != begin:
                moved = problem.start(found.parameters, at, found.jacobian)
                starts.append(problem.fit(moved, options.iterations))
            found = min((problem.fit(problem.refreshed(state), options.iterations)
                         for state in starts), key=lambda state: state.cost)
            if before - found.cost < self._settings.fit.least_gain:
                break
        return found

    def _added(self, problem: LeastSquares, part: Part, unaided: FitState) -> FitState:
        """Fit the effects on top of a fit without them."""
        # A fit of everything at once may bend the nuisances to what a ripple does, and stop there.
        own = part.parameters([p for p in self._best.state.parameters if p.name in self._effects])
        point = {**unaided.point(), **self._start}
        state = problem.start_from(part.parameters(self._nuisances), unaided.jacobian, own, point)
        return trained(part, state.parameters, point, [state.jacobian], self._settings)

    def _in_local_minimum(self, problem: LeastSquares, found: FitState) -> bool:
        """Return whether the fit to all tests fits some of them better than `found` does."""
        # Those values have seen what is withheld. A training fit takes nothing from them.
        of_all = problem.start(found.parameters, self._best.state.point(), found.base_jacobian)
        return of_all.cost < found.cost - self._settings.penalty.parameter

    def _undetermined(self, problem: LeastSquares, unaided: FitState, found: FitState,
                      ) -> tuple[dict[str, str], FloatArray]:
        """Return the reasons why effects cannot be judged, by id, and the fit's covariance."""
        own = [v for p, v in zip(found.parameters, inflation(problem, found), strict=True)
               if p.name in self._effects]
        posterior = covariance(found, fmean(own or [1.0]), self._settings.interval)
        price = self._settings.penalty.parameter
        gain = unaided.cost - found.cost
        stuck = self._in_local_minimum(problem, found)
        reasons = {}
        for effect, form in zip(self._best.effects, self._best.forms, strict=True):
            if form.is_course or any(p.experiment is not None for p in form.parameters):
                reasons[effect] = 'its numbers belong to one test alone'
            elif stuck:
                reasons[effect] = 'the fit to the training data stopped in a local minimum'
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
        for effect, form in zip(self._best.effects, self._best.forms, strict=True):
            for key, value in {p.label for p in form.parameters if p.label}:
                if test.labels.get(key, '') == value and not any(
                        e.labels.get(key, '') == value for e in training.experiments):
                    reasons[effect] = f'no other test has the label {key}: {value}'
        return reasons

    def withheld(self, k: int) -> Withheld:
        """Judge on test k what the other tests have taught."""
        machine, groups = self._problem.machine, self._groups
        testing = Part(machine, [k])
        bare = self._fitted(testing, self._none.state.parameters, {}, self._none.state.point(),
                            self._without)
        problem = LeastSquares(testing, settings=self._settings)
        fold = self._fold(k, _gap(testing, bare.point()), problem.residuals_of(bare, 0))
        if not self._best.effects:
            return fold
        part = Part(machine, [i for i, group in enumerate(groups) if group != groups[k]])
        training, unaided, found = self._trained(part)
        reasons, posterior = self._undetermined(training, unaided, found)
        reasons = {**reasons, **self._unseen_labels(testing, part)}
        fold = replace(fold, reasons=reasons)
        numbers = self._numbers(reasons)
        if not numbers:
            return fold
        held = {**dict.fromkeys(self._effects, 0.0), **self._start,
                **{p.name: found.value(p.name) for p in numbers}}
        # the nuisances begin where training has left them
        own = {p.name for p in testing.parameters(self._nuisances) if p.experiment is not None}
        begin = {name: value for name, value in found.point().items() if name not in own}
        state = self._fitted(testing, self._nuisances, held, {**begin, **held}, self._with)
        # They begin again where the fit without effects has left them, or the fit to all tests.
        # The loss of a fit hardly sees what is wrong for a moment, such as where a motor starts.
        worse = np.sum(np.square(state.residual)) > np.sum(np.square(bare.residual))
        others = [(bare.point(), self._without)] if worse or problem.leaves_much(state) else []
        if self._in_local_minimum(
                LeastSquares(testing.holding(held), settings=self._settings), state):
            others.append((self._best.state.point(), self._with))
        state = min([state, *(
            self._fitted(testing, self._nuisances, held, {**other, **held}, slopes)
            for other, slopes in others)], key=lambda fit: fit.cost)
        point = {**held, **state.point()}
        fold = replace(fold, reasons={**reasons, **self._unseen(problem, point, state.residual,
                                                                reasons)})
        known = np.linalg.pinv(state.hessian + np.diag(prior_precision(state.parameters)))

        def followed(drawn: FloatArray) -> FloatArray:
            # what a draw leaves once the offsets have followed it
            changes = (drawn - state.residual).T.astype(np.float32)
            steps = known @ weighted_product(state.jacobian, state.weight, changes)
            return drawn - (state.jacobian @ steps.astype(np.float32)).T

        return self._completed(fold, problem, point, state.residual, found, posterior, followed)

    def second_half(self, k: int) -> Withheld:
        """Judge on the second half of a test what the first half has taught."""
        machine, whole = self._problem.machine, self._problem.experiments[k]
        middle = 0.5 * (whole.time[0] + whole.time[-1])  # a window may begin later than its run
        first = (whole.time < middle)[:, np.newaxis]
        part, testing = (
            Part(machine, [k], [replace(whole, measured=np.where(used, whole.measured, np.nan))])
            for used in (first, ~first))
        problem, unaided, found = self._trained(part)
        own = LeastSquares(testing, settings=self._settings)
        fold = self._fold(k, _gap(testing, unaided.point()),
                          _shaped(own, own.residuals(unaided.point())))
        if not self._best.effects:
            return fold
        reasons, posterior = self._undetermined(problem, unaided, found)
        fold = replace(fold, reasons=reasons)
        numbers = self._numbers(reasons)
        if not numbers:
            return fold
        left_out = {p.name for effect, form in zip(self._best.effects, self._best.forms,
                                                   strict=True)
                    if effect in reasons for p in form.sizes}
        point = {**found.point(), **dict.fromkeys(left_out, 0.0)}
        residual = own.residuals(point)
        fold = replace(fold, reasons={**reasons, **self._unseen(own, point, residual, reasons)})
        return self._completed(fold, own, point, residual, found, posterior)

    def _unseen(self, problem: LeastSquares, point: dict[str, float], residual: FloatArray,
                reasons: Mapping[str, str]) -> dict[str, str]:
        """Return the reasons why effects cannot be judged that a withheld test does not show."""
        # A limit that a test does not reach changes nothing there, whatever its derivative says.
        # `residual` is that at the point.
        unseen = {}
        for effect, form in zip(self._best.effects, self._best.forms, strict=True):
            if effect not in reasons:
                without = problem.residuals({**point, **{p.name: 0.0 for p in form.sizes}})
                if 0.5 * float(np.sum(np.square(residual - without))) < (
                        self._settings.penalty.parameter):
                    unseen[effect] = 'the withheld data do not show it'
        return unseen

    def _numbers(self, reasons: Mapping[str, str]) -> list[Parameter]:
        return [p for effect, form in zip(self._best.effects, self._best.forms, strict=True)
                if effect not in reasons for p in form.parameters]

    def _fold(self, k: int, gap: FloatArray, before: FloatArray) -> Withheld:
        experiment = self._problem.experiments[k]
        return Withheld(experiment.name, experiment.time, gap, before)

    def _completed(self, fold: Withheld, problem: LeastSquares, point: Mapping[str, float],
                   residual: FloatArray, found: FitState, posterior: FloatArray,
                   followed: Callable[[FloatArray], FloatArray] = lambda drawn: drawn) -> Withheld:
        """Return a fold with what remains, and with draws of the numbers that can be judged."""
        # `point` and `residual`, shape (n c,), are where the withheld test is judged; `found` and
        # `posterior` are the fit to the training data and its covariance. `followed` returns, of
        # residuals with draws, shape (draws, n c), those left once the nuisances have followed.
        numbers = self._numbers(fold.reasons)
        if not numbers:
            return fold
        names = [p.name for p in found.parameters]
        places = [names.index(p.name) for p in numbers]
        # rounding may leave the least variance just below zero
        draws = np.random.default_rng(0).multivariate_normal(
            found.x[places], posterior[np.ix_(places, places)], self._settings.held_out.draws,
            method='eigh', check_valid='ignore')
        drawn = followed(problem.residuals_at([
            {**point, **{p.name: min(max(value, p.low), p.high)
                         for p, value in zip(numbers, draw, strict=True)}}
            for draw in draws.tolist()]))
        return replace(
            fold, judged=tuple(e for e in self._best.effects if e not in fold.reasons),
            gap_after=_gap(problem.machine, point),
            after=_shaped(problem, residual),
            names=tuple(p.name for p in numbers), values=found.x[places],
            drawn=np.array([_shaped(problem, z) for z in drawn]))

    def _fitted(self, testing: Part, nuisances: Sequence[Parameter], held: Mapping[str, float],
                begin: Mapping[str, float], slopes: Slopes) -> FitState:
        own = testing.parameters(nuisances)
        return trained(testing.holding(held), own, begin, [slopes.for_part(testing, own)],
                       self._settings)


def _gap(machine: Machine, point: Mapping[str, float]) -> FloatArray:
    """Return measured minus predicted of a single test, shape (n, c)."""
    return machine.experiments[0].measured - machine.predict(point, 0)


def _shaped(problem: LeastSquares, residual: FloatArray) -> FloatArray:
    """Return the residuals of a single test, NaN where nothing is judged, shape (n, c)."""
    shape = problem.experiments[0].measured.shape
    return np.where(problem.valid, residual, np.nan).reshape(shape)


def _deviations(form: Form, found: FitState, posterior: FloatArray) -> float:
    """Return how far the sizes of an effect are from zero, in standard deviations."""
    names = [p.name for p in found.parameters]
    places = [names.index(p.name) for p in form.sizes]
    sizes = found.x[places]
    square = float(sizes @ np.linalg.pinv(posterior[np.ix_(places, places)]) @ sizes)
    return math.sqrt(max(square, 0.0) / len(places))
