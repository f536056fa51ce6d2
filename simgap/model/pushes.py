# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
When something unknown pushes, and how strongly.

The likeliest course of an input (`diagnosis.courses`) is smooth and shrunk, and the numbers of the
model share its constant part. So it only says when the push changes. The levels between are then
fitted together with the numbers of the model, which stay within their tolerances.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import DisturbanceInput, FloatArray
from simgap.model.machine import OwnMachine
from simgap.verdict.unknown_input import courses

# A further level must gain this many times the noise's variance and the logarithm of the samples.
_PRICE = 6.0
# A level of less than this share of the greatest one is rest, and two that differ by less are one.
_REST_SHARE = 0.25
_LEAST_NODES = 8
# A level has at least so many: an edge between two levels is none.
_LEAST_LEVEL = 3
# Simulations with other derivatives; the response to a push is nearly linear.
_ITERATIONS = 3
# Step of a level's difference quotient, as a share of what moves the machine a little.
_LEVEL_STEP = 0.1


@dataclass(frozen=True)
class PushedSpan:
    """A span from_s to until_s [s] of a test in which a mean push enters, in its place's unit."""

    test: str
    from_s: float
    until_s: float
    size: float


def pushes(problem: LeastSquares, point: Mapping[str, float],
           place: DisturbanceInput) -> list[PushedSpan]:
    """Return the spans in which something pushes at a place; `point` is fitted without effects."""
    machine = problem.machine
    assert isinstance(machine, OwnMachine)
    edges = [level_edges(*course) for course in courses(problem, point, place)]
    levels = _fitted_levels(machine, point, machine.push_at(place.name), edges)
    greatest = max((float(np.abs(item).max()) for item in levels), default=0.0)
    found: list[PushedSpan] = []
    for log, moments, sizes in zip(machine.logs, edges, levels, strict=True):
        spans = [PushedSpan(log.name, float(a), float(b), float(size))
                 for a, b, size in zip(moments, moments[1:], sizes, strict=False)]
        spans = merged(spans, _REST_SHARE * greatest)
        if len(spans) > 1:  # what is there all the time has no begin
            found += [span for span in spans if abs(span.size) > _REST_SHARE * greatest]
    return found


def level_edges(time: FloatArray, course: FloatArray) -> FloatArray:
    """
    Return the times [s] between which a course, shape (m,), stays at a level, shape (k,).

    They minimise the squares about the levels plus a price for each (B. Jackson et al., An
    algorithm for optimal partitioning of data on an interval, IEEE Signal Processing Letters 12,
    2005).
    """
    if time.size < _LEAST_NODES:
        return time[[0, -1]]
    sigma = float(np.median(np.abs(np.diff(course)))) / (0.6745 * np.sqrt(2.0)) + 1e-300
    places = _partition(course / sigma)
    levels = [float(np.median(course[a:b])) for a, b in zip(places, places[1:], strict=False)]
    inner = [_crossing(time, course, place, 0.5 * (one + other)) for place, one, other
             in zip(places[1:-1], levels, levels[1:], strict=False)]
    return np.array([time[0], *inner, time[-1]])


def _partition(values: FloatArray) -> list[int]:
    """Return where levels begin, and the end, for values with noise of variance 1."""
    n = values.size
    sums, squares = (np.r_[0.0, np.cumsum(values ** power)] for power in (1, 2))
    price = _PRICE * np.log(n)
    best, before = np.full(n + 1, np.inf), np.zeros(n + 1, int)
    best[0] = -price
    for end in range(_LEAST_LEVEL, n + 1):
        begins = np.arange(end - _LEAST_LEVEL + 1)
        spread = (squares[end] - squares[begins]
                  - (sums[end] - sums[begins]) ** 2 / (end - begins))
        cost = best[begins] + spread + price
        before[end] = int(np.argmin(cost))
        best[end] = cost[before[end]]
    edges = [n]
    while edges[-1] > 0:
        edges.append(int(before[edges[-1]]))
    return edges[::-1]


def _crossing(time: FloatArray, course: FloatArray, place: int, level: float) -> float:
    """Return when a course crosses a level just before a sample, or the middle if it does not."""
    one, other = course[place - 1] - level, course[place] - level
    share = one / (one - other) if one * other < 0.0 else 0.5
    return float(time[place - 1] + share * (time[place] - time[place - 1]))


def _fitted_levels(machine: OwnMachine, point: Mapping[str, float], name: str,
                   edges: Sequence[FloatArray]) -> list[FloatArray]:
    """Return the levels between the edges of each test, fitted with the model's numbers."""
    numbers = machine.nuisances
    counts = [item.size - 1 for item in edges]
    size = machine.model.push[name].size
    sigmas = np.array([p.prior_sigma or np.inf for p in numbers])

    def residuals(x: FloatArray) -> FloatArray:
        here = {p.name: value for p, value in zip(numbers, x, strict=False)}
        parts = [x[:len(numbers)] / sigmas]
        first = len(numbers)
        for k, (log, moments, count) in enumerate(zip(machine.logs, edges, counts, strict=True)):
            # the first and the last level hold beyond the edges, too
            level = np.clip(np.searchsorted(moments, log.time, side='right') - 1, 0, count - 1)
            course = size * x[first:first + count][level]
            first += count
            experiment = machine.experiments[k]
            parts.append(np.nan_to_num((machine.pushed(here, k, {name: course})
                                        - experiment.measured) / experiment.noise).ravel())
        return np.concatenate(parts)

    low = np.array([*(p.low for p in numbers), *([-np.inf] * sum(counts))])
    high = np.array([*(p.high for p in numbers), *([np.inf] * sum(counts))])
    steps = np.array([*(p.step for p in numbers), *([_LEVEL_STEP] * sum(counts))])
    x = np.array([*(point.get(p.name, 0.0) for p in numbers), *([0.0] * sum(counts))])
    for _ in range(_ITERATIONS):
        here = residuals(x)
        signed = np.where(x + steps <= high, steps, -steps)
        slopes = np.array([(residuals(x + step) - here) / step[i]
                           for i, step in enumerate(np.diag(signed))]).T
        x = np.clip(x + lsq_linear(slopes, -here, (low - x, high - x + 1e-12)).x, low, high)
    return list(np.split(size * x[len(numbers):], np.cumsum(counts)[:-1]))


def merged(spans: Sequence[PushedSpan], alike: float) -> list[PushedSpan]:
    """Return spans with neighbours made one whose sizes differ by no more than `alike`."""
    found: list[PushedSpan] = []
    for span in spans:
        last = found[-1] if found else None
        if last is None or abs(last.size - span.size) > alike:
            found.append(span)
            continue
        share = (span.until_s - span.from_s) / (span.until_s - last.from_s)
        found[-1] = PushedSpan(span.test, last.from_s, span.until_s,
                               (1.0 - share) * last.size + share * span.size)
    return found
