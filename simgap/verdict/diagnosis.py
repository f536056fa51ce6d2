# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of a gap between any `Machine` and its model: where, which effect, how far."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import time

from simgap.fit.blas import one_blas_thread
from simgap.fit.noise import found_noise
from simgap.machine.by_label import by_label
from simgap.machine.check import check_machine
from simgap.machine.contract import Machine
from simgap.next_test.confusability import could_hide
from simgap.next_test.rivals import Findings, Rival, rivals_of
from simgap.settings import DEFAULT, Settings
from simgap.verdict import localisation, unknown_input, verdict
from simgap.verdict.conclusion import concluded
from simgap.verdict.intervals import values_with_intervals
from simgap.verdict.interventions import interventions
from simgap.verdict.lack_of_fit import remainders, residual_tests
from simgap.verdict.record import Named, Verdict

Progress = Callable[[float, str], None]


def diagnose(machine: Machine, progress: Progress = lambda share, doing: None, threads: int = 2,
             settings: Settings = DEFAULT, limits: Mapping[str, float] | None = None,
             earlier: Sequence[Rival] = ()) -> Verdict:
    """
    Diagnose a machine in its experiments.

    Raises MachineError if the machine breaks its contract; the message says where.

    progress : called with the share that is done, 0 to 1, and what is being done
    threads : how many hypotheses are fitted at once
    limits : for some signals, the remainder beyond noise from which it matters, in their units
    earlier : answers of a verdict on some of the tests, fitted to all from where they have ended,
        beside what the search finds; one whose effects the machine does not know is left out
    """
    with one_blas_thread():
        check_machine(machine)
        return _diagnose(by_label(machine), progress, threads, settings, limits or {}, earlier)


def _diagnose(machine: Machine, progress: Progress, threads: int, settings: Settings,
              limits: Mapping[str, float], earlier: Sequence[Rival]) -> Verdict:
    began = time.monotonic()
    found = concluded(machine, progress, threads, settings, earlier)
    problem, none, best, decision = found.problem, found.none, found.best, found.decision
    places: Sequence[unknown_input.Place] = ()
    located: Sequence[localisation.Located] = ()
    parts: Mapping[str, float] = {}
    if decision.word == 'unknown_effect' or decision.unknown >= settings.verdict.partly:
        progress(0.95, 'where an unknown input may act')
        parts, places = localisation.parts_of_the_unknown(problem, none.state, decision.lack)
    if decision.word == 'unknown_effect':
        located = localisation.of_the_unknown(problem, none.state, parts)
    elif decision.word in ('explained', 'partly_explained'):
        located = localisation.of_effects(problem, decision.answers, none.state, best.state)
    else:
        # a verdict without a gap names no place; the next test still looks into these parts
        places = ()
    findings = Findings(
        rivals_of(problem, decision.answers, found.evidence.inflation, settings.planning,
                  found.doubted), found.evidence.inflation, found_noise(problem.experiments),
        unnamed={part: decision.unknown * share for part, share in parts.items()
                 if share >= settings.localisation.least_share})
    healthy = decision.word == 'no_gap'
    hidden = could_hide(problem, (none if healthy else best).state, findings.inflated) if (
        healthy or not findings.are_open(settings)) else []
    planning = {
        **machine.planning,
        **replace(findings, shown={item['effect']: item['size'] for item in hidden
                                   if item['size'] is not None}).as_data()}
    labels = interventions(problem, none, best, threads) or None
    progress(1.0, 'done')
    return Verdict(
        word=decision.word,
        statements=verdict.statements(decision, best),
        where=located,
        which=[Named(**answer) for answer in verdict.which(
            decision, settings.verdict, lambda answer: values_with_intervals(
                answer, found.deviating(answer)))],
        also_seen=verdict.also_seen(found.evidence.hypotheses, settings, found.evidence.inflation),
        confusable=decision.confusable,
        how_far=found.reach,
        could_hide=hidden if healthy else [],
        remains=remainders(problem, best.state, limits),
        residual_tests=residual_tests(problem, best.state, decision.lack),
        may_enter_at=[place for place in places if place.evidence > 0.0],
        fits=found.evidence.as_data(), planning=planning, seconds=time.monotonic() - began,
        notes=[*machine.notes, *found.notes], labels=labels,
        machine=problem.machine, none=none, best=best)
