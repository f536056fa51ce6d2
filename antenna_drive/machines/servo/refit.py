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
Global fits of a servo's numbers to the mean absolute position error of free runs.

A shaft that sticks or does not makes a landscape with steps and many valleys. CMA-ES takes it as
it is; every structure that is compared gets the same number of runs, from the same kinds of
beginnings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from antenna_drive.machines.servo.catalogue import BASE, number, vector
from antenna_drive.machines.servo.log import ServoLog
import cma
import numpy as np

Values = Mapping[str, float]

# How far a search looks, as a share of the way between the bounds: from scratch, from the fit
# of a simpler model, and around the best of all.
WIDE, NEAR, CLOSE = 0.2, 0.06, 0.015
_COMMON = (*BASE, 'position_offset', 'delay')
_STRIBECK = ('stribeck_torque', 'stribeck_rate', 'stribeck_shape')
_DIRECTED = ('load_friction_motor', 'load_friction_external', 'load_stribeck_motor',
             'load_stribeck_external')
# BAM's friction models by their names there, each with the simpler ones that it contains. Offset
# and delay are fitted in all of them, as BAM does.
LADDER: Mapping[str, tuple[str, ...]] = {
    'm1': _COMMON,
    'm2': (*_COMMON, *_STRIBECK),
    'm3': (*_COMMON, 'load_friction'),
    'm4': (*_COMMON, *_STRIBECK, 'load_friction', 'load_stribeck'),
    'm5': (*_COMMON, *_STRIBECK, *_DIRECTED),
    'm6': (*_COMMON, *_STRIBECK, *_DIRECTED, 'load_quadratic_motor', 'load_quadratic_external'),
}
PARENTS: Mapping[str, tuple[str, ...]] = {
    'm1': (), 'm2': ('m1',), 'm3': ('m1',), 'm4': ('m2', 'm3'), 'm5': ('m4',), 'm6': ('m5',)}


@dataclass(frozen=True)
class Fit:
    """
    Numbers that were fitted.

    Attributes
    ----------
    values : by name
    error : mean over the tests of the mean absolute position error [rad]

    """

    values: dict[str, float]
    error: float


def error(tests: Sequence[ServoLog], values: Values) -> float:
    """Return the mean over tests of the mean absolute position error of free runs [rad]."""
    row = vector(values)
    return float(np.mean([test.error(row) for test in tests]))


def begun(names: Sequence[str], known: Values | None = None) -> dict[str, float]:
    """
    Return values to begin with: those that are known, else the usual ones.

    What a simpler model knows under one name serves for the two that part it by direction; an
    effect that a simpler model lacks begins absent.
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
    Fit numbers to tests.

    Parameters
    ----------
    tests
        the logs
    names
        what is fitted; everything else is absent
    begins
        known values to begin from, beside the usual ones
    runs
        how many times all tests are run, at most
    seed
        of the random candidates

    """
    starts = [(begun(names), WIDE), *((begun(names, known), NEAR) for known in begins)]
    share = int(0.75 * runs / len(starts))
    fits = [_searched(tests, names, start, spread, share, seed + i)
            for i, (start, spread) in enumerate(starts)]
    best = min(fits, key=lambda fit: fit.error)
    return _searched(tests, names, best.values, CLOSE, runs - share * len(starts), seed)


def nearby(tests: Sequence[ServoLog], names: Sequence[str], start: Values, runs: int,
           seed: int = 1) -> Fit:
    """Fit numbers to tests in the neighbourhood of where they are; see `refit`."""
    return _searched(tests, names, begun(names, start), 0.5 * NEAR, runs, seed)


def _searched(tests: Sequence[ServoLog], names: Sequence[str], start: Values, spread: float,
              runs: int, seed: int) -> Fit:
    """Search with CMA-ES; what it ends with is never worse than the start."""
    items = [number(name) for name in names]

    def named(shares: Sequence[float]) -> dict[str, float]:
        return {name: item.value(float(share))
                for name, item, share in zip(names, items, shares, strict=True)}

    begin = named([item.share(start[name]) for name, item in zip(names, items, strict=True)])
    best = Fit(begin, error(tests, begin))
    inside = [min(max(item.share(start[name]), 0.01), 0.99)
              for name, item in zip(names, items, strict=True)]
    strategy = cma.CMAEvolutionStrategy(inside, spread, {
        'bounds': [0.0, 1.0], 'seed': seed, 'maxfevals': runs, 'verbose': -9, 'tolfun': 1e-6})
    while not strategy.stop():
        candidates = strategy.ask()
        strategy.tell(candidates, [error(tests, named(c)) for c in candidates])
    if strategy.result.fbest < best.error:
        best = Fit(named(strategy.result.xbest), float(strategy.result.fbest))
    return best
