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
from simgap.machine.everyday import with_everyday
from simgap.next_test.confusability import could_hide
from simgap.next_test.rivals import Findings, rivals_of
from simgap.search.rival import Rival
from simgap.settings import DEFAULT, Settings
from simgap.verdict import localisation, verdict
from simgap.verdict.conclusion import concluded
from simgap.verdict.intervals import values_with_intervals
from simgap.verdict.interventions import interventions
from simgap.verdict.lack_of_fit import remainders
from simgap.verdict.record import Named, Verdict
from simgap.verdict.reproducibility import reproducibility
from simgap.verdict.unknown_input import components

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
        return _diagnose(by_label(with_everyday(machine)), progress, threads, settings,
                         limits or {}, earlier)


def _diagnose(machine: Machine, progress: Progress, threads: int, settings: Settings,
              limits: Mapping[str, float], earlier: Sequence[Rival]) -> Verdict:
    began = time.monotonic()
    found = concluded(machine, progress, threads, settings, earlier)
    problem, decision = found.found.problem, found.decision
    none, best, inflated = found.found.none, found.found.best, found.found.evidence.temperature
    unsure = decision.word == 'unknown_effect' or decision.unknown >= settings.verdict.partly
    parts = components(found.places, settings.localisation.caution)
    located: Sequence[localisation.Located] = ()
    if decision.word == 'unknown_effect':
        located = localisation.of_the_unknown(problem, none.state, parts)
    elif decision.word in ('explained', 'partly_explained'):
        located = localisation.of_effects(problem, decision.answers, none.state, best.state)
    findings = Findings(
        rivals_of(decision.answers, inflated, settings), inflated,
        found_noise(problem.experiments),
        unnamed={part: decision.unknown * share for part, share in parts.items()
                 if decision.unknown * share >= settings.verdict.least_probability})
    healthy = decision.word == 'no_gap'
    hidden = could_hide(
        problem, (none if healthy else best).with_jacobian(problem).state, findings.inflated) if (
            healthy or not findings.are_open(settings)) else []
    planning = {
        **machine.planning,
        **replace(findings, shown={item['effect']: item['size'] for item in hidden
                                   if item['size'] is not None}).as_data()}
    labels = interventions(problem, none, best, threads) or None
    progress(1.0, 'done')
    return Verdict(
        word=decision.word,
        where=located,
        which=[Named(**answer) for answer in verdict.which(
            decision, settings.verdict, lambda answer: values_with_intervals(
                answer, found.deviating(answer)))],
        also_seen=verdict.also_seen(found.found),
        confusable=decision.confusable,
        how_far=found.reach,
        could_hide=hidden if healthy else [],
        remains=remainders(problem, best.state, limits),
        may_enter_at=[place for place in found.places if unsure and place.evidence > 0.0],
        fits=[{'effects': list(h.effects), 'cost': h.cost, 'log_evidence': found.found.evidence(h)}
              for h in found.found.hypotheses],
        planning=planning, seconds=time.monotonic() - began,
        notes=machine.notes, labels=labels,
        machine=problem.machine, none=none, best=best,
        reproducibility=reproducibility(problem, best), lawful=found.lawful)
