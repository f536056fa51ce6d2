# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Fits to the whole tests, compared at the sensors' own noise; see `elimination`."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from statistics import fmean

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import same_noise, with_estimated_noise
from simgap.fit.starts import settled
from simgap.fit.state import FitState
from simgap.machine.contract import Form
from simgap.search.hypothesis import Hypothesis
from simgap.search.refitting import dropped, refitted, shared_jacobian, SharedJacobian, taken_over
from simgap.search.screening import screened, sensitivities
from simgap.search.single_fits import added


class FullFits:
    """Fits of `problem`, in `threads`; `progress` gets the share done and what is being done."""

    def __init__(self, problem: LeastSquares, progress: Callable[[float, str], None],
                 threads: int = 1) -> None:
        self._pool = ThreadPoolExecutor(threads)
        self.problem = problem
        self.settings = problem.settings.search
        self.progress = progress

    def compared(self, none: Hypothesis, singles: Sequence[Hypothesis],
                 pairs: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Fit the best of a search to the whole tests; return 'none', then the best first."""
        # all share the derivatives by the nuisances, taken again where the best is in each pass
        options = self.settings
        chosen = self._chosen(singles, pairs)
        anchor = min(chosen, key=self._priced)
        # the motion that was found may make readings noisier than the model without effects
        self.problem = LeastSquares(
            self.problem.machine.with_noise_at(anchor.state.point()),
            settings=self.problem.settings)
        before = np.inf
        for number in range(options.passes):
            self.progress(0.7 + 0.3 * number / options.passes, 'the best in full')
            shared = shared_jacobian(self.problem, anchor.state, chosen)
            # the first pass is never the last, and only the last one's Hessian is asked for
            fitted = partial(self._refitted, shared, number > 0)
            if not number and len(anchor.effects) > 1:
                # from far away, with the derivatives of a pair, a fit may get stuck
                place, first = next((i, h) for i, h in enumerate(chosen) if len(h.effects) == 1)
                own = shared_jacobian(self.problem, first.state, [first])
                chosen[place] = self._refitted(own, False, first)
            chosen = sorted(self._pool.map(fitted, chosen), key=self._priced)
            single = next(h for h in chosen if len(h.effects) == 1)
            bare = [none] if number else [none, self._dropped(single, single.effects[0])]
            none = min(self._pool.map(fitted, bare), key=self._priced)
            anchor = chosen[0] if self._priced(chosen[0]) < none.cost else none
            if number + 1 < options.passes and self._noise_taken(anchor):
                # costs compare at one and the same noise only
                before = np.inf
                continue
            reached = self._priced(anchor)
            chosen = [single, *self._within_reach(reached, (h for h in chosen if h is not single))]
            if number and before - reached < max(options.settled, options.settled_share * reached):
                break
            before = reached
        # the best form of each effect counts
        unique = {frozenset(h.effects): h for h in sorted(chosen, key=lambda h: -self._priced(h))}
        return [none, *sorted(unique.values(), key=self._priced)]

    def _chosen(self, singles: Sequence[Hypothesis],
                pairs: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return the best single effect, and what may turn out better than it."""
        options = self.settings
        least = min(self._priced(h) for h in (*singles, *pairs))
        chosen = [singles[0], *self._within_reach(least, (
            *singles[1:options.full_singles], *pairs[:options.full_pairs]))]
        if pairs and self._priced(pairs[0]) < self._priced(singles[0]):
            # each member alone, with the nuisances of the pair
            known = {(h.effects, h.forms) for h in chosen}
            chosen += [h for h in (self._dropped(pairs[0], e) for e in pairs[0].effects)
                       if (h.effects, h.forms) not in known]
        return chosen

    def _within_reach(self, least: float, hypotheses: Iterable[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses that are not too far behind the least price: fits stop early."""
        reach = max(self.settings.reach, self.settings.reach_share * least)
        return [h for h in hypotheses if self._priced(h) < least + reach]

    def _priced(self, hypothesis: Hypothesis) -> float:
        return hypothesis.penalised(self.problem.settings.penalty)

    def _dropped(self, hypothesis: Hypothesis, effect: str) -> Hypothesis:
        return dropped(self.problem.machine, hypothesis, effect)

    def _noise_taken(self, best: Hypothesis) -> bool:
        """Take the noise from what the best hypothesis leaves; return whether it is another."""
        machine = self.problem.machine
        point = best.state.point()
        predicted = machine.simulate([point])[0]
        residuals = [e.measured - p for e, p in zip(machine.experiments, predicted, strict=True)
                     if p is not None]
        experiments = with_estimated_noise(
            machine.experiments, residuals, self.problem.settings.noise)
        if same_noise(experiments[0], machine.experiments[0], self.problem.settings.noise):
            return False
        self.problem = LeastSquares(machine.with_experiments(experiments),
                                    settings=self.problem.settings)
        return True

    def converged(self, hypothesis: Hypothesis) -> Hypothesis:
        """Go on with a fit, with fresh derivatives, as long as that gains much."""
        options = self.settings
        return replace(hypothesis, state=settled(
            self.problem, hypothesis.state, options, options.final_passes,
            options.full_iterations))

    def with_another(self, hypothesis: Hypothesis) -> list[Hypothesis]:
        """Return a hypothesis whose fit has converged with each of a few more effects."""
        base = hypothesis.with_jacobian(self.problem)
        known = sensitivities(self.problem, base.state, self._pool.map)
        promising = [item for gain, item in screened(
            self.problem, base.state, known, base.effects)[:self.settings.partners]
            if gain > self.settings.partner_gain]
        return list(self._pool.map(lambda item: added(
            self.problem, base, item, item.jacobian, self.settings.full_iterations,
            ).without_jacobian(keep_hessian=True), promising))

    def leaves_much(self, hypothesis: Hypothesis) -> bool:
        """Return whether a hypothesis leaves more than noise in the whole tests."""
        return self.problem.leaves_much(hypothesis.state)

    def at_noise_of(self, best: Hypothesis, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses at the noise of one of them: slow noise may be a missing effect."""
        if not self._noise_taken(best):
            return list(hypotheses)
        return [replace(h, state=self.problem.evaluated(h.state)) for h in hypotheses]

    def without(self, hypothesis: Hypothesis, effect: str) -> Hypothesis:
        """Return a hypothesis without one of its effects, fitted until it has converged."""
        rest = self._dropped(hypothesis, effect)
        state = self.problem.start(rest.state.parameters, rest.state.point(), central=True)
        return self._ended(rest.effects, rest.forms, state)

    def simpler(self, hypothesis: Hypothesis) -> list[tuple[str, str]]:
        """Return which effects could be simpler ones that they become, each with such a one."""
        effects = self.problem.machine.catalogue
        return [(effect, other) for effect in hypothesis.effects
                for other in effects[effect].simpler if other not in hypothesis.effects]

    def elsewhere(self, hypothesis: Hypothesis) -> list[tuple[str, str]]:
        """Return which effects could act in another place, each with the effect there."""
        return [(effect, other.id) for effect in hypothesis.effects
                for other, _ in self.problem.machine.catalogue.relatives(effect)
                if other.id not in hypothesis.effects]

    def exchanged(self, hypothesis: Hypothesis, effect: str, other: str) -> Hypothesis:
        """Return a converged hypothesis with another effect in the place of one of its own."""
        # the fit begins at the size that does most of what the former has done
        machine = self.problem.machine
        rest, form = self._dropped(hypothesis, effect), machine.catalogue[other].forms[0]
        point = {**rest.state.point(), **form.start}
        bare = self.problem.residuals(point)
        done = bare - self.problem.residuals(hypothesis.state.point())
        columns = self.problem.jacobian(point, form.parameters, bare, central=True)
        sizes = np.linalg.lstsq(columns.astype(float), done, rcond=None)[0]
        point.update({p.name: float(np.clip(size, p.low, p.high))
                      for p, size in zip(form.parameters, sizes, strict=True) if not p.is_shape})
        point, kept = taken_over(machine, point, [*rest.forms, form], rest.state.parameters)
        state = self.problem.start((*kept, *form.parameters), point)
        return self._ended((*rest.effects, other), (*rest.forms, form), state)

    def joined(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """Return one effect in all its places instead of in each, converged; None if not alike."""
        machine, effects = self.problem.machine, self.problem.machine.catalogue
        whole = next((item for item in effects.values()
                      if item.parts and set(item.parts) == set(hypothesis.effects)), None)
        if whole is None:
            return None
        form, *others = {
            machine.catalogue.counterpart(form, effects[effect], whole)
            for effect, form in zip(hypothesis.effects, hypothesis.forms, strict=True)}
        if others:
            return None
        point = hypothesis.state.point()
        for p, *own in zip(form.parameters, *(f.parameters for f in hypothesis.forms),
                           strict=True):
            point[p.name] = fmean(point.pop(part.name) for part in own)
        names = hypothesis.parameters_of(hypothesis.effects)
        free = {p.name: p for p in machine.nuisances}
        nuisances = [free.get(p.name, p) for p in hypothesis.state.parameters
                     if p.name not in names]
        state = self.problem.start((*nuisances, *form.parameters), point)
        return self._ended((whole.id,), (form,), state)

    def _ended(self, effects: tuple[str, ...], forms: tuple[Form, ...],
               state: FitState) -> Hypothesis:
        """Return a hypothesis fitted from a state until it has converged."""
        found = Hypothesis(effects, forms, self.problem.fit(state, self.settings.iterations))
        return self.converged(found).without_jacobian(keep_hessian=True)

    def _refitted(self, shared: SharedJacobian, keep_hessian: bool,
                  hypothesis: Hypothesis) -> Hypothesis:
        return refitted(self.problem, shared, self.settings.full_iterations,
                        hypothesis).without_jacobian(keep_hessian)
