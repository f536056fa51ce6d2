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
from dataclasses import dataclass

from antenna_drive.gap.fit import bounded_step, FloatArray, Problem, scanned, State
from antenna_drive.gap.model import Form, Model, Parameter
import numpy as np

SINGLES = 14
BASES = 4
PARTNERS = 5
# A partner that could gain less than this in half a chi-square is not fitted.
WORTH = 12.0
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
        """Return half the weighted sum of squares."""
        return self.state.cost


@dataclass(frozen=True)
class _Tangent:
    """A form of an effect and how the predictions change with its parameters."""

    effect: str
    form: Form
    columns: FloatArray


def starts(form: Form) -> dict[str, float]:
    """Return where a fit of the form begins."""
    return {p.name: p.start for p in form.parameters}


class Search:
    """
    The search for the effects that a model lacks.

    Parameters
    ----------
    problem : the model against its experiments
    progress : called with the share that is done, 0 to 1, and what is being done

    """

    def __init__(self, problem: Problem, progress: Callable[[float, str], None]) -> None:
        """Prepare to search."""
        self.problem = problem
        self.model: Model = problem.model
        self.progress = progress
        self.tangents: list[_Tangent] = []
        self.screened: list[tuple[str, float]] = []

    def run(self) -> list[Candidate]:
        """Return every candidate that was fitted in earnest, the offsets alone first."""
        none = self._offsets()
        self.progress(0.2, 'what each effect would do')
        self._take_tangents(none.state)
        self.progress(0.4, 'single effects')
        singles = self._singles(none)
        none = self._none_again(none, singles)
        self.progress(0.7, 'pairs of effects')
        pairs = self._pairs(singles)
        self.progress(1.0, 'done')
        return [none, *singles, *pairs]

    def _offsets(self) -> Candidate:
        problem, point = self.problem, {}
        self.progress(0.0, 'where the motors start')
        point = self.placed({})
        self.progress(0.03, 'offsets')
        state = problem.start(self.model.nuisances, point)
        state = problem.fit(state, 12)
        moved = self.placed(state.point())
        if moved != state.point():
            state = problem.start(self.model.nuisances, moved, state.jacobian)
        state = problem.fit(problem.refreshed(state, central=False), 10)
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

    def _columns(self, state: State, form: Form) -> FloatArray:
        """Return the derivatives by a form's parameters, nought by those of its shape."""
        point = {**state.point(), **starts(form)}
        columns = np.zeros((state.residual.size, len(form.parameters)))
        live = [j for j, p in enumerate(form.parameters) if not p.shape]
        columns[:, live] = self.problem.columns(
            point, [form.parameters[j] for j in live], state.residual, central=False)
        return columns

    def _take_tangents(self, state: State) -> None:
        residuals = self._residuals(state)
        count = len(self.model.effects)
        for i, effect in enumerate(self.model.effects.values()):
            self.progress(0.2 + 0.2 * i / count, 'what each effect would do')
            for form in self.model.forms(effect, residuals):
                self.tangents.append(_Tangent(effect.id, form, self._columns(state, form)))

    def _screen(self, state: State, besides: Sequence[str] = ()) -> list[tuple[float, _Tangent]]:
        """Return the gain that each form promises, the greatest first, best forms only."""
        names = [p.name for p in state.parameters]
        low = np.array([p.low for p in state.parameters]) - state.x
        high = np.array([p.high for p in state.parameters]) - state.x
        pull = np.array([1.0 / p.spread ** 2 if p.spread else 0.0 for p in state.parameters])
        weighted = state.weight[:, np.newaxis] * state.jacobian
        curvature = state.jacobian.T @ weighted + np.diag(pull)
        gradient = state.jacobian.T @ (state.weight * state.residual) - pull * state.x
        found: dict[str, list[tuple[float, _Tangent]]] = {}
        for tangent in self.tangents:
            if tangent.effect in besides:
                continue
            live = [j for j, p in enumerate(tangent.form.parameters)
                    if not p.shape and p.name not in names]
            own = tangent.columns[:, live]
            cross = weighted.T @ own
            weighted_own = state.weight[:, np.newaxis] * own
            full = np.block([[curvature, cross], [cross.T, own.T @ weighted_own]])
            slope = np.r_[gradient, weighted_own.T @ state.residual]
            parts = [tangent.form.parameters[j] for j in live]
            step = bounded_step(full + 1e-9 * np.diag(np.diag(full) + 1e-9), slope,
                                np.r_[low, [p.low for p in parts]],
                                np.r_[high, [p.high for p in parts]])
            gain = float(slope @ step - 0.5 * step @ full @ step)
            found.setdefault(tangent.effect, []).append((gain, tangent))
        best = [max(forms, key=lambda pair: pair[0]) for forms in found.values()]
        return sorted(best, key=lambda pair: -pair[0])

    def _fitted(self, base: Candidate, tangent: _Tangent, fresh: bool) -> Candidate:
        """Fit an effect on top of a candidate."""
        form, problem = tangent.form, self.problem
        columns = self._columns(base.state, form) if fresh else tangent.columns
        values = [p.start for p in form.parameters]
        state = problem.widened(base.state, form.parameters, values, columns)
        state = problem.fit(state, 8)
        # where the effect is there, its shape matters and its derivatives are others
        names = [p.name for p in form.parameters]
        where = [j for j, p in enumerate(state.parameters) if p.name in names]
        state.jacobian[:, where] = problem.columns(
            state.point(), form.parameters, state.residual, central=True)
        state = problem.fit(state, 8)
        return Candidate((*base.effects, tangent.effect), (*base.forms, form), state)

    def _singles(self, none: Candidate) -> list[Candidate]:
        screened = self._screen(none.state)
        self.screened = [(tangent.effect, gain) for gain, tangent in screened]
        chosen = screened[:SINGLES]
        found = []
        for i, (_, tangent) in enumerate(chosen):
            self.progress(0.4 + 0.2 * i / len(chosen), 'single effects')
            found.append(self._fitted(none, tangent, fresh=False))
        found.sort(key=lambda c: c.cost)
        # the best get fresh derivatives of everything
        for i in range(min(2, len(found))):
            state = self.problem.refreshed(found[i].state, central=False)
            state = self.problem.fit(state, 8)
            found[i] = Candidate(found[i].effects, found[i].forms, state)
        return sorted(found, key=lambda c: c.cost)

    def _none_again(self, none: Candidate, singles: Sequence[Candidate]) -> Candidate:
        """Fit the offsets alone once more from those of the best effect."""
        best = none
        for single in singles[:2]:
            state = single.state
            own = [j for j, p in enumerate(state.parameters) if p in self.model.nuisances]
            point = {state.parameters[j].name: float(state.x[j]) for j in own}
            again = self.problem.start(self.model.nuisances, point, state.jacobian[:, own])
            again = self.problem.fit(again, 12)
            if again.cost < best.cost:
                best = Candidate((), (), again)
        return best

    def _pairs(self, singles: Sequence[Candidate]) -> list[Candidate]:
        found: dict[tuple[str, ...], Candidate] = {}
        for base in singles[:BASES]:
            partners = [(gain, tangent) for gain, tangent in self._screen(
                base.state, base.effects) if gain > WORTH][:PARTNERS]
            for _, tangent in partners:
                key = tuple(sorted((*base.effects, tangent.effect)))
                if key in found:
                    continue
                found[key] = self._fitted(base, tangent, fresh=True)
        pairs = sorted(found.values(), key=lambda c: c.cost)
        # the best pair with each of its members in the other's place
        return pairs


def parameters_of(candidate: Candidate) -> list[tuple[Parameter, float]]:
    """Return the parameters of a candidate's effects with their values."""
    values = candidate.state.point()
    return [(p, values[p.name]) for form in candidate.forms for p in form.parameters]
