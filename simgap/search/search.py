# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The search for effects: from the nuisances alone over single effects to pairs."""

from bisect import insort
from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import led, settled, with_initial_conditions
from simgap.fit.state import FitState
from simgap.machine.contract import Form, Point
from simgap.next_test.rivals import Rival
from simgap.search.continued import continued
from simgap.search.hypothesis import Hypothesis
from simgap.search.refitting import dropped, refitted, shared_jacobian
from simgap.search.screening import (
    jacobian_of_form, rescaled, scan, screened, sensitivities, Sensitivity,
)
from simgap.search.single_fits import added, added_at, gone_on, moved, others_than, split


class Search:
    """The search for missing effects; `progress` gets the share done and what is being done."""

    def __init__(self, problem: LeastSquares, progress: Callable[[float, str], None],
                 threads: int = 1, earlier: Sequence[Rival] = ()) -> None:
        self._pool, self._earlier = ThreadPoolExecutor(threads), earlier
        self.settings = problem.settings.search
        self.machine = problem.machine.truncated()
        self.problem = LeastSquares(self.machine, settings=problem.settings)
        self.progress = progress
        self.sensitivities: list[Sensitivity] = []
        # what the earlier answers do for all tests, at the sensors' own noise
        self._earlier_fits: list[Hypothesis] = []

    def run(self) -> tuple[Hypothesis, list[Hypothesis], list[Hypothesis]]:
        """Return the nuisances alone, and what one effect and two can do, each the best first."""
        self.progress(0.0, 'nuisances')
        self._earlier_fits = continued(self.problem, self._earlier, self._pool.map)
        none, singles = self._none_and_singles()
        singles = self._at_lower_noise(singles)
        singles = self._leading_fits(singles, self._to_settle(singles[0]))
        if self.problem.scale > 1.0:
            singles = self._at_lower_noise(self._exchanged(singles))
        self.progress(0.5, 'pairs of effects')
        pairs = self._pairs(singles)
        if pairs:
            scale = self.problem.scale
            pairs = self._improved(self._at_lower_noise(pairs))
            # costs compare at one and the same noise only
            singles = [replace(h, state=self.problem.rescaled(h.state, scale)) for h in singles]
        self.progress(0.7, 'the best in full')
        return none, singles, pairs

    def _none_and_singles(self) -> tuple[Hypothesis, list[Hypothesis]]:
        """Fit the nuisances alone and with single effects, again where the former got stuck."""
        none = self._nuisances_alone()
        singles = self._singles(none)
        for _ in range(self.settings.fresh_starts):
            freed = self._freed(none, singles[0])
            if freed is None:
                break
            none, singles = freed, self._singles(freed)
        return none, singles

    def _earlier_answers(self) -> list[Hypothesis]:
        """Return the earlier answers as they fit all tests, with costs at the present noise."""
        return [replace(h, state=self.problem.rescaled(h.state, 1.0)) for h in self._earlier_fits]

    def _nuisances_alone(self) -> Hypothesis:
        iterations = self.settings.iterations
        point = self._beginning()
        first = self.problem.start(self.machine.nuisances, point)
        self.problem = self._at_noise(self.problem.noise_level(first.residual))
        state = self.problem.start(self.machine.nuisances, point,
                                   first.jacobian / self.problem.scale)
        return Hypothesis((), (), self._at_falling_noise(self.problem.fit(state, iterations)))

    def _beginning(self) -> dict[str, float]:
        """Return the nuisances as configured, or as the earlier answer has them that fits best."""
        names = {p.name for p in self.machine.nuisances}
        begins: list[Point] = [{}, *(
            {name: value for name, value in known.state.point().items() if name in names}
            for known in self._earlier_fits)]
        return min((with_initial_conditions(self.problem, dict(begin)) for begin in begins),
                   key=lambda point: self.problem.loss(self.problem.residuals(point)))

    def _at_falling_noise(self, state: FitState) -> FitState:
        """Go on with a fit of the nuisances alone, with the noise that it leaves."""
        iterations = self.settings.iterations
        for _ in range(self.settings.first_passes):
            before, cost = self.problem.scale, state.cost
            self.problem = self._at_noise(min(before, self.problem.noise_level(state.residual)))
            point = with_initial_conditions(self.problem, state.point())
            state = self.problem.fit(self.problem.start(self.machine.nuisances, point), iterations)
            if self.problem.scale > self.settings.sharper * before and (
                    before > 1.0 or cost - state.cost < self.settings.first_gain * cost):
                break
        return state

    def _freed(self, none: Hypothesis, best: Hypothesis) -> Hypothesis | None:
        """Return the nuisances from where the best single effect ended; None if as before."""
        # An effect of next to no size may gain much, because its fit went round what held the fit
        # of the nuisances alone. By its curvature the effect itself gains little.
        gain = none.cost - best.cost
        own = self.settings.stuck * gain
        if best.has_course or best.loss_without(best.effects[0]) > own:
            return None
        bare = dropped(self.machine, best, best.effects[0]).state
        state = self.problem.fit(
            self.problem.start(bare.parameters, bare.point()), self.settings.iterations)
        if state.cost > best.cost + own:
            return None
        return Hypothesis((), (), self._at_falling_noise(state))

    def _at_noise(self, level: float) -> LeastSquares:
        """Return the problem with the misfit as noise, or the sensors' noise if it is small."""
        return self.problem.at_scale(level if level > self.settings.strong else 1.0)

    def _at_lower_noise(self, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Lower the noise to what the best hypothesis leaves, and fit the best again."""
        found = list(hypotheses)
        for _ in range(self.settings.scale_passes):
            best = found[0].state
            level = self.problem.noise_level(best.residual)
            problem = self._at_noise(min(self.problem.scale, level))
            if problem.scale > self.settings.sharper * self.problem.scale:
                break
            self.sensitivities = rescaled(self.sensitivities, self.problem.scale / problem.scale)
            self.problem = problem
            finalists = found[:self.settings.most_finalists]
            shared = shared_jacobian(problem, best, finalists)
            found = self._sorted(partial(
                refitted, problem, shared, self.settings.iterations), finalists)
        return found

    def _take_sensitivities(self, state: FitState) -> None:
        self.sensitivities = sensitivities(self.problem, state, self._pool.map)

    def _sorted(self, fitted: Callable[[Any], Hypothesis], of: Iterable[Any],
                full: int | None = None) -> list[Hypothesis]:
        # Only the first `full` keep their Jacobians, which take most of the memory; None for all.
        found: list[Hypothesis] = []
        for hypothesis in self._pool.map(fitted, of):
            insort(found, hypothesis, key=self._priced)
            if full is not None:
                found[full:] = [h.without_jacobian() for h in found[full:]]
        return found

    def _priced(self, hypothesis: Hypothesis) -> float:
        return hypothesis.penalised(self.problem.settings.penalty)

    def _singles(self, none: Hypothesis) -> list[Hypothesis]:
        options = self.settings
        self.progress(0.15, 'sensitivity to each effect')
        self._take_sensitivities(none.state)
        self.progress(0.25, 'single effects')
        found = self._sorted(
            lambda entry: added(self.problem, none, entry[1], entry[1].jacobian,
                                options.first_iterations),
            screened(self.problem, none.state, self.sensitivities)[:options.singles],
            options.finalists)
        if self.problem.leaves_much(none.state):
            found += self._sorted(
                lambda entry: added_at(self.problem, none, *entry),
                scan(self.problem, none.state, self.sensitivities), options.finalists)
            found.sort(key=self._priced)
        self.progress(0.35, 'single effects')
        leading = self._sorted(lambda h: gone_on(self.problem, h, options.iterations),
                               found[:options.finalists])
        if self.problem.leaves_much(leading[0].state):
            leading = self._with_better(leading, self._led_by_tests(
                none, [h.effects[0] for h in leading[:options.bases]]))
        leading = self._with_better(
            leading, (h for h in self._earlier_answers() if len(h.effects) == 1))
        leading[:2] = self._sorted(self._fitted_again, leading[:2])
        leading = self._with_relatives(leading)
        return [*leading[:options.bases], *(h.without_jacobian() for h in leading[options.bases:])]

    def _led_by_tests(self, none: Hypothesis, known: Collection[str]) -> list[Hypothesis]:
        """Return the effects that tests promise, each fitted to its test and then to all."""
        # A creep in which motors stick holds every fit to all tests in one of its minima, and what
        # it promises there is wrong. Another test alone may still show what is missing.
        asked: dict[str, tuple[int, Form]] = {}
        for k in range(len(self.problem.experiments)):
            weight = np.zeros_like(none.state.weight)
            weight[self.problem.rows(k)] = none.state.weight[self.problem.rows(k)]
            promises = screened(
                self.problem, replace(none.state, weight=weight), self.sensitivities)
            best = next((item for _, item in promises if not item.form.is_course), None)
            if best is not None and best.effect not in known:
                asked.setdefault(best.effect, (k, best.form))

        def fitted(entry: tuple[str, tuple[int, Form]]) -> Hypothesis:
            effect, (k, form) = entry
            part = self.problem.of_experiment(k)
            start = part.start(
                (*none.state.parameters, *form.parameters),
                with_initial_conditions(part, {**none.state.point(), **form.start}))
            state = part.fit(start, self.settings.settling_iterations)
            return self._fitted_again(Hypothesis((effect,), (form,), state))

        return list(self._pool.map(fitted, asked.items()))

    def _fitted_again(self, hypothesis: Hypothesis) -> Hypothesis:
        point = with_initial_conditions(self.problem, hypothesis.state.point())
        state = self.problem.start(hypothesis.state.parameters, point)
        return replace(hypothesis, state=self.problem.fit(
            state, self.settings.settling_iterations))

    def _to_settle(self, best: Hypothesis) -> int:
        """Return how many fits to go on with: more if the best leaves much and may be wrong."""
        return (self.settings.most_finalists if self.problem.leaves_much(best.state)
                else self.settings.bases)

    def _leading_fits(self, hypotheses: Sequence[Hypothesis], count: int) -> list[Hypothesis]:
        """Go on with the best fits: one that has stopped early hides what its effect can do."""
        options = self.settings

        def went_on(hypothesis: Hypothesis) -> Hypothesis:
            state = settled(self.problem, hypothesis.state, options, options.settling_passes,
                            options.settling_iterations)
            if self.problem.leaves_much(state) and not hypothesis.has_course:
                state = led(self.problem, state, options)
            return replace(hypothesis, state=state)

        leading = self._pool.map(went_on, hypotheses[:count])
        return sorted([*leading, *hypotheses[count:]], key=self._priced)

    def _with_relatives(self, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses with the same effects in other places added, the best first."""
        # Each begins with the nuisances of the best and at a size that does as much. From far away
        # its fit may have ended elsewhere, and 'both motors' then lost to one.
        best = hypotheses[0]
        return self._with_better(hypotheses, self._pool.map(
            lambda item: moved(self.problem, best, *item),
            [(place, *item) for place in range(len(best.effects))
             for item in self.machine.catalogue.relatives(best.effects[place])
             if item[0].id not in best.effects]))

    def _exchanged(self, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses with those that a scan finds in the place of a best effect."""
        # The nuisances alone were bent by the effect that is missing. With those of the best
        # effect another one may fit better: gravity in place of a steady wind.
        best = hypotheses[0]
        if best.has_course:
            return list(hypotheses)
        found: list[Hypothesis] = []
        for place, effect in enumerate(best.effects):
            bare, kept = dropped(self.machine, best, effect), others_than(best, best.forms[place])
            bare = replace(bare, state=self.problem.start(
                bare.state.parameters, bare.state.point(), best.state.jacobian[:, kept]))
            found += self._pool.map(
                partial(lambda base, entry: added_at(self.problem, base, *entry), bare),
                scan(self.problem, bare.state, self.sensitivities, bare.effects))
        return self._with_better(hypotheses, found)

    def _with_better(self, hypotheses: Sequence[Hypothesis],
                     others: Iterable[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses and others, of those with the same effects the better, sorted."""
        found = {frozenset(zip(h.effects, h.forms, strict=True)): h for h in hypotheses}
        for new in others:
            key = frozenset(zip(new.effects, new.forms, strict=True))
            if key not in found or self._priced(new) < self._priced(found[key]):
                found[key] = new
        return sorted(found.values(), key=self._priced)

    def _pairs(self, singles: Sequence[Hypothesis]) -> list[Hypothesis]:
        options = self.settings
        best = singles[0]
        # beside the best, another effect may look different: it may have hidden a ripple
        if self.problem.leaves_much(best.state):
            self._take_sensitivities(best.state)
        worth = max(options.partner_gain, options.partner_gain_share * best.cost)
        found = {tuple(sorted(pair.effects)): pair
                 for pair in self._earlier_answers() if len(pair.effects) > 1}
        for i, base in enumerate(singles[:options.bases]):
            self.progress(0.5 + 0.2 * i / options.bases, 'pairs of effects')
            far = self._priced(base) > options.base_ratio * self._priced(best) + options.reach
            if far or (base.has_course and base is not best):
                continue
            # settled, an effect may pay more, and fall behind one that has not been
            base = base.with_jacobian(self.problem)
            partners: list[tuple[Sensitivity, Point | None]] = [
                (item, None) for gain, item in screened(
                    self.problem, base.state, self.sensitivities,
                    base.effects)[:options.partners] if gain > worth]
            pairs = self._sorted(partial(self._partnered, best, base), partners, 0)
            if self.problem.scale > 1.0 and not i:
                pairs += self._sorted(partial(self._partnered, best, base), scan(
                    self.problem, base.state, self.sensitivities, base.effects), 0)
            pairs += [pair.without_jacobian() for pair in split(self.problem, base)]
            for pair in pairs:
                key = tuple(sorted(pair.effects))
                if key not in found or self._priced(pair) < self._priced(found[key]):
                    found[key] = pair
        return sorted(found.values(), key=self._priced)

    def _improved(self, pairs: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Go on with the best pair, and try others in the place of each of its effects."""
        found = self._with_relatives(self._leading_fits(pairs, self.settings.bases))
        if self.problem.scale > 1.0:
            found = self._at_lower_noise(self._exchanged(found))
        return found

    def _partnered(self, best: Hypothesis, base: Hypothesis,
                   partner: tuple[Sensitivity, Point | None]) -> Hypothesis:
        """Give a hypothesis a partner, from sizes if they are given."""
        item, sizes = partner
        if sizes is None:
            pair = added(self.problem, base, item,
                         jacobian_of_form(self.problem, base.state, item.form),
                         self.settings.first_iterations)
        else:
            pair = added_at(self.problem, base, item, sizes)
        if pair.cost < best.cost:
            return gone_on(self.problem, pair, self.settings.pair_iterations)
        return pair
