# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The whole loop: a test, its verdict, the next test, until the answer is sure."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
import json
import os
from pathlib import Path
import shutil
from tempfile import TemporaryDirectory
from typing import Any

from simgap.drafts import drafted
from simgap.errors import UserError
from simgap.next_test.design import objective_for, TestDesign
from simgap.next_test.proposal import as_data
from simgap.next_test.rivals import Findings
from simgap.next_test.space import TestSpace
from simgap.search.rival import Rival
from simgap.settings import DEFAULT
from simgap.verdict.diagnosis import Progress as Share
from simgap.verdict.record import Verdict

# Why an investigation ends.
DECIDED, NO_MORE, NOTHING_HELPS = 'decided', 'no more tests', 'nothing helps'
NOTHING_KNOWN = 'nothing known explains it'

_UNKNOWN = ['unknown']
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class InvestigationPlan:
    """What an investigation is to do."""

    most: int = 4  # greatest number of tests
    # probability from which an answer that the verdict before also named is decided
    until: float = 0.9
    duration: float = 30.0  # of each test [s]
    seed: int = 0  # of the tests that are drawn


class Bench(ABC):
    """A machine on which tests are run."""

    space: TestSpace  # the tests that it allows
    limits: Mapping[str, Any]  # that no test may exceed, as plain data
    played: str  # name of the file of a test, with {number}

    @abstractmethod
    def save(self, test: Any, path: Path) -> None:
        """Write what is to be played."""

    @abstractmethod
    def run(self, number: int, test: Path, duration: float, out: Path) -> None:
        """Play a test for a duration [s]; write its recording to `out`, a CSV or a folder."""

    @abstractmethod
    def diagnose(self, recordings: Mapping[str, Path], progress: Share,
                 earlier: Sequence[Rival]) -> Verdict:
        """Return the diagnosis of all recordings so far; `earlier` as in `diagnosis.diagnose`."""


