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
Which effect: from the offsets alone over single effects to pairs.

1. The offsets within the tolerance are fitted without any effect: 'none'.
2. One derivative by each effect's parameters, taken there, says how much of what is left each
   effect could explain. That is a filter, no judgement.
3. The likeliest dozen are fitted in earnest, each together with all offsets.
4. 'None' is fitted once more from the offsets of the best effect: a fit that got stuck must not
   raise an alarm.
5. Several of the best are given each a partner, and the partners are fitted in earnest too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from antenna_drive.gap.fit import (
    across, bounded_step, huber_sum, Problem, scanned, State, weighted_square,
)
from antenna_drive.gap.model import FloatArray, Form, Model, Parameter
import numpy as np
from numpy.typing import NDArray

SINGLES = 14
FINALISTS = 6
BASES = 3
PARTNERS = 4
# How many are fitted to the whole tests in the end.
FULL_SINGLES = 5
FULL_PAIRS = 4
# Of those, what costs so much more than the best is not fitted any further.
REACH = 400.0
# A partner that could gain less than this in half a chi-square is not fitted.
WORTH = 12.0
# The offsets alone are fitted in at most so many rounds; they were stuck if that much of the
# cost goes once they begin elsewhere.
ROUNDS = 5
STUCK = 0.02
# Beyond this chi-square per sample the offsets say nothing any more.
FAR = 4.0
_SPAN = (-0.9, -0.6, -0.4, -0.25, -0.15, -0.08, 0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 0.9)
# Fresh derivatives that gain less than this end a fit.
SETTLED = 4.0
_EARLY_S = 1.5
_GRID = np.linspace(-0.95, 0.95, 13)


@dataclass(frozen=True)
class Candidate:
    """
    Effects that were fitted together with all offsets.

    Attributes
    ----------
    effects : their ids; none for the offsets alone
    forms : one for each effect
    state : where the fit ended

    """

    effects: tuple[str, ...]
    forms: tuple[Form, ...]
    state: State

    @property
    def parameters(self) -> int:
        """Return how many numbers the effects bring."""
        return sum(len(form.parameters) for form in self.forms)

    @property
    def cost(self) -> float:
        """Return half a chi-square, robust, with the pull of the offsets."""
        return self.state.cost


@dataclass(frozen=True)
class _Tangent:
    """A form of an effect and how the predictions change with its parameters."""

    effect: str
    form: Form
    columns: NDArray[np.float32]


def starts(form: Form) -> dict[str, float]:
    """Return where a fit of the form begins."""
    return {p.name: p.start for p in form.parameters}


