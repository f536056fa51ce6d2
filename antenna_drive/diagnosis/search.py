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

1. The offsets within the tolerance are fitted without any effect: 'none'. While something strong
   is missing, what is missing counts as noise: the offsets stay where they may be.
2. One derivative by each effect's parameters, taken there, says how much of what is left each
   effect could explain. That is a filter, no judgement.
3. The likeliest dozen are fitted in earnest, each together with all offsets. If the best explains
   much, the noise is set down to what it leaves, and the likeliest are fitted anew.
4. Several of the best are given each a partner, and the partners are fitted in earnest too.
5. What is left of all these is fitted to the whole tests, at the sensors' own noise, and so is
   'none' once more, from the offsets of the best too: a fit that got stuck must raise no alarm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from antenna_drive.diagnosis.least_squares import (
    across, best_of, bounded_step, Problem, pull_of, robust_loss, State, weighted_square,
)
from antenna_drive.diagnosis.machine import FloatArray, Form, Model, Parameter
from antenna_drive.diagnosis.penalty import price
import numpy as np
from numpy.typing import NDArray

SINGLES = 12
FINALISTS = 5
BASES = 3
PARTNERS = 5
# A partner that could gain less than this in half a chi-square is not fitted.
WORTH = 12.0
# How many are fitted to the whole tests in the end, and in at most how many passes.
FULL_SINGLES = 5
FULL_PAIRS = 4
PASSES = 3
# Of those, what costs so much more than the best is not fitted any further.
REACH = 250.0
# Beyond this residual, in standard deviations, something strong is missing; below it, the noise
# is the sensors'.
FAR = 1.5
# The noise is set down when so little of it is left.
SHARPER = 0.7
# A single effect that leaves more than this, in standard deviations, may have a partner.
WANTING = 1.03
# A pass that gains less than this ends the fits.
SETTLED = 4.0
# A fit that leaves less than this, in standard deviations, is polished once; others so many
# times.
CLEAN = 0.97
POLISHES = 5
# Forms with more parameters than this are free at every moment: a gust.
FREE = 10
# From how many values far away a fit is begun, and where they are sought: shares of the bounds,
# and of the best of these; how much of a test is looked at [s].
SCANNED = 5
_NEARBY = (0.7, 0.8, 0.87, 0.94, 1.06, 1.13, 1.2, 1.3)
_SPAN = (-0.9, -0.6, -0.4, -0.25, -0.15, -0.08, 0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 0.9)
_EARLY_S = 1.5
_LOOK_S = 8.0
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
    def cost(self) -> float:
        """Return half a chi-square, robust, with the pull of the offsets."""
        return self.state.cost

    @property
    def priced(self) -> float:
        """Return the cost with the price of the effects."""
        return self.state.cost + price(self.forms, self.state.point())


