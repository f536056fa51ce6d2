# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The search for effects: the best hypotheses are expanded until the best has been expanded.

The nuisances are fitted alone. While something strong is missing, the misfit counts as noise, and
the nuisances stay close to their priors. Effects are added that a screening by derivatives
promises, and those that fit best when their sizes are tried out. The noise is lowered to what the
best leaves. The best are expanded in turn by all moves (`moves`), and ranked by their evidence.
All this is done with coarser steps of the simulation and the beginning of each test. The best are
then fitted to the whole tests, at the noise that the best of them shows. Those that are near the
best get derivatives of their own. Whatever fits as well as the best is also fitted with one effect
less, and the best with two effects joined in one, or one size for all labels, until it stays.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_noise_left
from simgap.fit.starts import with_initial_conditions
from simgap.machine.contract import Form
from simgap.search import moves
from simgap.search.evidence import Evidence, temperature
from simgap.search.hypothesis import Hypothesis
from simgap.search.rival import Rival
from simgap.search.screening import same_effect, scan, screened, sensitivities, Sensitivity

Progress = Callable[[float, str], None]
Move = Callable[[], 'Hypothesis | None']


@dataclass(frozen=True)
class Found:
    """What a search has found."""

    problem: LeastSquares  # the whole tests, with the noise of the motion that was found
    hypotheses: Sequence[Hypothesis]  # the best first; the nuisances alone are among them
    evidence: Evidence  # by which they are ranked

    @property
    def best(self) -> Hypothesis:
        """Return the hypothesis with the greatest evidence."""
        return self.hypotheses[0]

    @property
    def none(self) -> Hypothesis:
        """Return the nuisances alone."""
        return next(h for h in self.hypotheses if not h.effects)