class Investigation:
    """
    An investigation of a machine.

    Everything lies in `folder`, which is made if it is not there; what lies there is not done
    again. `first` is the first test; None asks for the one that detects most. `threads`
    simulations run at once. Raises UserError if the folder holds another investigation.
    """

    def __init__(self, folder: Path, bench: Bench, plan: InvestigationPlan = InvestigationPlan(),
                 first: Any = None, threads: int = 2) -> None:
        self._folder, self._bench, self._plan, self._first = folder, bench, plan, first
        self._threads = threads
        folder.mkdir(parents=True, exist_ok=True)
        # more tests may be allowed later
        asked = {'until': plan.until, 'duration_s': plan.duration, 'seed': plan.seed,
                 'limits': bench.limits}
        known = self._once('investigation', lambda: asked)
        if differing := [key for key in asked if known.get(key) != asked[key]]:
            raise UserError(f'{folder}: holds an investigation with other settings '
                            f'({", ".join(differing)}); give the same ones to go on, or another '
                            '--out')

    def run(self, progress: Progress = lambda doing, share: None) -> dict[str, Any]:
        """
        Do what is still to be done; return the story as plain data.

        The story has `tests`, each with what was played, what it was expected to say and the
        answers after it, and `ended`: why there are no more.
        """
        tests: list[dict[str, Any]] = []
        ended, findings = NO_MORE, Findings()
        for number in range(1, self._plan.most + 1):
            proposal = self._once(f'proposal_{number}', partial(
                self._designed, number, findings, progress))
            if proposal['test'] is None:
                ended = NOTHING_HELPS
                break
            self._record(number, progress)
            verdict = self._once(f'verdict_{number}', partial(
                self._diagnosed, number, findings.rivals, progress))
            findings = Findings.of_data(verdict['planning'])
            tests.append(_chapter(number, proposal, verdict))
            self._write('story', {'tests': tests, 'ended': None})
            if self._is_sure(tests):
                named = tests[-1]['answers'][0]['effects']
                ended = NOTHING_KNOWN if named == _UNKNOWN else DECIDED
                break
        story = {'tests': tests, 'ended': ended,
                 'seconds_of_testing': self._plan.duration * len(tests)}
        self._write('story', story)
        return story

    def _is_sure(self, tests: Sequence[Mapping[str, Any]]) -> bool:
        """Return whether the last verdict is sure of what the verdict before also named."""
        if len(tests) < 2:
            return False
        before, last = (test['answers'][0] for test in tests[-2:])
        # no verdict gives 'unknown' more
        most = DEFAULT.verdict.most_unknown if last['effects'] == _UNKNOWN else 1.0
        return bool(last['probability'] >= most * self._plan.until
                    and last['effects'] == before['effects'])

    def _designed(self, number: int, findings: Findings, progress: Progress) -> dict[str, Any]:
        """Save a test, and return its proposal; the first one detects, the others separate."""
        space, test = self._bench.space, self._first
        if number > 1 or test is None:
            proposal = TestDesign(
                space, findings, objective_for(findings), threads=self._threads,
                seed=self._plan.seed + number).run(partial(progress, f'design of test {number}'))
            found = as_data(proposal, space)
            test = proposal.tests[0].test if proposal.tests else None
        else:
            found = {'objective': 'given', 'family': 'given', 'test': space.as_data(test)}
        if test is not None:
            self._bench.save(test, self._played(number))
        return found

    def _played(self, number: int) -> Path:
        return self._folder / self._bench.played.format(number=number)

    def _record(self, number: int, progress: Progress) -> None:
        """Run a test; the recording gets its name once it is whole."""
        if f'test_{number}' in self._recordings(number):
            return
        progress(f'test {number}', 0.0)
        for old in self._folder.glob('.test_*'):
            shutil.rmtree(old, ignore_errors=True)
        with TemporaryDirectory(prefix='.test_', dir=self._folder) as drafts:
            draft = Path(drafts) / 'draft'
            self._bench.run(number, self._played(number), self._plan.duration, draft)
            os.replace(draft, self._folder / f'test_{number}{"" if draft.is_dir() else ".csv"}')

    def _recordings(self, number: int) -> dict[str, Path]:
        """Return the recordings that are there up to a test, by name."""
        return {f'test_{k}': path for k in range(1, number + 1) for suffix in ('', '.csv')
                if (path := self._folder / f'test_{k}{suffix}').exists()}

    def _diagnosed(self, number: int, earlier: Sequence[Rival],
                   progress: Progress) -> dict[str, Any]:
        """Return the verdict on all recordings up to a test."""
        return self._bench.diagnose(
            self._recordings(number),
            lambda share, doing: progress(f'diagnosis after test {number}', share),
            earlier).as_data()

    def _once(self, name: str, make: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
        """Return the plain data of a file in the folder, which is made if it is not there."""
        path = self._folder / f'{name}.json'
        if not path.exists():
            self._write(name, make())
        try:
            found: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        except ValueError as error:
            raise UserError(
                f'{path}: no JSON ({error}); remove it to have it made anew') from error
        return found

    def _write(self, name: str, data: Mapping[str, Any]) -> None:
        """Write plain data whole or not at all."""
        with drafted(self._folder / f'{name}.json') as stream:
            stream.write(json.dumps(data, indent=2, default=float).encode())


def _chapter(number: int, proposal: Mapping[str, Any],
             verdict: Mapping[str, Any]) -> dict[str, Any]:
    """Return what one test was, promised and gave."""
    answers = [{'effects': entry['effects'], 'probability': entry['probability']}
               for entry in verdict['which'] if entry['probability'] >= 0.005]
    return {'test': number, 'family': proposal['family'], 'sheet': proposal['test'],
            'objective': proposal['objective'], 'expected': proposal.get('expected'),
            'not_told_apart': proposal.get('not_told_apart', []),
            'obtained': answers[0]['probability'], 'answers': answers,
            'verdict': verdict['verdict'], 'confusable': verdict['confusable'],
            'how_far': verdict['how_far']['explained_fraction']}


def lines(story: Mapping[str, Any]) -> list[str]:
    """Return the story of an investigation as people read it."""
    found = []
    for item in story['tests']:
        promised = item['expected']
        found.append(f'test {item["test"]}, {item["family"]}'
                     + (f', expected to make the true answer {100.0 * promised["right_after"]:.0f}'
                        ' % sure' if promised else '') + ':')
        found += [f'  {100.0 * answer["probability"]:5.1f} %  {" + ".join(answer["effects"])}'
                  for answer in item['answers'][:4]]
    tests = len(story['tests'])
    found.append({
        DECIDED: f'decided after {tests} tests, {story["seconds_of_testing"]:g} s of testing',
        NO_MORE: f'not decided after {tests} tests; --max-tests allows more',
        NOTHING_KNOWN: f'no effect of the catalogue explains the gap, after {tests} tests; the '
                       'last verdict says where it may enter',
        NOTHING_HELPS: f'not decided after {tests} tests, and no test within the limits helps',
    }[story['ended']])
    return found


def headline(story: Mapping[str, Any]) -> tuple[str, str]:
    """Return what an investigation has found in two words, and in a sentence."""
    said: Sequence[str] = lines(story)
    if not story['tests']:
        return 'No test', said[-1]
    first = story['tests'][-1]['answers'][0]
    return ' + '.join(first['effects']), f'{100.0 * first["probability"]:.0f} % sure; {said[-1]}'
