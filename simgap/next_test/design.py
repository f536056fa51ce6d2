# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The design of the next test: which of the tests that a machine may run tells most.

What a test may be is the machine's to say, see `TestSpace`. The search knows nothing of waveforms.
It draws tests of every family, keeps those within the limits, judges the most promising ones with
all tolerances free, and varies the best. Last, each rival is fitted to the simulated readings of
the others: what derivatives promise is not always kept.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import combinations
import math
from pathlib import Path
from statistics import fmean
from types import MappingProxyType
from typing import Any

import numpy as np
from simgap.fit.blas import one_blas_thread
from simgap.fit.noise import with_found_noise
from simgap.machine.arrays import FloatArray, Point
from simgap.machine.machine import Machine
from simgap.next_test.confusability import confusability
from simgap.next_test.discrimination import deviations, known_to, refitted, Separation, separation
from simgap.next_test.rivals import Findings, Rival
from simgap.settings import DEFAULT, Settings

SEPARATE, SHARPEN, DETECT = OBJECTIVES = ('separate', 'sharpen', 'detect')
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
# An effect that does not show at any size is as bad as this many times the best.
_NEVER = 1e3
# Information below this is none [nat].
_NOTHING = 1e-6

Progress = Callable[[float, str], None]


def objective_for(findings: Findings, settings: Settings = DEFAULT) -> str:
    """Return what the next test is for: to tell open answers apart, or to contradict them."""
    return SEPARATE if findings.are_open(settings) else DETECT


class TestSpace(ABC):
    """
    The tests that a machine may run.

    Attributes
    ----------
    families : names of the kinds of test
    limits : that a test must keep, by name

    """

    __test__ = False  # not a test case, whatever pytest makes of the name

    families: Sequence[str]
    limits: Mapping[str, float] = MappingProxyType({})

    @abstractmethod
    def draw(self, family: str, random: np.random.Generator) -> Any:
        """Return a test of a family, drawn at random."""

    @abstractmethod
    def machine(self, test: Any) -> Machine:
        """Return the machine in this test alone; what it measured does not count."""

    @abstractmethod
    def use(self, machine: Machine, points: Sequence[Point]) -> Mapping[str, float]:
        """
        Return the share of each limit that a test uses, 1 at the limit.

        Parameters
        ----------
        machine
            from `machine`
        points
            variants of it; the worst one counts

        """

    def nearby(self, family: str, test: Any, random: np.random.Generator) -> Any:
        """Return a test like another one; by default another of the same family."""
        return self.draw(family, random)

    def command(self, test: Any) -> tuple[FloatArray, FloatArray, str] | None:
        """Return times [s] and values of the command of a test, shape (n,), and their unit."""
        return None

    def as_data(self, test: Any) -> Any:
        """Return a test as plain data, for the JSON."""
        return repr(test)

    def files(self, test: Any, path: Path) -> Mapping[Path, str]:
        """Return the texts of the files from which a test is run, the first one at `path`."""
        return {path: f'{self.as_data(test)}\n'}

    def unread(self, machine: Machine, one: Point, other: Point) -> Mapping[str, float]:
        """
        Return by how much two variants differ in what no sensor reads.

        The rms of the difference as a share of the rms of the signal, by signal. By default
        nothing is known.
        """
        return {}


@dataclass(frozen=True)
class DesignEffort:
    """
    How much is searched.

    Attributes
    ----------
    drawn : tests of each family
    judged : of all, those that are judged with all tolerances free
    varied : of these, those that are varied
    variants : of each of them
    confirmed : of the best, those that every rival is fitted to at a time
    rounds : of that at most, while another test promises more than the best of those
    margin : share of each limit that a test may use

    """

    drawn: int = 12
    judged: int = 14
    varied: int = 3
    variants: int = 4
    confirmed: int = 2
    rounds: int = 3
    margin: float = 0.9


