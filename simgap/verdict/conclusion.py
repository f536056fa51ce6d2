# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""From the machine's fits to what is decided about them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import math
from statistics import fmean
from typing import Any

from simgap.fit.least_squares import LeastSquares
from simgap.fit.noise import with_noise_left
from simgap.machine.contract import Machine
from simgap.search.hypothesis import Hypothesis
from simgap.search.rival import Rival
from simgap.search.search import Found, Search
from simgap.settings import Settings
from simgap.verdict import unknown_input, verdict
from simgap.verdict.held_out import held_out
from simgap.verdict.intervals import deviations, inflation, jackknife
from simgap.verdict.lack_of_fit import enough
from simgap.verdict.law_fit import lawful_fit, LawfulFit


@dataclass(frozen=True)
class Conclusion:
    """What the fits to a machine's experiments say."""

    found: Found  # every fit, with its evidence
    reach: dict[str, Any]  # how far the gap shrinks, see `held_out`
    places: Sequence[unknown_input.Place]  # where an unknown input may act, likeliest first
    # standard deviations of the effects' values
    deviating: Callable[[Hypothesis], dict[str, float]]
    decision: verdict.Decision  # what follows from it
    lawful: LawfulFit | None  # the best hypothesis with a law, where that is better


def concluded(machine: Machine, progress: Callable[[float, str], None], threads: int,
              settings: Settings, earlier: Sequence[Rival] = ()) -> Conclusion:
    """Search, withhold and decide; parameters as in `diagnosis.diagnose`."""
    found = Search(LeastSquares(machine, settings=settings), progress, threads, earlier).run()
    best = found.best.with_jacobian(found.problem)
    progress(0.8, 'withheld data')
    reach = held_out(found.problem, found.none, best, threads)
    found = replace(found, hypotheses=[best, *found.hypotheses[1:]])
    progress(0.95, 'where an unknown input may act')
    point = best.state.point()
    # what is louder than the stated noise, or slower than the error of a model, is no noise
    machine = found.problem.machine.truncated()
    stated = with_noise_left(machine, point, settings.noise, 1.0)
    judged = LeastSquares(stated, settings=settings)
    places = unknown_input.places(
        judged, point, None if machine.learnable else judged.as_stated())
    law = lawful_fit(found, places, threads)
    decision = verdict.decide(found, places, law.gained if law else -math.inf,
                              enough(found.problem))
    if law and law.gained > 0.0:
        # a course over time may be anything: places are weighed by laws, below the one that fits
        places = [law.place, *sorted(
            (replace(place, evidence=min(place.law.evidence, law.place.evidence), law=None)
             for place in places if place.law and place.name != law.place.name),
            key=lambda place: -place.evidence)]
    elif decision.unknown >= settings.verdict.partly:
        # a place is not to blame for what pulses cannot follow, nor for more than its everyday
        machine = machine.with_experiments([replace(e, process=None) for e in machine.experiments])
        places = unknown_input.places(LeastSquares(machine, settings=settings), point)
    return Conclusion(found, reach, places, _deviating(found, reach), decision,
                      law if law and law.gained > 0.0 else None)


def _deviating(found: Found, reach: Mapping[str, Any]) -> Callable[[Hypothesis], dict[str, float]]:
    """Return what gives standard deviations of the values of a hypothesis, by name."""
    problem, best = found.problem, found.best
    inflated = dict(zip((p.name for p in best.state.parameters),
                        inflation(problem, best.state).tolist(), strict=True))
    usual = fmean([inflated[p.name] for p, _ in best.values] or [1.0])
    values: dict[str, list[float]] = {}
    for fold in reach['folds']:
        for name, value in fold['values'].items():
            values.setdefault(name, []).append(value)
    # how much the effects' numbers depend on the tests
    between_tests = {name: jackknife(found) for name, found in values.items()}
    return lambda hypothesis: deviations(
        hypothesis, lambda name: inflated.get(name, usual), problem.settings,
        between_tests if hypothesis.effects == best.effects else {})
