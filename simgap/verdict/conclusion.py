# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""From the machine's fits to what is decided about them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any

from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import Machine
from simgap.next_test.rivals import Rival
from simgap.search.elimination import backward_elimination, converged_rivals, forward_selection
from simgap.search.evidence import Evidence
from simgap.search.full_fits import FullFits
from simgap.search.hypothesis import Hypothesis
from simgap.search.search import Search
from simgap.settings import Settings
from simgap.verdict import verdict
from simgap.verdict.doubts import Doubt, doubts
from simgap.verdict.held_out import held_out, refuted, shows_no_gap
from simgap.verdict.intervals import deviations, inflation, jackknife
from simgap.verdict.interventions import simplified
from simgap.verdict.lack_of_fit import implausibility, lack_of_fit


@dataclass(frozen=True)
class Conclusion:
    """What the fits to a machine's experiments say."""

    problem: LeastSquares  # the whole experiments, with the noise of the motion that was found
    none: Hypothesis  # without effects
    best: Hypothesis  # with the likeliest effects
    reach: dict[str, Any]  # how far the gap shrinks, see `held_out`
    # standard deviations of the effects' values
    deviating: Callable[[Hypothesis], dict[str, float]]
    doubted: Callable[[Hypothesis], dict[str, Doubt]]  # whether effects exceed their tolerances
    evidence: Evidence  # every fit, with what each leaves
    decision: verdict.Decision  # what follows from it
    notes: tuple[str, ...]  # for people


def concluded(machine: Machine, progress: Callable[[float, str], None], threads: int,
              settings: Settings, earlier: Sequence[Rival] = ()) -> Conclusion:
    """Fit, select, withhold and decide; parameters as in `diagnosis.diagnose`."""
    # A course over time has so many numbers that it imitates what moves the same part. Where it
    # looks like no real one, everything is done without it first.
    whole = LeastSquares(machine, settings=settings)

    def report(share: float, doing: str) -> None:
        progress(0.9 * share, doing)

    fits = FullFits(whole, report, threads)
    found = fits.compared(*Search(whole, report, threads, earlier).run())
    hypotheses, best = backward_elimination(fits, found, settings)
    hypotheses, best = converged_rivals(fits, hypotheses, best, settings)
    if courses := _implausible_courses(best, settings):
        names = ' + '.join(courses)
        plain = concluded(machine.without(courses), lambda share, doing: progress(
            0.9, f'without {names}: {doing}'), threads, settings, earlier)
        if plain.decision.word != 'unknown_effect':
            return replace(plain, notes=(
                *plain.notes,
                f'{names} fits best, as no real one would: the verdict is without it'))
    hypotheses, best = forward_selection(fits, hypotheses, best, settings)
    # the noise is that of the motion that was found
    problem = fits.problem
    hypotheses, best = simplified(problem, hypotheses, best)
    none, best = hypotheses[0], best.with_jacobian(problem)
    progress(0.9, 'withheld data')
    reach = held_out(problem, none, best, threads)
    notes = []
    if refuted(reach):
        notes.append(f'{" + ".join(best.effects)} fits best and closes nothing of the gap of '
                     'withheld data: no effect is named')
        hypotheses, best = [none], none.with_jacobian(problem)
        reach = held_out(problem, none, best, threads)
    return _decided(fits, none, best, hypotheses, reach, notes)