@dataclass(frozen=True)
class Judged:
    """
    A test and what it is expected to tell.

    Attributes
    ----------
    family, test : as the test space has drawn it
    use : share of each limit that it uses, the worst of all rivals
    score : by the criterion; the larger the better
    coarseness : smallest size of each effect of the catalogue that shows, over that in the best
        test that was judged, in the geometric mean; NaN where it was not asked for
    told : how well it tells the rivals apart to first order
    confirmed : the same with every rival fitted to the readings of the others
    kept : while not confirmed, the share of its promise that counts: as other tests of its
        family have kept theirs
    deviations : of each number of the effects, its standard deviation before and after
    sizes : of each effect, the smallest size that shows, and its unit

    """

    family: str
    test: Any
    use: Mapping[str, float]
    score: float = 0.0
    coarseness: float = math.nan
    told: Separation | None = None
    confirmed: Separation | None = None
    kept: float = 1.0
    deviations: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sizes: Mapping[str, tuple[float, str]] = field(default_factory=dict)

    @property
    def separation(self) -> Separation | None:
        """Return how well it tells the rivals apart, confirmed if it was."""
        return self.confirmed or self.told

    @property
    def tightest(self) -> tuple[str, float]:
        """Return the limit that it uses most, and its share."""
        return max(self.use.items(), key=lambda item: item[1], default=('', 0.0))


@dataclass(frozen=True)
class Proposal:
    """
    What was found.

    Attributes
    ----------
    objective, criterion : what was asked for, and by which rule
    rivals : that were to be told apart
    tests : judged ones that help, the best first; none if no test within the limits helps
    refused : how many drawn tests each limit has cost
    beyond : if no test helps, the best ones beyond the limits
    alike : pairs of rivals that no judged test tells apart, with what no sensor reads in which
        they differ, the greatest difference first
    tried : number of tests that were simulated
    unnamed : where something without a name may act, see `Findings`

    """

    objective: str
    criterion: str
    rivals: Sequence[Rival]
    tests: Sequence[Judged]
    refused: Mapping[str, int]
    beyond: Sequence[Judged] = ()
    alike: Sequence[tuple[int, int, Mapping[str, float]]] = ()
    tried: int = 0
    unnamed: Mapping[str, float] = field(default_factory=dict)


