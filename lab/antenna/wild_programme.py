# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The programme of a wild case: four recordings of other kinds, lengths and rests.

As in `programme`, the first is slow, the second fast and the third of broad band. The fourth is
of any other kind; no diagnosis gets it. The shapes of square, triangle, multisine and chirp are
those of `programme`. Steps, tracking and slews are straight lines between knots.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from lab.antenna import programme
from lab.antenna.sheet import CaseSheet
from lab.antenna.waveform import MOST_KNOTS
import numpy as np

KEPT_BACK = 'rec_d'
RECORDINGS = (*programme.RECORDINGS, KEPT_BACK)
SHORTEST_S, LONGEST_S = 10.0, 300.0
RATE_HZ = (50.0, 1000.0)
MOST_SAMPLES = 100_000          # of a recording: a faster recorder takes shorter ones
RESTING = 0.6                   # share of the recordings that begin with a rest
REST_S = (0.5, 10.0)
LONGEST_REST = 0.3              # of the recording
KNOWLEDGE = {'whole': 0.5, 'no sensors': 0.3, 'no sheet': 0.2}
SIDEREAL_DEG_S = 0.00418

Shape = Callable[[float, float, np.random.Generator], dict[str, Any]]
Shapes = Mapping[str, Mapping[str, Shape]]


class Programme(NamedTuple):
    """The tests of one wild case, and what the tester knows of them."""

    sample_rate_hz: float
    durations_s: list[float]
    sheets: list[CaseSheet]
    given: list[dict[str, Any] | None]


def draw_programme(shapes: Shapes, tolerance: float, longest: float,
                   random: np.random.Generator) -> Programme:
    """
    Draw the tests of one case, one for each name in RECORDINGS, none over `longest` [s].

    Shapes are by group ('slow', 'fast', 'broad') and kind. `tolerance` is the machine's largest
    relative deviation from the reference.
    """
    rate = programme.log_uniform(*RATE_HZ, 0, random)
    longest = min(longest, MOST_SAMPLES / rate)
    durations = [programme.log_uniform(SHORTEST_S, longest, 1, random) for _ in RECORDINGS]
    drawn = [str(random.choice(sorted(group))) for group in shapes.values()]
    makers = {kind: make for group in shapes.values() for kind, make in group.items()}
    drawn.append(str(random.choice(sorted(makers.keys() - set(drawn)))))
    plain = programme.draw_sheets(tolerance, durations[0], random)
    # the fourth is recorded where one of the three was
    basis = [*plain, plain[int(random.integers(len(plain)))]]
    sheets = []
    for kind, duration, sheet in zip(drawn, durations, basis):
        rest = 0.0
        if random.uniform() < RESTING:
            rest = round(float(random.uniform(REST_S[0], min(
                REST_S[1], LONGEST_REST * duration))), 2)
        bias = dict(sheet.bias)
        if 'at_s' in bias:
            bias['at_s'] = round(float(random.uniform(0.25, 0.55)) * duration, 1)
        sheets.append(replace(sheet, bias=bias, waveform=makers[kind](duration, rest, random)))
    knowledge = str(random.choice(list(KNOWLEDGE), p=list(KNOWLEDGE.values())))
    given = [None if knowledge == 'no sheet' and k < len(plain)
             else sheet.given(sensors=knowledge == 'whole') for k, sheet in enumerate(sheets)]
    return Programme(rate, durations, sheets, given)


def knots(times: list[float], rates: list[float]) -> dict[str, Any]:
    """Return a waveform that is linear between knots; those beyond the most are left out."""
    return {'type': 'knots', 'times_s': [round(float(t), 4) for t in times[:MOST_KNOTS]],
            'rates_deg_s': [round(float(r), 6) for r in rates[:MOST_KNOTS]]}


def levels(starts: list[float], rates: list[float], end: float) -> dict[str, Any]:
    """Return a waveform of constant rates, each from its start to the next one's."""
    ends = [*starts[1:], end]
    return knots([t for pair in zip(starts, ends) for t in pair],
                 [rate for rate in rates for _ in range(2)])


def _later(shape: dict[str, Any], rest: float) -> dict[str, Any]:
    """Return a waveform that begins after a rest, if there is one."""
    if not rest:
        return shape
    return {**shape, 'start_s': round(rest + shape.get('start_s', 0.0), 4)}


def _square(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    return _later(programme.slow_square(random), rest)


def _triangle(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    return _later(programme.fast_triangle(random), rest)


def _multisine(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    return _later(programme.multisine(random), rest)


def _chirp(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    return _later(programme.chirp(duration - rest, random), rest)


def _steps(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Step the rate to random levels, about zero in the mean."""
    hold = programme.log_uniform(1.5, 6.0, 2, random)
    starts = np.arange(rest, duration, max(hold, 2.2 * duration / MOST_KNOTS))
    size = programme.log_uniform(0.05, 0.3, 4, random)
    rates = size * random.uniform(-1.0, 1.0, len(starts))
    rates -= np.mean(rates)
    return levels(starts.tolist(), rates.tolist(), duration + 1.0)


def _tracking(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Follow a source, and look beside it and back in turn, as a radiometer does."""
    follow = SIDEREAL_DEG_S * float(random.choice([-1.0, 1.0])) * float(random.uniform(0.3, 1.0))
    beside = programme.log_uniform(0.03, 0.12, 4, random)
    move, stay = float(random.uniform(1.0, 2.5)), float(random.uniform(2.0, 6.0))
    starts, rates, t = [], [], rest
    while t < duration:
        for length, rate in ((stay, 0.0), (move, beside), (stay, 0.0), (move, -beside)):
            starts.append(t)
            rates.append(follow + rate)
            t += length
    return levels(starts, rates, max(t, duration + 1.0))


def _slews(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Accelerate, run, slow down and pause; then the same backwards."""
    rate = float(random.uniform(0.4, 0.685))
    ramp, run = float(random.uniform(0.5, 2.0)), float(random.uniform(1.0, 4.0))
    pause = float(random.uniform(0.5, 2.0))
    times, rates, t, sign = [], [], rest, 1.0
    while t < duration:
        for length, reached in ((0.0, 0.0), (ramp, sign), (run, sign), (ramp, 0.0)):
            t += length
            times.append(t)
            rates.append(rate * reached)
        t, sign = t + pause, -sign
    return knots([*times, max(t, duration + 1.0)], [*rates, 0.0])


SHAPES: Shapes = {
    'slow': {'square': _square, 'tracking': _tracking},
    'fast': {'triangle': _triangle, 'slews': _slews},
    'broad': {'multisine': _multisine, 'chirp': _chirp, 'steps': _steps}}