@dataclass(frozen=True)
class _Derivatives:
    """Derivatives by the offsets, and by the parameters of free forms, by their names."""

    offsets: NDArray[np.float32]
    free: Mapping[str, NDArray[np.float32]]


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
    threads
        how many candidates are fitted at once

    """

    def __init__(self, problem: Problem, progress: Callable[[float, str], None],
                 threads: int = 1) -> None:
        """Prepare to search."""
        self._pool = ThreadPoolExecutor(threads)
        self.whole = problem
        self.problem = Problem(problem.model.brief())
        self.model: Model = self.problem.model
        self.progress = progress
        self.tangents: list[_Tangent] = []

    def run(self) -> list[Candidate]:
        """Return every candidate that was fitted in earnest, the offsets alone first."""
        self.progress(0.0, 'offsets')
        none = self._offsets()
        self.progress(0.15, 'what each effect would do')
        self._take_tangents(none.state)
        self.progress(0.25, 'single effects')
        singles = self._sharpened(self._singles(none))
        self.progress(0.5, 'pairs of effects')
        pairs = self._pairs(singles)
        if pairs:
            scale = self.problem.scale
            pairs = self._sharpened(pairs)
            # costs compare at one and the same noise
            singles = [replace(c, state=self.problem.seen(c.state, scale)) for c in singles]
        self.progress(0.7, 'the likeliest in full')
        return self._in_full(none, singles, pairs)

    def _offsets(self) -> Candidate:
        """Fit the offsets alone, the noise being what they leave."""
        point = self.placed({})
        first = self.problem.start(self.model.nuisances, point)
        self.problem = self._at(self.problem.level(first.residual))
        state = self.problem.start(self.model.nuisances, point,
                                   first.jacobian / self.problem.scale)
        state = self.problem.fit(state, 8)
        for _ in range(5):
            before, cost = self.problem.scale, state.cost
            self.problem = self._at(min(before, self.problem.level(state.residual)))
            point = self.placed(state.point())
            state = self.problem.fit(self.problem.start(self.model.nuisances, point), 8)
            if self.problem.scale > SHARPER * before and (
                    before > 1.0 or cost - state.cost < 0.003 * cost):
                break
        return Candidate((), (), state)

    def _at(self, level: float) -> Problem:
        """Return the problem with so much noise."""
        return Problem(self.model, scale=level if level > FAR else 1.0)

    def _sharpened(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Set the noise down to what the best candidate leaves, and fit the likeliest anew."""
        found = list(candidates)
        for _ in range(3):
            best = found[0].state
            problem = self._at(min(self.problem.scale, self.problem.level(best.residual)))
            if problem.scale > SHARPER * self.problem.scale:
                break
            self.tangents = [replace(t, columns=t.columns * (self.problem.scale / problem.scale))
                             for t in self.tangents]
            self.problem = problem
            taken = self._derivatives(problem, best.point(), found[:FINALISTS])
            found = self._sorted(lambda c: self._refitted(problem, c, taken, 8),
                                 found[:FINALISTS])
        return found

    def _sorted(self, fitted: Callable[[Any], Candidate], of: Iterable[Any]) -> list[Candidate]:
        """Fit several candidates at once; return the cheapest first."""
        return sorted(self._pool.map(fitted, of), key=lambda c: c.priced)

    def _derivatives(self, problem: Problem, point: dict[str, float],
                     candidates: Sequence[Candidate]) -> _Derivatives:
        """Take the derivatives at a point that several candidates will share."""
        residual = problem.residuals([point])[0]
        # a form with so many parameters is next to linear in them
        free = {form for c in candidates for form in c.forms if len(form.parameters) > FREE}
        return _Derivatives(
            problem.columns(point, self.model.nuisances, residual, central=False),
            {form.name: problem.columns(point, form.parameters, residual, central=False)
             for form in free})

    def placed(self, point: dict[str, float]) -> dict[str, float]:
        """Return the point with the starting places that fit the first seconds best."""
        for k in range(len(self.problem.experiments)):
            names = [p.name for p in self.model.nuisances
                     if p.experiment == k and p.name.startswith('start:')]
            if len(names) == 2:
                grid = [(float(a), float(b)) for a in _GRID for b in _GRID]
                _, point = best_of(self.problem, [
                    point, *({**point, **dict(zip(names, values, strict=True))}
                             for values in grid)], k, _EARLY_S)
        return point

    def _residuals(self, state: State) -> list[FloatArray]:
        """Return the residuals in the readings' own units, shape (n, c) for each experiment."""
        scale = self.problem.scale
        return [state.residual[self.problem.rows(k)].reshape(e.measured.shape) * e.noise * scale
                for k, e in enumerate(self.problem.experiments)]

    def _columns(self, state: State, form: Form) -> NDArray[np.float32]:
        """Return the derivatives by a form's parameters, nought by those of its shape."""
        point = {**state.point(), **starts(form)}
        columns = np.zeros((state.residual.size, len(form.parameters)), np.float32)
        live = [j for j, p in enumerate(form.parameters) if not p.shape]
        # a wave may ask for shorter steps than the state was simulated with
        columns[:, live] = self.problem.columns(
            point, [form.parameters[j] for j in live], state.residual, central=form.sought)
        return columns

    def _take_tangents(self, state: State) -> None:
        residuals = self._residuals(state)
        forms = [(effect.id, form) for effect in self.model.effects.values()
                 for form in self.model.forms(effect, residuals)]
        self.tangents = list(self._pool.map(
            lambda item: _Tangent(item[0], item[1], self._columns(state, item[1])), forms))

    def _screen(self, state: State, besides: Sequence[str] = ()) -> list[tuple[float, _Tangent]]:
        """Return the gain that each form promises, the greatest first, the best forms only."""
        names = [p.name for p in state.parameters]
        low = np.array([p.low for p in state.parameters]) - state.x
        high = np.array([p.high for p in state.parameters]) - state.x
        pull = pull_of(state.parameters)
        curvature = state.hessian + np.diag(pull)
        gradient = across(state.jacobian, state.weight * state.residual) - pull * state.x
        found: dict[str, list[tuple[float, _Tangent]]] = {}
        for tangent in self.tangents:
            if self._same(tangent.effect, besides) or (
                    besides and len(tangent.form.parameters) > FREE):
                # what is free at every moment explains the remains of anything
                continue
            if any(p.name in names for p in tangent.form.parameters):
                continue  # another effect of the same numbers
            live = [j for j, p in enumerate(tangent.form.parameters) if not p.shape]
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
        best: list[tuple[float, _Tangent]] = []
        for forms in found.values():
            # a screening does not tell an effect's forms apart: the second is kept if it is close
            first, *others = sorted(forms, key=lambda pair: -pair[0])
            best += [first, *(pair for pair in others[:1] if pair[0] > 0.7 * first[0])]
        return sorted(best, key=lambda pair: -pair[0])

    def _same(self, effect: str, others: Sequence[str]) -> bool:
        """Tell whether an effect is one of the others, or the same in another place of theirs."""
        effects = self.model.effects
        return any(effect == other or effect in effects[other].parts
                   or other in effects[effect].parts for other in others)

    def _split(self, base: Candidate) -> list[Candidate]:
        """Return the parts of an effect, each of its own size, if it is one in several places."""
        effect = self.model.effects[base.effects[0]]
        if not effect.parts:
            return []
        forms = tuple(self.model.counterpart(base.forms[0], effect, self.model.effects[part])
                      for part in effect.parts)
        state, point = base.state, base.state.point()
        whole = base.forms[0].parameters
        for p, *own in zip(whole, *(form.parameters for form in forms), strict=True):
            value = point.pop(p.name)
            point.update({part.name: value for part in own})
        kept = [j for j, p in enumerate(state.parameters) if p not in whole]
        start = self.problem.begun(
            [state.parameters[j] for j in kept], state.jacobian[:, kept],
            [p for form in forms for p in form.parameters], point)
        return [Candidate(effect.parts, forms, self.problem.fit(start, 8))]

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
        found = self._sorted(lambda item: self._fitted(none, item[1], False, 5),
                             screened[:SINGLES])
        if self.problem.scale > 1.0:
            found += self._sorted(lambda item: self._from_afar(none, *item),
                                  self._scanned(none.state))
            found.sort(key=lambda c: c.priced)
        self.progress(0.35, 'single effects')
        # those that are far behind after a few turns stay there
        leading = self._sorted(lambda c: self._shaped(c, 8), found[:FINALISTS])
        leading[:2] = self._sorted(self._settled, leading[:2])
        leading.sort(key=lambda c: c.priced)
        return [*leading[:BASES], *(_light(c) for c in leading[BASES:])]

    def _scanned(self, state: State, besides: Sequence[str] = (),
                 ) -> list[tuple[_Tangent, float]]:
        """
        Return the forms of which some value far away fits best, with that value.

        A strong effect may bend the misfit so much that its derivative tells nothing: a mode at
        another frequency, a limit that was not reached before. Only the test that fits worst is
        looked at. Effects that are there already are left out (`besides`).
        """
        problem, here = self.problem, state.point()
        worst = int(np.argmax([robust_loss(state.residual[problem.rows(k)])
                               for k in range(len(problem.experiments))]))
        found: list[tuple[float, _Tangent, float]] = []
        for tangent in self.tangents:
            live = [p for p in tangent.form.parameters if not p.shape]
            if len(live) != 1 or self._same(tangent.effect, besides) or any(
                    p.name in here for p in tangent.form.parameters):
                continue
            begin = {**here, **starts(tangent.form)}
            values = [share * (live[0].high if share > 0.0 else -live[0].low)
                      for share in _SPAN if share > 0.0 or live[0].low < 0.0]
            cost, best = best_of(problem, [{**begin, live[0].name: value} for value in values],
                                 worst, _LOOK_S)
            found.append((cost, tangent, best[live[0].name]))
        found.sort(key=lambda item: item[0])
        finer = []
        for cost, tangent, value in found[:2 * SCANNED]:
            name = next(p.name for p in tangent.form.parameters if not p.shape)
            nearby = best_of(problem, [{**here, **starts(tangent.form), name: value * share}
                                       for share in _NEARBY], worst, _LOOK_S)
            finer.append((*min((cost, value), (nearby[0], nearby[1][name])), tangent))
        finer.sort(key=lambda item: item[0])
        return [(tangent, value) for _, value, tangent in finer[:SCANNED]]

    def _settled(self, candidate: Candidate) -> Candidate:
        """Fit with fresh derivatives of everything."""
        point = self.placed(candidate.state.point())
        state = self.problem.start(candidate.state.parameters, point)
        return replace(candidate, state=self.problem.fit(state, 10))

    def _from_afar(self, base: Candidate, tangent: _Tangent, value: float) -> Candidate:
        """Fit an effect on top of a candidate, from a value far away."""
        form, problem = tangent.form, self.problem
        name = next(p.name for p in form.parameters if not p.shape)
        state = problem.begun(base.state.parameters, base.state.jacobian, form.parameters,
                              {**base.state.point(), **starts(form), name: value})
        return Candidate((*base.effects, tangent.effect), (*base.forms, form),
                         problem.fit(state, 8))

    def _pairs(self, singles: Sequence[Candidate]) -> list[Candidate]:
        """Give the best singles each a few partners."""
        best = singles[0]
        # what the best leaves is looked at anew, if it leaves anything: another effect may have
        # hidden a wave, or be strong
        if self.problem.level(best.state.residual) > WANTING:
            self._take_tangents(best.state)
        worth = max(WORTH, 0.001 * best.cost)
        found: dict[tuple[str, ...], Candidate] = {}
        for i, base in enumerate(singles[:BASES]):
            self.progress(0.5 + 0.2 * i / BASES, 'pairs of effects')
            free = any(len(form.parameters) > FREE for form in base.forms)
            if base.priced > 3.0 * best.priced + REACH or (free and base is not best):
                continue
            given = self._sorted(partial(self._partnered, best, base), [
                (tangent, None) for gain, tangent in
                self._screen(base.state, base.effects)[:PARTNERS] if gain > worth])
            if self.problem.scale > 1.0 and base is best:
                given += self._sorted(partial(self._partnered, best, base),
                                      self._scanned(base.state, base.effects))
            given += self._split(base)
            for pair in given:
                key = tuple(sorted(pair.effects))
                if key not in found or pair.priced < found[key].priced:
                    found[key] = _light(pair)
        return sorted(found.values(), key=lambda c: c.priced)

    def _partnered(self, best: Candidate, base: Candidate,
                   partner: tuple[_Tangent, float | None]) -> Candidate:
        """Give a candidate a partner, from a value far away if one is given."""
        tangent, value = partner
        pair = (self._fitted(base, tangent, True, 5) if value is None else
                self._from_afar(base, tangent, value))
        return self._shaped(pair, 6) if pair.cost < best.cost else pair

    def _in_full(self, none: Candidate, singles: Sequence[Candidate],
                 pairs: Sequence[Candidate]) -> list[Candidate]:
        """
        Fit the likeliest candidates to the whole tests, the offsets alone first.

        All share the derivatives by the offsets, which are taken anew in every pass, where the
        best candidate is then.
        """
        least = min(c.priced for c in (*singles, *pairs))
        chosen = [singles[0], *(c for c in (*singles[1:FULL_SINGLES], *pairs[:FULL_PAIRS])
                                if c.priced < least + REACH)]
        if pairs and pairs[0].priced < singles[0].priced:
            # a member that passed for the pair's whole effect, with the offsets the pair has
            known = {(c.effects, c.forms) for c in chosen}
            chosen += [c for c in (self._dropped(pairs[0], e) for e in pairs[0].effects)
                       if (c.effects, c.forms) not in known]
        anchor = min(chosen, key=lambda c: c.priced)
        # what was found may be faster than anything the model knew of
        self.whole = whole = Problem(self.whole.model.heard_at(anchor.state.point()))
        before = np.inf
        for number in range(PASSES):
            self.progress(0.7 + 0.3 * number / PASSES, 'the likeliest in full')
            taken = self._derivatives(whole, anchor.state.point(), chosen)
            # the first pass is never the last: no one asks what it gives for its hessian
            refitted = partial(self._refitted_lightly, taken, hessian=number > 0)
            chosen = self._sorted(refitted, chosen)
            singles = [c for c in chosen if len(c.effects) == 1]
            bare = [none] if number else [none, self._dropped(singles[0], singles[0].effects[0])]
            none = self._sorted(refitted, bare)[0]
            # what is far behind stays there
            anchor = chosen[0] if chosen[0].priced < none.cost else none
            chosen = [singles[0], *(c for c in chosen if c is not singles[0]
                                    and c.priced < anchor.priced + REACH)]
            if number and before - anchor.priced < max(SETTLED, 1e-3 * anchor.priced):
                break
            before = anchor.priced
        # of an effect's forms the best counts
        unique = {frozenset(c.effects): c for c in sorted(chosen, key=lambda c: -c.priced)}
        return [none, *sorted(unique.values(), key=lambda c: c.priced)]

    def polished(self, candidate: Candidate) -> Candidate:
        """Go on with a fit, with derivatives from both sides, as long as that gains much."""
        state = candidate.state
        for number in range(POLISHES):
            if number and self.whole.level(state.residual) < CLEAN:
                break
            before = state.cost
            state = self.whole.fit(self.whole.refreshed(state, central=True), 6)
            if before - state.cost < max(SETTLED, 0.01 * before):
                break
        return replace(candidate, state=state)

    def without(self, candidate: Candidate, effect: str) -> Candidate:
        """Return a candidate without one of its effects, fitted to the end from where it is."""
        rest = self._dropped(candidate, effect)
        state = self.whole.start(rest.state.parameters, rest.state.point(), central=True)
        rest = self.polished(replace(rest, state=self.whole.fit(state, 8)))
        return _light(rest, hessian=True)

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

    def _refitted_lightly(self, taken: _Derivatives, candidate: Candidate,
                          hessian: bool) -> Candidate:
        """Fit a candidate to the whole tests and let its derivatives go."""
        return _light(self._refitted(self.whole, candidate, taken, 6), hessian)

    def _refitted(self, problem: Problem, candidate: Candidate, taken: _Derivatives,
                  turns: int) -> Candidate:
        """Fit a candidate to another problem, with derivatives that were taken for several."""
        free = [form for form in candidate.forms if form.name in taken.free]
        state = problem.begun(
            (*self.model.nuisances, *(p for form in free for p in form.parameters)),
            np.column_stack([taken.offsets, *(taken.free[form.name] for form in free)]),
            [p for form in candidate.forms if form not in free for p in form.parameters],
            candidate.state.point())
        return replace(candidate, state=problem.fit(state, turns))


def _light(candidate: Candidate, hessian: bool = False) -> Candidate:
    return replace(candidate, state=candidate.state.light(hessian))


def parameters_of(candidate: Candidate) -> list[tuple[Parameter, float]]:
    """Return the parameters of a candidate's effects with their values."""
    values = candidate.state.point()
    return [(p, values[p.name]) for form in candidate.forms for p in form.parameters]
