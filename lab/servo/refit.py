# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Global fits of a servo's parameters to the mean absolute position error of open-loop runs.

Stiction makes the error discontinuous with many local minima, which CMA-ES can handle. All models
that are compared get the same number of runs and the same kinds of initial values.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cma
from lab.servo.catalogue import BASE, number, vector
from lab.servo.log import ServoLog
import numpy as np

Values = Mapping[str, float]

# Initial spread of a search, as a share of the bounds: from scratch, from the fit of a simpler
# model, and around the best of all.
WIDE, NEAR, CLOSE = 0.2, 0.06, 0.015
_COMMON = (*BASE, 'position_offset', 'delay')
_STRIBECK = ('stribeck_torque', 'stribeck_rate', 'stribeck_shape')
_DIRECTED = ('load_friction_motor', 'load_friction_external', 'load_stribeck_motor',
             'load_stribeck_external')
# BAM's friction models by their names there. Offset and delay are fitted in all, as in BAM.
LADDER: Mapping[str, tuple[str, ...]] = {
    'm1': _COMMON,
    'm2': (*_COMMON, *_STRIBECK),
    'm3': (*_COMMON, 'load_friction'),
    'm4': (*_COMMON, *_STRIBECK, 'load_friction', 'load_stribeck'),
    'm5': (*_COMMON, *_STRIBECK, *_DIRECTED),
    'm6': (*_COMMON, *_STRIBECK, *_DIRECTED, 'load_quadratic_motor', 'load_quadratic_external'),
}
# The simpler models that each contains.
PARENTS: Mapping[str, tuple[str, ...]] = {
    'm1': (), 'm2': ('m1',), 'm3': ('m1',), 'm4': ('m2', 'm3'), 'm5': ('m4',), 'm6': ('m5',)}


@dataclass(frozen=True)
class Fit:
    """Fitted parameters."""

    values: dict[str, float]    # by name
    error: float                # mean over the tests of the mean absolute position error [rad]


def error(tests: Sequence[ServoLog], values: Values) -> float:
    """Return the mean over tests of the mean absolute error of open-loop positions [rad]."""
    row = vector(values)
    return float(np.mean([test.error(row) for test in tests]))


def initial_values(names: Sequence[str], known: Values | None = None) -> dict[str, float]:
    """
    Return initial values: the known ones, or the default ones if none are known.

    A known value also serves for the two parameters that split it by direction. An effect that the
    known model lacks starts absent.
    """
    values = {}
    for name in names:
        item = number(name)
        tied = name.replace('_motor', '').replace('_external', '')
        if known is None:
            values[name] = item.start
        elif name in known:
            values[name] = known[name]
        elif tied in known:
            values[name] = known[tied]
        else:
            values[name] = item.start if item.shape else min(max(0.0, item.low), item.high)
    return values


def refit(tests: Sequence[ServoLog], names: Sequence[str], begins: Sequence[Values],
          runs: int, seed: int = 1) -> Fit:
    """
    Fit the parameters `names` to tests; all others are absent.

    Fits start from the default values and from `begins`; `runs` limits the simulations of all
    tests.
    """
    starts = [(initial_values(names), WIDE),
              *((initial_values(names, known), NEAR) for known in begins)]
    share = int(0.75 * runs / len(starts))
    fits = [_search(tests, names, start, step_size, share, seed + i)
            for i, (start, step_size) in enumerate(starts)]
    best = min(fits, key=lambda fit: fit.error)
    return _search(tests, names, best.values, CLOSE, runs - share * len(starts), seed)


def nearby(tests: Sequence[ServoLog], names: Sequence[str], start: Values, runs: int,
           seed: int = 1) -> Fit:
    """Fit parameters to tests near their present values; see `refit`."""
    return _search(tests, names, initial_values(names, start), 0.5 * NEAR, runs, seed)


def _search(tests: Sequence[ServoLog], names: Sequence[str], start: Values, step_size: float,
            runs: int, seed: int) -> Fit:
    """Search with CMA-ES; the result is never worse than the start."""
    items = [number(name) for name in names]

    def named(shares: Sequence[float]) -> dict[str, float]:
        return {name: item.value(float(share))
                for name, item, share in zip(names, items, shares, strict=True)}

    begin = named([item.share(start[name]) for name, item in zip(names, items, strict=True)])
    best = Fit(begin, error(tests, begin))
    inside = [min(max(item.share(start[name]), 0.01), 0.99)
              for name, item in zip(names, items, strict=True)]
    strategy = cma.CMAEvolutionStrategy(inside, step_size, {
        'bounds': [0.0, 1.0], 'seed': seed, 'maxfevals': runs, 'verbose': -9, 'tolfun': 1e-6})
    while not strategy.stop():
        candidates = strategy.ask()
        strategy.tell(candidates, [error(tests, named(c)) for c in candidates])
    if strategy.result.fbest < best.error:
        best = Fit(named(strategy.result.xbest), float(strategy.result.fbest))
    return best
