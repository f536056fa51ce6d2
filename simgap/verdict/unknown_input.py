# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where an unknown input acts: the part of the machine that a gap sits in, whatever its cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import DisturbanceInput, FloatArray
from simgap.machine.pulses import answers
from simgap.machine.with_law import Law
from simgap.verdict.input_evidence import InputEvidence
from simgap.verdict.law import likeliest, predicted, quantities_of, within_a_turn

# Times within which an input changes, in pulses.
_SMOOTH = (0.0, 5.0)
# Pulses of a reading in one test.
_MOST_PULSES = 300


@dataclass(frozen=True)
class Place:
    """A place where an unknown input may act."""

    name: str  # for people
    component: str  # the part of the machine
    evidence: float  # natural logarithm of how much likelier an input makes the gap
    explained: float  # share of the gap's energy that it explains, net of what its freedom costs
    law: Law | None = None  # the likeliest one of an input there


def places(problem: LeastSquares, point: Mapping[str, float],
           plain: LeastSquares | None = None) -> list[Place]:
    """
    Return where an unknown input may act, the likeliest first; `point` is of the nuisances.

    A law is sought in `plain`, whose noise is that which is stated, because a slow gap may pass
    for noise; none is sought without it.
    """
    evidence = InputEvidence.at(problem, point)
    for_laws = InputEvidence.at(plain, point) if plain else None
    quantities = quantities_of(problem.machine, predicted(problem.machine, point)) if plain else {}
    found = []

    def judged(place: DisturbanceInput, responses: Sequence[FloatArray],
               peaks: Sequence[FloatArray], smooth: Sequence[float]) -> None:
        weighed, share, _ = evidence.of_course(
            *evidence.reduced(_seen(problem, responses)), [own.size for own in peaks], smooth)
        # a course over time is noise of the process where something acts every day
        law = likeliest(for_laws, *for_laws.reduced(_seen(plain, responses)), {
            name: replace(quantity, values=[
                np.interp(moments, e.time, own) for moments, e, own in zip(
                    peaks, problem.experiments, quantity.values, strict=True)])
            for name, quantity in quantities.items()
            if not (place.everyday and name == 'time')}) if plain and for_laws else None
        if plain and for_laws:
            fine = within_a_turn(for_laws, plain, point, place, quantities)
            law = max(filter(None, (law, fine)), key=lambda item: item.evidence, default=None)
        found.append((share, Place(place.name, place.component, weighed, evidence.net(weighed),
                                   law.in_units(place.size, place.unit) if law else None)))

    for place in problem.machine.disturbance_inputs:
        judged(place, *_columns(problem, point, place), _SMOOTH)
    readings = readings_of(problem)
    for c, reading in enumerate(readings):
        judged(reading, *_of_reading(problem, c, reading.size), (0.0,))
    # what repeats itself too fast for a pulse, such as a hum, lies in its reading
    most = 2.0 * max(share for share, _ in found)
    for c, reading in enumerate(readings):
        weighed, share = evidence.repeated(c, problem)
        if share > most:
            found.append((share, Place(reading.name, reading.component, weighed,
                                       evidence.net(weighed))))
    return sorted((place for _, place in found), key=lambda place: -place.evidence)


def readings_of(problem: LeastSquares) -> list[DisturbanceInput]:
    """Return the readings as places where an unknown input may act."""
    first = problem.experiments[0]
    return [DisturbanceInput(
        f'reading of {channel}', channel, unit=first.units[c],
        size=float(np.median(np.concatenate([e.noise[:, c] for e in problem.experiments]))))
        for c, channel in enumerate(first.channels)]


def courses(problem: LeastSquares, point: Mapping[str, float],
            place: DisturbanceInput) -> list[tuple[FloatArray, FloatArray]]:
    """Return what would have to enter at a place, by test: times [s] and values, (m,) each."""
    evidence = InputEvidence.at(problem, point)
    responses, times = _columns(problem, point, place)
    counts = [moments.size for moments in times]
    _, _, heights = evidence.of_course(
        *evidence.reduced(_seen(problem, responses)), counts, _SMOOTH)
    return list(zip(times, np.split(heights, np.cumsum(counts)[:-1]), strict=True))


def _columns(problem: LeastSquares, point: Mapping[str, float],
             place: DisturbanceInput) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the answers to heights at a place, and when these are [s]."""
    # Both are for each experiment; answers have the shape (n, c, heights), times (heights,).
    found = answers(problem.machine, dict(point), place)
    return ([own.summed(np.eye(own.times.size), e.time.size)
             for own, e in zip(found, problem.experiments, strict=True)],
            [own.times for own in found])


def _seen(problem: LeastSquares, responses: Sequence[FloatArray]) -> list[FloatArray]:
    """Return changes of readings as the residuals of a problem have them, shape (n c, m) each."""
    return [problem.whitened(k, own) for k, own in enumerate(responses)]


def components(found: Sequence[Place], caution: float) -> dict[str, float]:
    """Return how likely each part is, by its best place; all sum to 1."""
    # the share `caution` of the evidence counts, because residuals are not white
    best: dict[str, float] = {}
    for place in found:
        best[place.component] = max(best.get(place.component, 0.0), place.evidence)
    top = max(best.values(), default=0.0)
    weight = {name: float(np.exp(caution * (value - top))) for name, value in best.items()}
    total = sum(weight.values())
    return {name: value / total for name, value in weight.items()}


def _of_reading(problem: LeastSquares, channel: int,
                size: float) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return pulses of a reading itself, of a size, and their peaks, as `_columns` does."""
    responses, peaks = [], []
    for k, experiment in enumerate(problem.experiments):
        # the cost grows with the third power of their number
        time, last = experiment.time, float(experiment.time[-1])
        rise = max(problem.machine.time_scales.pulse_s, (last - float(time[0])) / _MOST_PULSES)
        moments = np.arange(float(time[0]), last - 2.0 * rise, rise) + rise
        pulses = np.zeros((*experiment.measured.shape, moments.size))
        pulses[:, channel] = size * np.maximum(
            0.0, 1.0 - np.abs(time[:, np.newaxis] - moments) / rise)
        responses.append(pulses)
        peaks.append(moments)
    return responses, peaks
