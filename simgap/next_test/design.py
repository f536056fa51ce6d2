# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The design of the next test: which of the tests that a machine may run tells most."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import combinations
import math

import numpy as np
from simgap.fit.blas import one_blas_thread
from simgap.fit.noise import with_found_noise
from simgap.machine.contract import FloatArray, Machine
from simgap.machine.process import with_process
from simgap.next_test.candidate import Candidate, Proposal
from simgap.next_test.confusability import confusability
from simgap.next_test.rivals import Findings, known_to
from simgap.next_test.separation import separation
from simgap.next_test.space import TestSpace
from simgap.settings import DEFAULT

SEPARATE, DETECT = 'separate', 'detect'
CRITERIA: Mapping[str, str] = {
    SEPARATE: 'T-optimality with prior probabilities: expected information between the rivals, '
              'all tolerances free; weighted by how likely none of them is true, the rule of '
              'detect (compound design)',
    DETECT: 'smallest size of each effect that shows beside all tolerances, in the tests so far '
            'or in this one, over that with the best test that was tried, in the geometric mean'}
# Less information than this does not count [nat].
_NOTHING = 1e-6
# An effect that does not show at any size is as bad as this many times the best.
_NEVER = 1e3


def objective_for(findings: Findings) -> str:
    """Return what the next test is for: to tell open answers apart, or to contradict them."""
    return SEPARATE if findings.are_open() else DETECT


@dataclass(frozen=True)
class DesignEffort:
    """How much is searched."""

    drawn: int = 12  # tests of each family
    judged: int = 24  # tests that are judged with all tolerances free
    fitted: int = 12  # the same where rivals are fitted, after a rough look at all
    beyond: int = 3  # tests beyond the limits that are judged if no other one helps
    margin: float = 0.9  # share of each limit that a test may use


