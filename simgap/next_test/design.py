# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The design of the next test: which of the tests that a machine may run tells most."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import combinations
import math
from statistics import fmean

import numpy as np
from simgap.fit.blas import one_blas_thread
from simgap.fit.noise import with_found_noise
from simgap.machine.contract import FloatArray, Machine
from simgap.next_test.candidate import Candidate, coarseness_of, of_each_family, Proposal
from simgap.next_test.confusability import confusability
from simgap.next_test.discrimination import deviations, separation
from simgap.next_test.rival_fits import confirmed_separation
from simgap.next_test.rivals import Findings, known_to
from simgap.next_test.separation import Separation
from simgap.next_test.space import TestSpace
from simgap.settings import DEFAULT

SEPARATE, SHARPEN, DETECT = 'separate', 'sharpen', 'detect'
# Rules to compare with: all numbers of the likeliest rival sharpened alike, and none at all.
D_OPTIMAL, RANDOM = 'd-optimal', 'random'
# in which the sizes count at which effects show
_BY_SIZES = (SEPARATE, DETECT)
CRITERIA: Mapping[str, str] = {
    SEPARATE: 'T-optimality with prior probabilities: expected information between the rivals, '
              'all tolerances free (Atkinson and Fedorov 1975; Ponce de Leon and Atkinson 1991); '
              'weighted by how likely none of them is true, the rule of detect '
              '(compound design: Atkinson, Donev and Tobias 2007, chapter 21)',
    SHARPEN: "D_s-optimality: determinant of the covariance of the likeliest rival's effects, all "
             'tolerances free (Atkinson, Donev and Tobias 2007, section 10.3)',
    DETECT: 'smallest size of each effect that shows beside all tolerances, in the tests so far '
            'or in this one, over that with the best test that was tried, in the geometric mean',
    D_OPTIMAL: "D-optimality: determinant of the covariance of all the likeliest rival's numbers "
               '(Kiefer and Wolfowitz 1959)',
    RANDOM: 'none: the first test within the limits'}
# Less information than this does not count [nat].
_NOTHING = 1e-6

Progress = Callable[[float, str], None]


def objective_for(findings: Findings) -> str:
    """Return what the next test is for: to tell open answers apart, or to contradict them."""
    return SEPARATE if findings.are_open() else DETECT


@dataclass(frozen=True)
class DesignEffort:
    """How much is searched."""

    drawn: int = 12  # tests of each family
    judged: int = 14  # tests that are judged with all tolerances free
    varied: int = 3  # of these, the best that are varied
    variants: int = 4  # of each of them
    confirmed: int = 2  # of the best, those that every rival is fitted to at a time
    rounds: int = 3  # of that at most, while another test promises more
    margin: float = 0.9  # share of each limit that a test may use