class Search:
    """
    The search for the effects that a model lacks.

    Parameters
    ----------
    problem
        the model against its experiments
    progress
        called with the share that is done, 0 to 1, and what is being done

    """

    def __init__(self, problem: Problem, progress: Callable[[float, str], None]) -> None:
        """Prepare to search."""
        self.whole = problem
        self.problem = Problem(problem.model.brief())
        self.model: Model = self.problem.model
        self.progress = progress
        # derivatives by the offsets where all are nought
        self.nominal = np.empty((0, 0), np.float32)
        self.tangents: list[_Tangent] = []
        self.screened: list[tuple[str, float]] = []

    def run(self) -> list[Candidate]:
        """Return every candidate that was fitted in earnest, the offsets alone first."""
        none = self._offsets()
        for _ in range(2):
            self.progress(0.2, 'what each effect would do')
            self._take_tangents(none.state)
            self.progress(0.4, 'single effects')
            singles = self._singles(none)
            again = self._none_again(none, singles)
            stuck = again.cost < (1.0 - STUCK) * none.cost
            none = again
            if not stuck:
                break
        self.progress(0.6, 'pairs of effects')
        pairs = self._pairs(none, singles)
        self.progress(0.8, 'the likeliest in full')
        return self._in_full(none, singles, pairs)

    def _offsets(self) -> Candidate:
        problem, point = self.problem, {}
        self.progress(0.0, 'where the motors start')
        point = self.placed({})
        self.progress(0.03, 'offsets')
        state = problem.start(self.model.nuisances, point)
        self.nominal = state.jacobian
        state = problem.fit(state, 12)
        for _ in range(ROUNDS):
            cost = state.cost
            moved = self.placed(state.point())
            if moved != state.point():
                state = problem.start(self.model.nuisances, moved, state.jacobian)
            state = problem.fit(problem.refreshed(state, central=False), 10)
            if cost - state.cost < 0.003 * cost:
                break
        return Candidate((), (), state)

    def placed(self, point: dict[str, float]) -> dict[str, float]:
        """Return the point with the starting places that fit the first seconds best."""
        for k in range(len(self.problem.experiments)):
            names = [p.name for p in self.model.nuisances
                     if p.experiment == k and p.name.startswith('start:')]
            if len(names) == 2:
                grid = [(float(a), float(b)) for a in _GRID for b in _GRID]
                point = scanned(self.problem, point, names, k, grid, _EARLY_S)
        return point

    def _residuals(self, state: State) -> list[FloatArray]:
        """Return the residuals in the readings' own units, shape (n, c) for each experiment."""
        return [state.residual[self.problem.rows(k)].reshape(e.measured.shape) * e.noise
                for k, e in enumerate(self.problem.experiments)]

    def _columns(self, state: State, form: Form) -> NDArray[np.float32]:
        """Return the derivatives by a form's parameters, nought by those of its shape."""
        point = {**state.point(), **starts(form)}
        columns = np.zeros((state.residual.size, len(form.parameters)), np.float32)
        live = [j for j, p in enumerate(form.parameters) if not p.shape]
        columns[:, live] = self.problem.columns(
            point, [form.parameters[j] for j in live], state.residual, central=False)
        return columns

    def _take_tangents(self, state: State) -> None:
        self.tangents = []
        residuals = self._residuals(state)
        count = len(self.model.effects)
        for i, effect in enumerate(self.model.effects.values()):
            self.progress(0.2 + 0.2 * i / count, 'what each effect would do')
            for form in self.model.forms(effect, residuals):
                self.tangents.append(_Tangent(effect.id, form, self._columns(state, form)))

    def _waves_anew(self, state: State) -> None:
        """Look for waves in what a candidate leaves, which another effect may have hidden."""
        residuals = self._residuals(state)
        others = []
        for effect in self.model.effects.values():
            forms = self.model.forms(effect, residuals)
            if any(hasattr(form, 'at') for form in forms):
                others += [_Tangent(effect.id, form, self._columns(state, form))
                           for form in forms]
        names = {tangent.effect for tangent in others}
        self.tangents = [t for t in self.tangents if t.effect not in names] + others

    def _screen(self, state: State, besides: Sequence[str] = ()) -> list[tuple[float, _Tangent]]:
        """Return the gain that each form promises, the greatest first, best forms only."""
        names = [p.name for p in state.parameters]
        low = np.array([p.low for p in state.parameters]) - state.x
        high = np.array([p.high for p in state.parameters]) - state.x
        pull = np.array([1.0 / p.spread ** 2 if p.spread else 0.0 for p in state.parameters])
        curvature = state.hessian + np.diag(pull)
        gradient = across(state.jacobian, state.weight * state.residual) - pull * state.x
        found: dict[str, list[tuple[float, _Tangent]]] = {}
        for tangent in self.tangents:
            if tangent.effect in besides or (besides and len(tangent.form.parameters) > 10):
                # what is free at every moment explains the remains of anything
                continue
            live = [j for j, p in enumerate(tangent.form.parameters)
                    if not p.shape and p.name not in names]
            own = tangent.columns[:, live]
            cross = weighted_square(state.jacobian, state.weight, own)
            full = np.block([[curvature, cross],
                             [cross.T, weighted_square(own, state.weight)]])
            slope = np.r_[gradient, across(own, state.weight * state.residual)]
            parts = [tangent.form.parameters[j] for j in live]
            step = bounded_step(full + 1e-9 * np.diag(np.diag(full) + 1e-9), slope,
                                np.r_[low, [p.low for p in parts]],
                                np.r_[high, [p.high for p in parts]])
            gain = float(slope @ step - 0.5 * step @ full @ step)
            found.setdefault(tangent.effect, []).append((gain, tangent))
        best = [max(forms, key=lambda pair: pair[0]) for forms in found.values()]
        return sorted(best, key=lambda pair: -pair[0])

    def _fitted(self, base: Candidate, tangent: _Tangent, fresh: bool, turns: int) -> Candidate:
        """Fit an effect on top of a candidate, for so many turns."""
        form, problem = tangent.form, self.problem
        columns = self._columns(base.state, form) if fresh else tangent.columns
        values = [p.start for p in form.parameters]
        state = problem.widened(base.state, form.parameters, values, columns)
        state = problem.fit(state, turns)
        return Candidate((*base.effects, tangent.effect), (*base.forms, form), state)

    def _shaped(self, candidate: Candidate, turns: int) -> Candidate:
        """Go on with a fit: where the effect is, its shape matters and its derivatives differ."""
        state, parts = candidate.state, candidate.forms[-1].parameters
        if any(p.shape for p in parts):
            names = [p.name for p in parts]
            where = [j for j, p in enumerate(state.parameters) if p.name in names]
            state = self.problem.replaced(state, where, self.problem.columns(
                state.point(), parts, state.residual, central=True))
        return replace(candidate, state=self.problem.fit(state, turns))

    def _singles(self, none: Candidate) -> list[Candidate]:
        screened = self._screen(none.state)
        self.screened = [(tangent.effect, gain) for gain, tangent in screened]
        chosen = screened[:SINGLES]
        found = []
        for i, (_, tangent) in enumerate(chosen):
            self.progress(0.4 + 0.15 * i / len(chosen), 'single effects')
            found.append(self._fitted(none, tangent, False, 5))
        found.sort(key=lambda c: c.cost)
        if none.cost > FAR * self.problem.samples / 2.0:
            found = [*(self._from_afar(c) for c in found[:FINALISTS]), *found[FINALISTS:]]
            found.sort(key=lambda c: c.cost)
        # those that are far behind after a few turns stay there
        for i in range(min(FINALISTS, len(found))):
            found[i] = self._shaped(found[i], 8)
        found.sort(key=lambda c: c.cost)
        for i in range(min(2, len(found))):
            found[i] = self._settled(found[i], 1)
        found.sort(key=lambda c: c.cost)
        return [*found[:BASES], *(_light(c) for c in found[BASES:])]

    def _settled(self, candidate: Candidate, rounds: int = 3) -> Candidate:
        """Fit with fresh derivatives of everything until that gains nothing any more."""
        state = candidate.state
        for i in range(rounds):
            cost = state.cost
            point = self.placed(state.point()) if i == 0 else state.point()
            if point != state.point():
                state = self.problem.start(state.parameters, point, state.jacobian)
            state = self.problem.fit(self.problem.refreshed(state, central=i > 0), 10)
            if cost - state.cost < max(SETTLED, 2e-4 * cost):
                break
        return replace(candidate, state=state)

    def _from_afar(self, candidate: Candidate) -> Candidate:
        """
        Fit a strong effect from the configuration's own values instead of from the offsets.

        Offsets that were fitted without a strong effect are bent far out of place. The truth is
        never far from no offsets at all, once the effect's size is about right: that is tried
        out.
        """
        form, problem = candidate.forms[-1], self.problem
        first = form.parameters[0]
        known = candidate.state.value(first.name)
        base = {p.name: candidate.state.value(p.name) for p in form.parameters if p.shape}
        begin = {name: value for name, value in candidate.state.point().items()
                 if name.startswith('start:')}
        if any(not p.shape for p in form.parameters[1:]):
            return candidate
        span = [share * (first.high if share > 0.0 else -first.low)
                for share in _SPAN if (share > 0.0 or first.low < 0.0)]
        trials = [{**begin, **base, first.name: value} for value in (known, *span)]
        costs = [huber_sum(z) for z in problem.residuals(trials)]
        point = self.placed(trials[int(np.argmin(costs))])
        columns = problem.columns(point, form.parameters, problem.residuals([point])[0],
                                  central=True)
        state = problem.start((*self.model.nuisances, *form.parameters), point,
                              np.column_stack([self.nominal, columns]))
        state = problem.fit(state, 12)
        return replace(candidate, state=state) if state.cost < candidate.cost else candidate

    def _without(self, candidate: Candidate, effect: str) -> Candidate:
        """Fit a candidate without one of its effects, from the offsets that it has with it."""
        gone = candidate.effects.index(effect)
        effects = tuple(e for i, e in enumerate(candidate.effects) if i != gone)
        forms = tuple(f for i, f in enumerate(candidate.forms) if i != gone)
        names = {p.name for p in candidate.forms[gone].parameters}
        state = candidate.state
        own = [j for j, p in enumerate(state.parameters) if p.name not in names]
        values = state.point()
        point = self.model.absorbed(
            {state.parameters[j].name: values[state.parameters[j].name] for j in own},
            {name: values[name] for name in names})
        again = self.problem.start([state.parameters[j] for j in own], point,
                                   state.jacobian[:, own])
        return Candidate(effects, forms, self.problem.fit(again, 12))

    def _none_again(self, none: Candidate, singles: Sequence[Candidate]) -> Candidate:
        """Fit the offsets alone once more from those of the best effect."""
        best = none
        for single in singles[:2]:
            again = self._without(single, single.effects[0])
            if again.cost < best.cost:
                best = again
        return best

    def _pairs(self, none: Candidate, singles: Sequence[Candidate]) -> list[Candidate]:
        found: dict[tuple[str, ...], Candidate] = {}
        share = 0.3 / (BASES * PARTNERS)
        worth = max(WORTH, 0.02 * (none.cost - singles[0].cost))
        if none.cost - singles[0].cost < WORTH:
            return []
        self._waves_anew(singles[0].state)
        for base in singles[:BASES]:
            partners = [(gain, tangent) for gain, tangent in self._screen(
                base.state, base.effects) if gain > worth][:PARTNERS]
            for _, tangent in partners:
                key = tuple(sorted((*base.effects, tangent.effect)))
                if key in found:
                    continue
                self.progress(0.7 + share * len(found), 'pairs of effects')
                pair = self._fitted(base, tangent, True, 5)
                if pair.cost < singles[0].cost:
                    pair = self._shaped(pair, 6)
                best = min((c.cost for c in found.values()), default=np.inf)
                found[key] = pair if pair.cost < best else _light(pair)
        pairs = sorted(found.values(), key=lambda c: c.cost)
        return [*pairs[:1], *(_light(pair) for pair in pairs[1:])]

    def _in_full(self, none: Candidate, singles: Sequence[Candidate],
                 pairs: Sequence[Candidate]) -> list[Candidate]:
        """
        Fit the likeliest candidates to the whole tests, the offsets alone first.

        All share the derivatives by the offsets, which are taken twice: where the search has
        ended, and where the best single effect is then.
        """
        chosen = [*singles[:FULL_SINGLES], *pairs[:FULL_PAIRS]]
        if not chosen:
            return [self._in_full_alone(none)]
        if pairs and pairs[0].cost < singles[0].cost:
            # a member that passed for the pair's whole effect, with the offsets the pair has
            known = {c.effects for c in chosen}
            chosen += [c for c in (self._dropped(pairs[0], e) for e in pairs[0].effects)
                       if c.effects not in known]
        anchor = min(chosen, key=lambda c: c.cost)
        for turns in (5, 8):
            point = anchor.state.point()
            offsets = self.whole.columns(point, self.model.nuisances,
                                         self.whole.residuals([point])[0], central=False)
            chosen = sorted((self._refitted(c, offsets, turns) for c in chosen),
                            key=lambda c: c.cost)
            singles = [c for c in chosen if len(c.effects) == 1]
            none = min((self._refitted(c, offsets, turns) for c in (
                none, *(self._dropped(c, c.effects[0]) for c in singles[:3]))),
                key=lambda c: c.cost)
            # what is far behind stays there
            chosen = [*singles[:1], *(c for c in chosen if c is not singles[0]
                                      and c.cost < min(chosen[0].cost, none.cost) + REACH)]
            anchor = singles[0]
        return [none, *sorted(chosen, key=lambda c: c.cost)]

    def _in_full_alone(self, none: Candidate) -> Candidate:
        state = self.whole.start(self.model.nuisances, none.state.point())
        state = self.whole.fit(state, 8)
        return replace(none, state=self.whole.fit(self.whole.refreshed(state), 8))

    def _dropped(self, candidate: Candidate, effect: str) -> Candidate:
        """Return a candidate without one of its effects, not fitted yet."""
        gone = candidate.effects.index(effect)
        names = {p.name for p in candidate.forms[gone].parameters}
        state, values = candidate.state, candidate.state.point()
        own = [j for j, p in enumerate(state.parameters) if p.name not in names]
        point = self.model.absorbed(
            {state.parameters[j].name: values[state.parameters[j].name] for j in own},
            {name: values[name] for name in names})
        bare = replace(state, parameters=tuple(state.parameters[j] for j in own),
                       x=np.array([point[state.parameters[j].name] for j in own]))
        return Candidate(
            tuple(e for i, e in enumerate(candidate.effects) if i != gone),
            tuple(f for i, f in enumerate(candidate.forms) if i != gone), bare)

    def _refitted(self, candidate: Candidate, offsets: NDArray[np.float32],
                  turns: int) -> Candidate:
        """Fit a candidate to the whole tests, with these derivatives by the offsets."""
        point = candidate.state.point()
        own = [p for form in candidate.forms for p in form.parameters]
        residual = self.whole.residuals([point])[0]
        columns = self.whole.columns(point, own, residual, central=True)
        state = self.whole.start((*self.model.nuisances, *own), point,
                                 np.column_stack([offsets, columns]))
        return replace(candidate, state=self.whole.fit(state, turns))


def _light(candidate: Candidate) -> Candidate:
    """Return the candidate without its derivatives, which take most of the memory."""
    return replace(candidate, state=replace(candidate.state, jacobian=np.empty((0, 0), np.float32),
                                            weight=np.empty(0)))


def parameters_of(candidate: Candidate) -> list[tuple[Parameter, float]]:
    """Return the parameters of a candidate's effects with their values."""
    values = candidate.state.point()
    return [(p, values[p.name]) for form in candidate.forms for p in form.parameters]