class TestDesign:
    """
    The search for the next test, after the `findings` of the tests so far.

    `objective` is one of `CRITERIA`. `suspected` has ids of effects for `detect`, empty for all.
    `threads` tests are simulated at once.
    """

    __test__ = False

    def __init__(self, space: TestSpace, findings: Findings = Findings(),
                 objective: str = SEPARATE, suspected: Sequence[str] = (), threads: int = 2,
                 effort: DesignEffort = DesignEffort(), seed: int = 0) -> None:
        self._space, self._findings = space, findings
        self._rivals, self._inflated = findings.rivals, findings.inflated
        self._objective, self._suspected = objective, suspected
        self._threads, self._effort = threads, effort
        self._random = np.random.default_rng(seed)

    def run(self, progress: Callable[[float], None] = lambda share: None) -> Proposal:
        """Search; KeyError if the catalogue lacks an effect or a form of a rival."""
        effort = self._effort
        drawn = [Candidate(family, self._space.draw(family, self._random), {})
                 for _ in range(effort.drawn) for family in self._space.families]
        with one_blas_thread(), ThreadPoolExecutor(self._threads) as pool:
            def each(do: Callable[[Candidate], Candidate], tests: Sequence[Candidate],
                     first: float, last: float) -> Iterator[Candidate]:
                for k, test in enumerate(pool.map(do, tests)):
                    progress(first + (last - first) * k / len(tests))
                    yield test

            screened = list(each(self._screened, drawn, 0.0, 0.3))
            allowed, refused = ([test for test in screened if (
                test.tightest[1] <= effort.margin) == keeps] for keeps in (True, False))
            most = effort.fitted if self._objective == SEPARATE else effort.judged
            judged = self._compared(each(self._judged, of_each_family(allowed, most), 0.3, 1.0))
            helpful = [test for test in judged if _helps(test)]
            beyond = [] if helpful else self._compared(pool.map(
                self._judged, of_each_family(refused, effort.beyond)))
        progress(1.0)
        return Proposal(
            self._objective, CRITERIA[self._objective], self._rivals, helpful,
            Counter(test.tightest[0] for test in refused),
            [test for test in beyond if _helps(test)], self._alike(judged), len(drawn),
            self._findings.unnamed if self._objective in (SEPARATE, DETECT) else {})

    def _planned(self, test: Candidate) -> Machine:
        """Return the machine in a test, as noisy as it has been so far."""
        machine = self._space.machine(test.test)
        return machine.with_experiments(with_found_noise(
            machine.experiments, self._findings.noise))

    def _screened(self, test: Candidate) -> Candidate:
        """Simulate a test with each rival; no rival's numbers follow yet."""
        machine = self._planned(test).low_fidelity()
        points = [known_to(machine, rival) for rival in self._rivals] or [{}]
        test = replace(test, use=self._space.use(machine, points))
        if self._objective != SEPARATE:
            return test
        rough = separation(machine, self._rivals, self._inflated, fitted=False)
        return replace(test, score=rough.information())

    def _judged(self, test: Candidate) -> Candidate:
        """Judge a test with all tolerances free."""
        machine = with_process(self._planned(test))
        test = replace(test, sizes=self._sizes(machine))
        return test if self._objective == DETECT else replace(
            test, separation=separation(machine, self._rivals, self._inflated))

    def _sizes(self, machine: Machine) -> dict[str, tuple[float, str]]:
        """Return from which size each effect shows; to detect, in the tests so far as well."""
        coarse = machine.low_fidelity()
        found = confusability(coarse.with_experiments([
            replace(e, measured=coarse.predict({}, k)) for k, e in enumerate(
                machine.experiments)]), inflated=self._inflated, among=self._suspected)
        shown = self._findings.shown if self._objective == DETECT else {}
        return {name: (min(float(size), shown.get(name, math.inf)), unit)
                for name, size, unit in zip(found.effects, found.detectable, found.units,
                                            strict=True)}

    def _compared(self, tests: Iterable[Candidate]) -> list[Candidate]:
        """Return judged tests by their scores, the best first."""
        found = list(tests)
        if found and self._objective in (SEPARATE, DETECT):
            sizes = np.array([[size for size, _ in test.sizes.values()] for test in found])
            # what no test shows tells nothing
            seen = np.isfinite(sizes).any(axis=0)
            sizes, weights = sizes[:, seen], self._weights(found[0])[seen]
            over = np.log(np.minimum(sizes / sizes.min(axis=0, initial=math.inf), _NEVER))
            coarse = over @ weights / max(weights.sum(), 1e-30)
            # each part of a score is the logarithm of an efficiency, but for what all tests share
            told = [test.separation.information() if test.separation else 1.0 for test in found]
            unlisted = 1.0 if self._objective == DETECT else max(
                DEFAULT.planning.unlisted, self._findings.unlisted)
            scores = (1.0 - unlisted) * np.log(np.maximum(told, _NOTHING)) - unlisted * coarse
            found = [replace(test, score=float(score), coarseness=math.exp(times))
                     for test, score, times in zip(found, scores, coarse, strict=True)]
        return sorted(found, key=lambda test: -test.score)

    def _weights(self, test: Candidate) -> FloatArray:
        """Return how likely each effect is what has no name yet, as far as the verdict says."""
        catalogue = self._space.machine(test.test).catalogue
        parts = [catalogue[name].component for name in test.sizes]
        shares = {part: share for part, share in self._findings.unnamed.items() if part in parts}
        rest = (1.0 - sum(shares.values())) / max(len(parts), 1)
        return np.array([rest + shares.get(part, 0.0) / parts.count(part) for part in parts])

    def _alike(self, judged: Sequence[Candidate]) -> list[tuple[int, int, Mapping[str, float]]]:
        """Return the rivals that no test tells apart, and what would."""
        found: list[tuple[int, int, Mapping[str, float]]] = []
        for i, j in combinations(range(len(self._rivals)), 2):
            lacks = [min(told.lack[i, j], told.lack[j, i]) for test in judged
                     if (told := test.separation) is not None]
            if lacks and max(lacks) < DEFAULT.planning.alike:
                best = judged[int(np.argmax(lacks))]
                assert best.separation is not None
                machine = self._planned(best)
                unread = self._space.unread(machine, known_to(machine, self._rivals[i]),
                                            best.separation.points[i, j])
                found.append((i, j, dict(sorted(unread.items(), key=lambda item: -item[1]))))
        return found


def _helps(test: Candidate) -> bool:
    """Return whether a test tells enough to be made."""
    if test.separation is not None:
        return test.separation.information() >= DEFAULT.planning.least_information
    return any(math.isfinite(size) for size, _ in test.sizes.values())


def of_each_family(tests: Sequence[Candidate], most: int) -> list[Candidate]:
    """Return the best tests of every family in turn: rough scores compare no families."""
    best = sorted(tests, key=lambda test: -test.score)
    places: Counter[str] = Counter()
    rank = {}
    for test in best:
        rank[id(test)] = places[test.family]
        places[test.family] += 1
    return sorted(best, key=lambda test: rank[id(test)])[:most]
