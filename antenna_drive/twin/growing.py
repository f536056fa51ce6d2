# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The verdict that grows: the diagnosis repeated, in a process of its own, on what there is so far.

A look takes longer than a second of testing. The next one begins when it has ended and a fair
share of new data is there, so looks come at even distances on a logarithmic scale of time. The
process lives on between looks, which saves its start. A look does not begin where the one before
has ended: it says what `antenna-drive diagnose` says of the same tests.
"""

from collections.abc import Callable, Collection, Mapping
from concurrent.futures import Executor, Future
from typing import Any

from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.recording import Recording
from antenna_drive.twin.outcome import outcome
from antenna_drive.twin.sequential import Answer, decided, Look, Rule

# The first look [s of testing], and how much more there has to be for the next one. A test that
# is shorter than the first look has not shown much, and does not count as one.
FIRST_S, GROWTH = 15.0, 1.3


def diagnosed(recordings: Mapping[str, Recording], drive: Drive) -> dict[str, Any]:
    """
    Return the result of a diagnosis; what a look asks its process for.

    Raises UserError: a recording cannot be used.
    """
    from antenna_drive.diagnosis.diagnose import diagnose_recordings
    return diagnose_recordings(recordings, drive, threads=1).as_data()


def look_of(result: Mapping[str, Any], lengths_s: Collection[float]) -> Look:
    """Return what a diagnosis said, as a look at tests of these lengths [s]."""
    probabilities: dict[Answer, float] = {}
    for entry in result['which']:
        answer = tuple(sorted(entry['effects']))
        probabilities[answer] = probabilities.get(answer, 0.0) + entry['probability']
    return Look(sum(lengths_s), sum(length >= FIRST_S for length in lengths_s), probabilities,
                tuple(map(frozenset, result['confusable'])))


class GrowingVerdict:
    """
    Looks at the tests of one machine while they are made.

    executor : that looks, one at a time
    drive : the configuration
    rule : when to stop
    diagnose : what it does, a function of a module

    looks : what they said, in the order of time
    planning : what the design of a further test takes from the last one, {} before it
    fault : why the last look has failed; '' if it has not
    """

    def __init__(self, executor: Executor, drive: Drive, rule: Rule | None = None,
                 diagnose: Callable[[Mapping[str, Recording], Drive], dict[str, Any]] = diagnosed,
                 ) -> None:
        """Begin with no test."""
        self._executor, self._drive, self._diagnose = executor, drive, diagnose
        self.rule = rule or Rule()
        self._tests: dict[str, Recording] = {}
        self._running: tuple[Future[dict[str, Any]], list[float]] | None = None
        self._looked_at_s = 0.0
        self.looks: list[Look] = []
        self.planning: Mapping[str, Any] = {}
        self.fault = ''

    @property
    def decided(self) -> bool:
        """Return whether the tests may stop."""
        return decided(self.looks, self.rule)

    def complete(self, test: Recording) -> None:
        """Keep a test that has ended; the next one begins."""
        if _length(test) > 0.0:
            self._tests[f'test {len(self._tests) + 1}'] = test

    def due(self, seconds: float) -> bool:
        """Return whether a look could begin with so much of the present test [s]."""
        if self._running is not None or self.decided:
            return False
        total = seconds + sum(map(_length, self._tests.values()))
        return total >= max(FIRST_S, GROWTH * self._looked_at_s)

    def begin(self, test: Recording) -> None:
        """Look at the present test and those before it."""
        tests = {**self._tests, f'test {len(self._tests) + 1}': test}
        lengths_s = [_length(item) for item in tests.values()]
        self._looked_at_s = sum(lengths_s)
        self._running = self._executor.submit(self._diagnose, tests, self._drive), lengths_s

    def take(self) -> bool:
        """
        Take the result of a look that has ended; return whether one has.

        Raises BrokenExecutor: its process was ended.
        """
        if self._running is None or not self._running[0].done():
            return False
        future, lengths_s = self._running
        self._running = None
        result, self.fault = outcome(future)
        if result is not None:
            self.looks.append(look_of(result, lengths_s))
            self.planning = result['planning']
        return True

    @property
    def named(self) -> str:
        """Return what the last look has named first, '' before the first one and for no gap."""
        first = self.looks[-1].first if self.looks else ('none',)
        return '' if first == ('none',) else ' and '.join(first)

    def message(self) -> dict[str, Any]:
        """Return what there is to say, as plain data for JSON."""
        now = self.looks[-1] if self.looks else None
        return {
            'decided': self.decided,
            'say': self._sentence(),
            'error': self.rule.error, 'false_alarm': self.rule.false_alarm,
            'first': list(now.first) if now else [],
            'confidence': now.confidence if now else None,
            'fault': self.fault,
            'looks': [{'seconds': look.seconds, 'probabilities': {
                ' + '.join(answer): round(p, 4) for answer, p in sorted(
                    look.probabilities.items(), key=lambda item: -item[1]) if p >= 0.005}}
                for look in self.looks]}

    def _sentence(self) -> str:
        if not self.looks:
            return 'no look yet'
        now = self.looks[-1]
        what = 'no gap' if now.first == ('none',) else ' and '.join(now.first)
        said = f'{what}, {100.0 * now.confidence:.0f} % after {now.seconds:.0f} s'
        if self.decided:
            return f'decided, you can stop: {said}'
        if now.tests < self.rule.tests:
            return f'go on, and make another test: {said}'
        return f'go on: {said}'


def _length(test: Recording) -> float:
    """Return the length of a test [s]."""
    if RATE_COMMAND not in test or len(test[RATE_COMMAND]) < 2:
        return 0.0
    time = test[RATE_COMMAND].time_ns
    return float(time[-1] - time[0]) / 1e9