class TestDesign:
    """
    The search for the next test.

    Parameters
    ----------
    space
        the tests that the machine may run
    findings
        of the tests so far
    objective
        one of `OBJECTIVES`, or `D_OPTIMAL` or `RANDOM` to compare with
    suspected
        for `detect`, ids of effects; empty for all
    threads
        tests at once
    settings, effort
        thresholds, and how much is searched
    seed
        of the tests that are drawn

    """

    __test__ = False

    def __init__(self, space: TestSpace, findings: Findings = Findings(),
                 objective: str = SEPARATE, suspected: Sequence[str] = (), threads: int = 2,
                 settings: Settings = DEFAULT, effort: DesignEffort = DesignEffort(),
                 seed: int = 0) -> None:
        """Prepare to search."""
        self._space, self._findings = space, findings
        self._rivals, self._inflated = findings.rivals, findings.inflated
        self._objective, self._suspected = objective, list(suspected)
        self._threads, self._settings, self._effort = threads, settings, effort
        self._random = np.random.default_rng(seed)
        self._judge: Callable[[Judged], Judged] = {
            SEPARATE: self._separated, SHARPEN: self._sharpened, D_OPTIMAL: self._sharpened,
            DETECT: self._detected, RANDOM: lambda test: test}[objective]

    def run(self, progress: Progress = lambda share, doing: None) -> Proposal:
        """
        Search, and return what was found.

        Raises
        ------
        KeyError : the machine's catalogue lacks an effect or a form of a rival

        """
        effort = self._effort
        drawn = [Judged(family, self._space.draw(family, self._random), {})
                 for _ in range(effort.drawn) for family in self._space.families]
        with one_blas_thread(), ThreadPoolExecutor(self._threads) as pool:
            progress(0.0, 'tests within the limits')
            screened: list[Judged] = []
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
            judged = self._compared(pool.map(self._judge, _of_each_family(
                allowed, effort.judged)))
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
            beyond: Sequence[Judged] = ()
            if not helpful:
                beyond = self._compared(pool.map(self._judge, _of_each_family(
                    [test for test in screened if not self._allowed(test)], effort.varied)))
        progress(1.0, 'done')
        return self._proposal(helpful, refused, [test for test in beyond if self._helps(test)],
                              len(drawn) + len(variants), judged)

    def _proposal(self, tests: Sequence[Judged], refused: Mapping[str, int],
                  beyond: Sequence[Judged], tried: int, judged: Sequence[Judged] = (),
                  ) -> Proposal:
        return Proposal(self._objective, CRITERIA[self._objective], self._rivals, tests, refused,
                        beyond, self._alike(judged), tried,
                        self._findings.unnamed if self._objective in _BY_SIZES else {})

    def _allowed(self, test: Judged) -> bool:
        return test.tightest[1] <= self._effort.margin

    def _helps(self, test: Judged) -> bool:
        least = self._settings.planning.least_information
        if test.separation is not None:
            return test.separation.information(self._temperature) >= least
        if test.deviations:
            return any(after < (1.0 - least) * before
                       for before, after in test.deviations.values())
        return not test.sizes or any(math.isfinite(size) for size, _ in test.sizes.values())

    @property
    def _temperature(self) -> float:
        return self._settings.verdict.temperature

    def _score(self, told: Separation) -> float:
        """Return the information that is left if less of the evidence comes true."""
        return told.information(self._temperature, self._settings.planning.caution)

    def _planned(self, test: Judged) -> Machine:
        """Return the machine in a test, as noisy as it has been so far."""
        machine = self._space.machine(test.test)
        return machine.with_experiments(with_found_noise(
            machine.experiments, self._findings.noise))

    # -- judging one test ----------------------------------------------------------------------

    def _screened(self, test: Judged) -> Judged:
        """Simulate a test with each rival; no rival's numbers follow yet."""
        machine = self._planned(test).low_fidelity()
        points = [known_to(machine, rival) for rival in self._rivals] or [{}]
        use = self._space.use(machine, points)
        if self._objective != SEPARATE:
            return replace(test, use=use)
        told = separation(machine, self._rivals, self._inflated, self._settings, follow=False)
        return replace(test, use=use, score=self._score(told))

    def _separated(self, test: Judged) -> Judged:
        """Judge a test with all tolerances free, to first order, and what else it shows."""
        machine = self._planned(test)
        told = separation(machine, self._rivals, self._inflated, self._settings)
        # no size is told, only their mean is compared
        return replace(test, told=told, sizes=self._sizes(machine.low_fidelity()))

    def _with_fits(self, judged: Sequence[Judged], pool: ThreadPoolExecutor) -> list[Judged]:
        """
        Confirm the best tests until no other one promises more, and put those first.

        Tests of a family break their promises alike: a promise counts as far as others were kept.
        """
        best = list(judged)
        for _ in range(self._effort.rounds):
            if not best or best[0].confirmed is not None:
                break
            promised = [test for test in best if test.confirmed is None]
            count = self._effort.confirmed
            known = [*(test for test in best if test.confirmed is not None),
                     *pool.map(self._confirmed, promised[:count])]
            kept = self._kept(known)
            best = self._compared([*known, *(
                replace(test, kept=kept.get(test.family, 1.0)) for test in promised[count:])])
        return sorted(best, key=lambda test: test.confirmed is None)

    def _kept(self, confirmed: Iterable[Judged]) -> dict[str, float]:
        """Return the share of the promises of each family that fits have kept, in the mean."""
        shares: dict[str, list[float]] = {}
        for test in confirmed:
            assert test.told is not None and test.confirmed is not None
            shares.setdefault(test.family, []).append(
                self._score(test.confirmed) / max(self._score(test.told), _NOTHING))
        return {family: min(fmean(found), 1.0) for family, found in shares.items()}

    def _confirmed(self, test: Judged) -> Judged:
        """Fit each rival to the readings of the others; what is left then counts in full."""
        return replace(test, kept=1.0, confirmed=refitted(
            self._planned(test), self._rivals, self._inflated, self._settings,
            test.told.shrunk if test.told else ()))

    def _sharpened(self, test: Judged) -> Judged:
        """Judge how well a test determines the numbers of the likeliest rival."""
        machine = self._planned(test)
        rival = max(self._rivals, key=lambda item: item.probability)
        names, before, after = deviations(machine, rival, self._inflated, self._settings)
        own = {p.name for form in rival.forms_of(machine) for p in form.parameters}
        wanted = [j for j, name in enumerate(names) if name in own]
        if self._objective == D_OPTIMAL or not wanted:
            wanted = list(range(len(names)))
        block = np.ix_(wanted, wanted)
        score = 0.5 * (np.linalg.slogdet(before[block])[1] - np.linalg.slogdet(after[block])[1])
        return replace(test, score=float(score), deviations={
            names[j]: (math.sqrt(before[j, j]), math.sqrt(max(after[j, j], 0.0)))
            for j in wanted})

    def _detected(self, test: Judged) -> Judged:
        """Judge a test by what it shows, or the tests so far have shown."""
        shown = self._findings.shown
        return replace(test, sizes={
            name: (min(size, shown.get(name, math.inf)), unit)
            for name, (size, unit) in self._sizes(self._planned(test)).items()})

    def _sizes(self, machine: Machine) -> dict[str, tuple[float, str]]:
        """Return the smallest size of each effect that shows in a test, and its unit."""
        machine = machine.with_experiments([
            replace(e, measured=machine.predict({}, k))
            for k, e in enumerate(machine.experiments)])
        found = confusability(machine, settings=self._settings, inflated=self._inflated,
                              among=self._suspected)
        return {name: (float(size), unit) for name, size, unit in zip(
            found.effects, found.detectable, found.units, strict=True)}

    def _compared(self, tests: Iterable[Judged]) -> list[Judged]:
        """Return judged tests by their scores, the best first."""
        found = list(tests)
        if self._objective in _BY_SIZES:
            found = [replace(test, coarseness=coarseness, score=self._compound(test, coarseness))
                     for test, coarseness in zip(
                         found, _coarseness(found, self._weights(found)), strict=True)]
        return sorted(found, key=lambda test: -test.score)

    def _weights(self, tests: Sequence[Judged]) -> FloatArray:
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

    def _compound(self, test: Judged, coarseness: float) -> float:
        """
        Return what a test tells of the rivals and of other effects, by their weights.

        Each part is the logarithm of an efficiency, but for what all tests share.
        """
        if test.separation is None:
            return -math.log(coarseness)
        unlisted = max(self._settings.planning.unlisted, self._findings.unlisted)
        told = test.kept * self._score(test.separation)
        return ((1.0 - unlisted) * math.log(max(told, _NOTHING))
                - unlisted * math.log(coarseness))

    # -- what no test tells --------------------------------------------------------------------

    def _alike(self, judged: Sequence[Judged]) -> list[tuple[int, int, Mapping[str, float]]]:
        """Return the pairs of rivals that no judged test tells apart."""
        told = [test for test in judged if test.separation is not None]
        limit = self._settings.planning.alike * self._temperature
        found = []
        for i, j in combinations(range(len(self._rivals)), 2):
            lacks = [test.separation.least_lack()[i, j] for test in told
                     if test.separation is not None]
            if lacks and max(lacks) < limit:
                best = told[int(np.argmax(lacks))]
                found.append((i, j, self._unread(best, i, j)))
        return found

    def _unread(self, test: Judged, i: int, j: int) -> Mapping[str, float]:
        machine = self._planned(test)
        one = known_to(machine, self._rivals[i])
        other = test.confirmed.points[i, j] if test.confirmed else (
            known_to(machine, self._rivals[j]))
        unread = self._space.unread(machine, one, other)
        return dict(sorted(unread.items(), key=lambda item: -item[1]))


def _coarseness(tests: Sequence[Judged], weights: FloatArray) -> list[float]:
    """Return for each test the sizes that show, over the least of all, in the geometric mean."""
    if not tests:
        return []
    sizes = np.array([[size for size, _ in test.sizes.values()] for test in tests])
    seen = np.isfinite(sizes).any(axis=0)
    if not seen.any():
        return [1.0] * len(tests)
    shown = sizes[:, seen]
    over = np.minimum(shown / shown.min(axis=0), _NEVER)
    return np.exp(np.average(np.log(over), axis=1, weights=weights[seen])).tolist()


def _of_each_family(tests: Sequence[Judged], most: int) -> list[Judged]:
    """Return the best tests of every family in turn: rough scores compare no families."""
    best = sorted(tests, key=lambda test: -test.score)
    families: dict[str, list[Judged]] = {}
    for test in best:
        families.setdefault(test.family, []).append(test)
    rank = {id(test): k for group in families.values() for k, test in enumerate(group)}
    return sorted(best, key=lambda test: rank[id(test)])[:most]
