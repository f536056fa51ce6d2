# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Each rival fitted to the readings that each other one would give in a planned test."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import FloatArray, Machine, Parameter, Point
from simgap.machine.process import with_process
from simgap.next_test.discrimination import planned
from simgap.next_test.rivals import known_to, numbers_of
from simgap.next_test.separation import prior_of, Separation
from simgap.search.rival import Rival
from simgap.settings import DEFAULT

# A fit goes this many standard deviations away at most, and a difference quotient this far.
_FAR, _STEP = 8.0, 0.3
_ITERATIONS = DEFAULT.search.iterations


def confirmed_separation(machine: Machine, rivals: Sequence[Rival],
                         inflated: float) -> Separation:
    """
    Return how well tests tell rivals apart, with each fitted to the readings of each other one.

    The true rival is fitted as well, from a standard deviation away along each direction: what
    such a fit leaves because it sticks is not evidence against the others. Parameters are those of
    `separation`.
    """
    points = [known_to(machine, rival) for rival in rivals]
    problem = planned(with_process(machine), rivals, points)
    readings = machine.simulate(points)
    left = np.zeros((len(rivals), len(rivals)))
    ends: dict[tuple[int, int], Point] = {}
    for j, rival in enumerate(rivals):
        own = _Continued(problem.machine, rival, inflated)
        jacobian = None
        for i, truth in enumerate(readings):
            fitted = LeastSquares(own.with_experiments([
                replace(e, measured=values) for e, values in zip(
                    problem.experiments, truth, strict=True) if values is not None]))
            if i == j:
                state = fitted.start(own.nuisances, own.elsewhere(), None)
            else:
                state = fitted.start(own.nuisances, {}, jacobian)
                # it depends on the point, and not on what was measured
                jacobian = state.base_jacobian
            state = fitted.fit(state, _ITERATIONS)
            state = fitted.fit(fitted.refreshed(state), _ITERATIONS)
            left[i, j] = state.cost / inflated
            ends[i, j] = own.own(state.point())
    lack = np.maximum(left - np.diag(left)[:, np.newaxis], 0.0)
    return Separation(prior_of(rivals), lack, points=ends)


class _Continued(Machine):
    """A machine whose numbers count in deviations along the directions still free."""

    def __init__(self, machine: Machine, rival: Rival, inflated: float) -> None:
        numbers = numbers_of(machine, rival)
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
        return self._machine.predict(self.own(point), experiment)

    def simulate(self, points: Sequence[Point], only: Sequence[int | None] | None = None,
                 until: float = np.inf) -> list[list[FloatArray | None]]:
        return self._machine.simulate([self.own(point) for point in points], only, until)

    def low_fidelity(self) -> Machine:
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