class Search:
    """The search for missing effects; `progress` gets the share done and what is being done."""

    def __init__(self, whole: LeastSquares, progress: Progress, threads: int = 1,
                 earlier: Sequence[Rival] = ()) -> None:
        self._pool = ThreadPoolExecutor(threads)
        self._whole, self._progress, self._earlier = whole, progress, earlier
        self._options = whole.settings.search
        self._problem = LeastSquares(whole.machine.truncated(), settings=whole.settings)
        self._found: dict[frozenset[str], Hypothesis] = {}
        self._sensitivities: list[Sensitivity] = []

    def run(self) -> Found:
        """Return the best hypotheses, fitted to the whole tests."""
        self._progress(0.0, 'nuisances')
        none = self._nuisances_alone()
        self._progress(0.1, 'sensitivity to each effect')
        self._sensitivities = sensitivities(self._problem, none.state, self._pool.map)
        self._keep([none])
        self._keep(self._continued(none))
        self._progress(0.2, 'single effects')
        self._make(self._additions(none, self._options.adds, scanning=True))
        self._lower_noise()
        self._expand()
        return self._compared()

    # -- the hypotheses ------------------------------------------------------------------------

    def _keep(self, hypotheses: Iterable[Hypothesis | None]) -> None:
        """Keep hypotheses; of those with the same effects the better one, net of its numbers."""
        def cost(h: Hypothesis) -> float:
            return h.cost + self._problem.settings.evidence.number * len(h.state.parameters)
        for h in hypotheses:
            if h is not None:
                known = self._found.get(frozenset(h.effects))
                if known is None or cost(h) < cost(known):
                    self._found[frozenset(h.effects)] = h
        # derivatives take most of the memory: the best keep theirs
        for h in self._ranked()[self._options.leading:]:
            if h.effects and h.state.base_jacobian.size:
                self._found[frozenset(h.effects)] = replace(
                    h, state=h.state.without_jacobian())

    def _evidence(self) -> Evidence:
        return Evidence.among(self._problem, list(self._found.values()))

    def _ranked(self) -> list[Hypothesis]:
        return self._evidence().ranked(list(self._found.values()))

    def _make(self, wanted: Iterable[Move]) -> None:
        self._keep(self._pool.map(lambda move: move(), wanted))

    # -- the moves -----------------------------------------------------------------------------

    def _additions(self, base: Hypothesis, count: int, scanning: bool) -> Iterator[Move]:
        """Yield moves that add what is promised most; what could not lead is not fitted."""
        problem, evidence, options = self._problem, self._evidence(), self._options
        top, unpaid = evidence(self._ranked()[0]), evidence(base) + evidence.price(base.forms)
        for gain, item in screened(
                problem, base.state, self._sensitivities, base.effects)[:count]:
            price = evidence.price((*base.forms, item.form))
            if unpaid + options.hope * gain - price > top:
                yield partial(moves.added, problem, base, item)
        if scanning and self._leaves_much(base):
            for item, sizes in scan(problem, base.state, self._sensitivities, base.effects):
                yield partial(moves.added, problem, base, item, sizes)

    def _changes(self, base: Hypothesis) -> Iterator[Move]:
        """Yield moves that take an effect away or put it elsewhere."""
        problem, catalogue = self._problem, self._problem.machine.catalogue
        for effect, was in base.items:
            yield partial(moves.dropped, problem, base, effect)
            rest = [other for other in base.effects if other != effect]
            for other in catalogue.relatives(effect):
                if not same_effect(catalogue, other.id, rest):
                    yield partial(moves.exchanged, problem, base, effect, other.id,
                                  catalogue.counterpart(was, catalogue[effect], other))
            for form in self._other_forms(effect, was):
                yield partial(moves.exchanged, problem, base, effect, effect, form)
            if catalogue[effect].parts:
                yield partial(moves.split, problem, base, effect)
        if len(base.effects) > 1:
            yield partial(moves.joined, problem, base)

    def _other_forms(self, effect: str, was: Form) -> list[Form]:
        """Return the other forms of an effect, as many as are worth a fit."""
        forms = [item.form for item in self._sensitivities
                 if item.effect == effect and item.form.name != was.name]
        return forms if len(forms) < self._options.partners else []

    def _expand(self) -> None:
        """Expand the best hypotheses, then the best alone, until it has been expanded."""
        options = self._options
        expanded: dict[frozenset[str], float] = {}
        number = 0
        while number < options.rounds:
            self._progress(0.3 + 0.3 * number / options.rounds, 'several effects')
            ranked, evidence = self._ranked(), self._evidence()
            top = evidence(ranked[0])
            leading = [h for h in ranked if h.effects and evidence(h) > top - evidence.reach
                       and (1.0 - options.settled) * expanded.get(
                           frozenset(h.effects), np.inf) > h.cost]
            if not leading or (number and leading[0] is not ranked[0]):
                break
            leading = [self._led(leading[0]), *(
                h.with_jacobian(self._problem)
                for h in leading[1:1 if number else options.leading])]
            self._keep(leading[:1])
            if self._lower_noise():
                continue  # a fit that still gains has not ended: what it lacks is not known yet
            number += 1
            # where little is left, derivatives say what is missing
            self._sensitivities = sensitivities(self._problem, leading[0].state, self._pool.map)
            for place, base in enumerate(leading):
                expanded[frozenset(base.effects)] = base.cost
                if len(base.effects) < options.rounds:
                    self._make(self._additions(base, options.partners, scanning=not place))
                self._make(self._changes(base))
            self._lower_noise()

    def _led(self, hypothesis: Hypothesis) -> Hypothesis:
        """Go on with a fit, and past local minima where it leaves much."""
        found = moves.settled(self._problem, hypothesis, 1)
        return moves.led(self._problem, found) if self._leaves_much(found) else found

    def _leaves_much(self, hypothesis: Hypothesis) -> bool:
        """Return whether a fit leaves more than noise: all the time, or loud for a while."""
        state = hypothesis.state
        return max(self._problem.noise_level(state.residual),
                   temperature(self._problem, state)) > self._options.strong

    # -- the noise -----------------------------------------------------------------------------

    def _nuisances_alone(self) -> Hypothesis:
        """Fit the nuisances alone, with the noise that they leave."""
        nuisances, iterations = self._problem.machine.nuisances, self._options.iterations
        point = with_initial_conditions(self._problem, self._beginning())
        first = self._problem.start(nuisances, point)
        self._problem = self._problem.at_noise(self._problem.noise_level(first.residual))
        state = self._problem.start(nuisances, point, first.jacobian / self._problem.scale)
        for _ in range(self._options.rounds):
            state = self._problem.fit(state, iterations)
            before = state.cost
            state = self._problem.fit(self._problem.refreshed(state), iterations)
            level, scale = self._problem.noise_level(state.residual), self._problem.scale
            if level > self._options.lower * scale and (
                    scale > 1.0 or before - state.cost < self._options.settled * before):
                break
            self._problem = self._problem.at_noise(level)
            state = self._problem.start(
                nuisances, state.point(), state.jacobian * (scale / self._problem.scale))
        return Hypothesis((), (), state)

    def _beginning(self) -> dict[str, float]:
        """Return the nuisances as configured, or as the earlier answer has them that fits best."""
        names = {p.name for p in self._problem.machine.nuisances}
        begins = [{}, *({name: value for name, value in rival.point.items() if name in names}
                        for rival in self._earlier)]
        return min(begins, key=lambda point: self._problem.loss(self._problem.residuals(
            with_initial_conditions(self._problem, dict(point)))))

    def _lower_noise(self) -> bool:
        """Lower the noise to what the best leaves, and fit the best again; return if it fell."""
        lowered = False
        while True:
            ranked = self._ranked()
            best, before = ranked[0], self._problem.scale
            problem = self._problem.at_noise(self._problem.noise_level(best.state.residual))
            if problem.scale > self._options.lower * before:
                return lowered
            lowered = True
            self._problem = problem
            self._sensitivities = [
                replace(item, jacobian=item.jacobian * (before / problem.scale))
                for item in self._sensitivities]
            self._refit(best, [self._found[frozenset()], *(
                h for h in ranked if h.effects)][:1 + self._options.finalists])

    def _refit(self, anchor: Hypothesis, hypotheses: Sequence[Hypothesis]) -> None:
        """Fit hypotheses to the present problem, with derivatives where one of them has ended."""
        slopes = self._problem.jacobian(
            anchor.state.point(), self._problem.machine.nuisances, None, False,
            self._problem.local_steps(anchor.state))
        self._found = {}
        self._keep(list(self._pool.map(
            lambda h: moves.refitted(self._problem, h, anchor, slopes), hypotheses)))

    def _continued(self, none: Hypothesis) -> list[Hypothesis]:
        """Return the answers of an earlier verdict, fitted from where they have ended."""
        machine, slopes = self._problem.machine, none.state.jacobian
        found = []
        for rival in self._earlier:
            if not rival.effects or not rival.is_known_to(machine):
                continue
            forms = tuple(rival.forms_of(machine))
            names = {p.name for form in forms for p in form.parameters}
            point = {**none.state.point(), **{
                name: value for name, value in rival.point.items()
                if name in names or name in none.state.point()}}
            numbers = (*machine.nuisances, *(p for form in forms for p in form.parameters))
            state = replace(none.state, parameters=numbers,
                            x=np.array([point.get(p.name, p.start) for p in numbers]))
            found.append(moves.refitted(
                self._problem, Hypothesis(rival.effects, forms, state), none, slopes))
        return found

    # -- the whole tests -----------------------------------------------------------------------

    def _compared(self) -> Found:
        """Fit the best to the whole tests, at the noise that the best of them shows."""
        self._progress(0.6, 'the best in full')
        self._sensitivities = []  # large, and nothing is added from here on
        options = self._options
        ranked, evidence = self._ranked(), self._evidence()
        best, none = ranked[0], self._found[frozenset()]
        chosen = [h for h in ranked if h.effects
                  and evidence(h) > evidence(best) - evidence.reach][:options.finalists]
        # the motion that was found may make readings noisier than the model without effects
        settings = self._whole.settings
        self._problem = LeastSquares(
            self._whole.machine.with_noise_at(best.state.point()), settings=settings)
        self._refit(best, [best])
        best = moves.settled(
            self._problem, self._found[frozenset(best.effects)], options.passes)
        point = best.state.point()
        self._problem = LeastSquares(with_noise_left(
            self._problem.machine.linearised_at(point), point, settings.noise,
            settings.noise.greatest_level), settings=settings)
        self._refit(best, [best, none, *(h for h in chosen if h.effects != best.effects)])
        judged, catalogue = set[frozenset[Form]](), self._problem.machine.catalogue
        while frozenset((best := self._ranked()[0]).forms) not in judged:
            self._progress(0.75, 'the best in full')
            judged.add(frozenset(best.forms))
            best = moves.settled(self._problem, best, options.passes)
            self._keep([best])
            # they are comparable once each has begun where the best has ended
            slopes = best.state.jacobian[:, :len(self._problem.machine.nuisances)]
            self._keep(self._pool.map(
                lambda h: moves.refitted(self._problem, h, best, slopes), self._ranked()[1:]))
            evidence = self._evidence()
            self._make(partial(moves.settled, self._problem, h, 1)
                       for h in self._ranked()[1:options.leading]
                       if h.effects and evidence(h) > evidence(best) - evidence.reach)
            good = [h.with_jacobian(self._problem) for h in self._ranked() if h.cost <= best.cost]
            self._make([
                *(partial(moves.dropped, self._problem, h, effect)
                  for h in good for effect in h.effects),
                *(partial(moves.exchanged, self._problem, best, effect, effect, whole)
                  for effect, form in best.items if (whole := catalogue.whole(form)) is not form),
                partial(moves.joined, self._problem, best)])
        return Found(self._problem, self._ranked(), self._evidence())