def _decided(fits: FullFits, none: Hypothesis, best: Hypothesis,
             hypotheses: Sequence[Hypothesis], reach: dict[str, Any],
             notes: list[str]) -> Conclusion:
    """Return what follows from the fits, with their doubts and what each leaves."""
    problem, settings = fits.problem, fits.problem.settings
    inflated = dict(zip((p.name for p in best.state.parameters),
                        inflation(problem, best.state).tolist(), strict=True))
    usual = fmean([inflated[p.name] for p, _ in best.values] or [1.0])
    between_tests = _between_tests(reach)
    beyond = (settings.interval.sure_of_all if shows_no_gap(reach, settings)
              else settings.interval.sure)

    def deviating(hypothesis: Hypothesis) -> dict[str, float]:
        return deviations(
            hypothesis, lambda name: inflated.get(name, usual), settings.interval,
            between_tests if hypothesis.effects == best.effects else {})

    def doubted(hypothesis: Hypothesis, fitted: Sequence[Hypothesis]) -> dict[str, Doubt]:
        return doubts(hypothesis, deviating(hypothesis), (none.cost - hypothesis.cost) / usual,
                      settings.interval, beyond,
                      _own_gains(hypothesis, _least_costs(fitted), usual))

    def with_doubts(hypothesis: Hypothesis, fitted: Sequence[Hypothesis]) -> Hypothesis:
        return replace(hypothesis, doubts={
            effect: doubt.probability for effect, doubt in doubted(hypothesis, fitted).items()})

    first = with_doubts(best, hypotheses)
    rests = _rests(fits, hypotheses, first, settings)
    fitted = [*hypotheses, *rests.values()]
    # the fit that a small doubt has asked for is compared, but is not an answer
    answers = [*hypotheses, *(rests[effect] for effect in rests if effect in first.unsure)]
    hypotheses = [with_doubts(h, fitted) for h in answers]
    best = with_doubts(best, fitted)
    if best.unsure:
        notes.append(f'{" + ".join(sorted(best.unsure))}: not surely beyond the tolerance, and '
                     'therefore not named')
    evidence = _evidence(problem, hypotheses, best, reach['explained_fraction']['ci95'][1], usual)
    return Conclusion(problem, none, best, reach, deviating,
                      lambda hypothesis: doubted(hypothesis, fitted), evidence,
                      evidence.decide(settings), tuple(notes))


def _implausible_courses(best: Hypothesis, settings: Settings) -> tuple[str, ...]:
    found = implausibility(best, settings)
    return tuple(effect for effect, form in zip(best.effects, best.forms, strict=True)
                 if form.is_course and found[effect] > 1.0)


def _between_tests(reach: Mapping[str, Any]) -> dict[str, float]:
    """Return how much the effects' numbers depend on the tests, by name."""
    values: dict[str, list[float]] = {}
    for fold in reach['folds']:
        for name, value in fold['values'].items():
            values.setdefault(name, []).append(value)
    return {name: jackknife(found) for name, found in values.items()}


def _rests(fits: FullFits, hypotheses: Sequence[Hypothesis], best: Hypothesis,
           settings: Settings) -> dict[str, Hypothesis]:
    """Return the best without each doubted effect, where there is no such fit, by effect."""
    # The search gives up what is far behind the best, and so the best without what gains most.
    known = {frozenset(h.effects) for h in hypotheses}
    return {effect: fits.without(best, effect) for effect in best.effects
            if best.doubts.get(effect, 0.0) >= settings.interval.least_doubt
            and frozenset(best.effects) - {effect} not in known}


def _least_costs(hypotheses: Sequence[Hypothesis]) -> dict[frozenset[str], float]:
    return {frozenset(h.effects): h.cost
            for h in sorted(hypotheses, key=lambda h: h.cost, reverse=True)}


def _own_gains(hypothesis: Hypothesis, costs: Mapping[frozenset[str], float],
               inflated: float) -> dict[str, float]:
    """Return what each effect gains over the best fit without it, where there is one."""
    rests = {effect: frozenset(hypothesis.effects) - {effect} for effect in hypothesis.effects}
    return {effect: (costs[rest] - hypothesis.cost) / inflated
            for effect, rest in rests.items() if rest in costs}


def _evidence(problem: LeastSquares, hypotheses: Sequence[Hypothesis], best: Hypothesis,
              explained: float | None, inflated: float) -> Evidence:
    """Return the fits with what each leaves; only that of the best has converged."""
    top = verdict.best(hypotheses, problem.settings)
    raw = problem.residuals({})
    return Evidence(hypotheses, [
        lack_of_fit(problem, raw, best if h is top else h, explained if h.named else None)
        for h in hypotheses], inflated)