class TestDesign:
    """
    The search for the next test, after the `findings` of the tests so far.

    `objective` is one of `CRITERIA`. `suspected` has
    ids of effects for `detect`, empty for all. `threads` tests are simulated at once.
    """

    __test__ = False

    def __init__(self, space: TestSpace, findings: Findings = Findings(),
                 objective: str = SEPARATE, suspected: Sequence[str] = (), threads: int = 2,
                 effort: DesignEffort = DesignEffort(), seed: int = 0) -> None:
        self._space, self._findings = space, findings
        self._rivals, self._inflated = findings.rivals, findings.inflated
        self._objective, self._suspected = objective, list(suspected)
        self._threads, self._effort = threads, effort
        self._random = np.random.default_rng(seed)
        self._judge: Callable[[Candidate], Candidate] = {
            SEPARATE: self._separated, SHARPEN: self._sharpened, D_OPTIMAL: self._sharpened,
            DETECT: self._detected, RANDOM: lambda test: test}[objective]

    def run(self, progress: Progress = lambda share, doing: None) -> Proposal:
        """Search; KeyError if the catalogue lacks an effect or a form of a rival."""
        effort = self._effort
        drawn = [Candidate(family, self._space.draw(family, self._random), {})
                 for _ in range(effort.drawn) for family in self._space.families]
        with one_blas_thread(), ThreadPoolExecutor(self._threads) as pool:
            progress(0.0, 'tests within the limits')
            screened: list[Candidate] = []
            for test in pool.map(self._screened, drawn):
                screened.append(test)
                progress(0.3 * len(screened) / len(drawn), 'tests within the limits')
            refused: dict[str, int] = {}
            for test in screened:
                if not self._allowed(test):
                    refused[test.tightest[0]] = refused.get(test.tightest[0], 0) + 1
            allowed = [test for test in screened if self._allowed(test)]
            if self._objective == RANDOM:
                chosen = self._random.permutation(len(allowed))[:1]
                return self._proposal([allowed[i] for i in chosen], refused, (), len(drawn))
            progress(0.3, 'the best with all tolerances free')
            judged = self._compared(pool.map(self._judge, of_each_family(allowed, effort.judged)))
            progress(0.55, 'variants of the best')
            variants = [replace(test, test=self._space.nearby(test.family, test.test,
                                                              self._random))
                        for test in judged[:effort.varied] for _ in range(effort.variants)]
            tried = [test for test in pool.map(self._screened, variants) if self._allowed(test)]
            judged = self._compared([*judged, *pool.map(self._judge, tried)])
            progress(0.8, 'each rival fitted to the others')
            if self._objective == SEPARATE:
                judged = self._with_fits(judged, pool)
            helpful = [test for test in judged if self._helps(test)]
            beyond: Sequence[Candidate] = ()
            if not helpful:
                beyond = self._compared(pool.map(self._judge, of_each_family(
                    [test for test in screened if not self._allowed(test)], effort.varied)))
        progress(1.0, 'done')
        return self._proposal(helpful, refused, [test for test in beyond if self._helps(test)],
                              len(drawn) + len(variants), judged)

    def _proposal(self, tests: Sequence[Candidate], refused: Mapping[str, int],
                  beyond: Sequence[Candidate], tried: int, judged: Sequence[Candidate] = (),
                  ) -> Proposal:
        return Proposal(self._objective, CRITERIA[self._objective], self._rivals, tests, refused,
                        beyond, self._alike(judged), tried,
                        self._findings.unnamed if self._objective in _BY_SIZES else {})

    def _allowed(self, test: Candidate) -> bool:
        return test.tightest[1] <= self._effort.margin

    def _helps(self, test: Candidate) -> bool:
        least = DEFAULT.planning.least_information
        if test.separation is not None:
            return test.separation.information() >= least
        if test.deviations:
            return any(after < (1.0 - least) * before
                       for before, after in test.deviations.values())
        return not test.sizes or any(math.isfinite(size) for size, _ in test.sizes.values())

    def _score(self, found: Separation) -> float:
        """Return the information that is left if less of the evidence comes true."""
        return found.information(DEFAULT.planning.caution)

    def _planned(self, test: Candidate) -> Machine:
        """Return the machine in a test, as noisy as it has been so far."""
        machine = self._space.machine(test.test)
        return machine.with_experiments(with_found_noise(
            machine.experiments, self._findings.noise))

    def _screened(self, test: Candidate) -> Candidate:
        """Simulate a test with each rival; no rival's numbers follow yet."""
        machine = self._planned(test).low_fidelity()
        points = [known_to(machine, rival) for rival in self._rivals] or [{}]
        use = self._space.use(machine, points)
        if self._objective != SEPARATE:
            return replace(test, use=use)
        rough = separation(machine, self._rivals, self._inflated, follow=False)
        return replace(test, use=use, score=self._score(rough))

    def _separated(self, test: Candidate) -> Candidate:
        """Judge a test with all tolerances free, to first order, and what else it shows."""
        machine = self._planned(test)
        promised = separation(machine, self._rivals, self._inflated)
        # no size is reported, only their mean is compared
        return replace(test, promised=promised, sizes=self._sizes(machine.low_fidelity()))

    def _with_fits(self, judged: Sequence[Candidate], pool: ThreadPoolExecutor) -> list[Candidate]:
        """Confirm the best tests until no other one promises more, and put those first."""
        # tests of a family break promises alike: a promise counts as far as others were kept
        best = list(judged)
        for _ in range(self._effort.rounds):
            if not best or best[0].confirmed is not None:
                break
            others = [test for test in best if test.confirmed is None]
            count = self._effort.confirmed
            known = [*(test for test in best if test.confirmed is not None),
                     *pool.map(self._confirmed, others[:count])]
            kept = self._kept(known)
            best = self._compared([*known, *(
                replace(test, kept=kept.get(test.family, 1.0)) for test in others[count:])])
        return sorted(best, key=lambda test: test.confirmed is None)

    def _kept(self, confirmed: Iterable[Candidate]) -> dict[str, float]:
        """Return the share of the promises of each family that fits have kept, in the mean."""
        shares: dict[str, list[float]] = {}
        for test in confirmed:
            assert test.promised is not None and test.confirmed is not None
            shares.setdefault(test.family, []).append(
                self._score(test.confirmed) / max(self._score(test.promised), _NOTHING))
        return {family: min(fmean(found), 1.0) for family, found in shares.items()}

    def _confirmed(self, test: Candidate) -> Candidate:
        """Fit each rival to the readings of the others; the rest then counts in full."""
        return replace(test, kept=1.0, confirmed=confirmed_separation(
            self._planned(test), self._rivals, self._inflated))

    def _sharpened(self, test: Candidate) -> Candidate:
        """Judge how well a test determines the numbers of the likeliest rival."""
        machine = self._planned(test)
        rival = max(self._rivals, key=lambda item: item.probability)
        names, before, after = deviations(machine, rival, self._inflated)
        own = {p.name for form in rival.forms_of(machine) for p in form.parameters}
        wanted = [j for j, name in enumerate(names) if name in own]
        if self._objective == D_OPTIMAL or not wanted:
            wanted = list(range(len(names)))
        block = np.ix_(wanted, wanted)
        score = 0.5 * (np.linalg.slogdet(before[block])[1] - np.linalg.slogdet(after[block])[1])
        return replace(test, score=float(score), deviations={
            names[j]: (math.sqrt(before[j, j]), math.sqrt(max(after[j, j], 0.0)))
            for j in wanted})

    def _detected(self, test: Candidate) -> Candidate:
        """Judge a test by what it shows, or the tests so far have shown."""
        shown = self._findings.shown
        return replace(test, sizes={
            name: (min(size, shown.get(name, math.inf)), unit)
            for name, (size, unit) in self._sizes(self._planned(test)).items()})

    def _sizes(self, machine: Machine) -> dict[str, tuple[float, str]]:
        machine = machine.with_experiments([
            replace(e, measured=machine.predict({}, k))
            for k, e in enumerate(machine.experiments)])
        found = confusability(machine, inflated=self._inflated, among=self._suspected)
        return {name: (float(size), unit) for name, size, unit in zip(
            found.effects, found.detectable, found.units, strict=True)}

    def _compared(self, tests: Iterable[Candidate]) -> list[Candidate]:
        """Return judged tests by their scores, the best first."""
        found = list(tests)
        if self._objective in _BY_SIZES:
            found = [replace(test, coarseness=coarseness, score=self._compound(test, coarseness))
                     for test, coarseness in zip(
                         found, coarseness_of(found, self._weights(found)), strict=True)]
        return sorted(found, key=lambda test: -test.score)

    def _weights(self, tests: Sequence[Candidate]) -> FloatArray:
        """Return how likely each effect is what has no name yet, as far as the verdict says."""
        names = list(tests[0].sizes) if tests else []
        weight = np.ones(len(names)) / max(len(names), 1)
        if not self._findings.unnamed or not names:
            return weight
        effects = self._space.machine(tests[0].test).catalogue
        own = {part: np.array([effects[name].component == part for name in names])
               for part in self._findings.unnamed}
        known = {part: share for part, share in self._findings.unnamed.items() if own[part].any()}
        weight *= 1.0 - sum(known.values())
        for part, share in known.items():
            weight += share * own[part] / np.count_nonzero(own[part])
        return weight

    def _compound(self, test: Candidate, coarseness: float) -> float:
        """Return what a test tells of the rivals and of other effects, by their weights."""
        # Each part is the logarithm of an efficiency, but for what all tests share.
        if test.separation is None:
            return -math.log(coarseness)
        unlisted = max(DEFAULT.planning.unlisted, self._findings.unlisted)
        information = test.kept * self._score(test.separation)
        return ((1.0 - unlisted) * math.log(max(information, _NOTHING))
                - unlisted * math.log(coarseness))

    def _alike(self, judged: Sequence[Candidate]) -> list[tuple[int, int, Mapping[str, float]]]:
        compared = [test for test in judged if test.separation is not None]
        limit = DEFAULT.planning.alike
        found = []
        for i, j in combinations(range(len(self._rivals)), 2):
            lacks = [test.separation.least_lack()[i, j] for test in compared
                     if test.separation is not None]
            if lacks and max(lacks) < limit:
                best = compared[int(np.argmax(lacks))]
                found.append((i, j, self._unread(best, i, j)))
        return found

    def _unread(self, test: Candidate, i: int, j: int) -> Mapping[str, float]:
        machine = self._planned(test)
        one = known_to(machine, self._rivals[i])
        other = test.confirmed.points[i, j] if test.confirmed else (
            known_to(machine, self._rivals[j]))
        unread = self._space.unread(machine, one, other)
        return dict(sorted(unread.items(), key=lambda item: -item[1]))
