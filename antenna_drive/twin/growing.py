# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The verdict that grows: the diagnosis repeated, in a process of its own, on what there is so far.

A look takes longer than a second of testing. The next one begins when it has ended and a fair
share of new data is there, so looks come at even distances on a logarithmic scale of time. The
process lives on between looks, which saves its start. A look does not begin where the one before
has ended: it says what `antenna-drive diagnose` says of the same tests.

The next test for such a verdict takes minutes in the same process. It is designed when somebody
asks for it. Whatever fails in that process, the watch goes on.
"""

from collections.abc import Callable, Collection, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future
from typing import Any

from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import dump_sheet, parse_sheet
from antenna_drive.twin.sequential import Answer, decided, Look, Rule
from simgap.errors import one_line, UserError

# The first look [s of testing], and how much more there has to be for the next one. A test that
# is shorter than the first look has not shown much, and does not count as one.
FIRST_S, GROWTH = 15.0, 1.3
# Length of a next test [s].
DURATION_S = 30.0
# What designs it: from the entry `planning` of a verdict, for a configuration.
Design = Callable[[Mapping[str, Any], Drive], dict[str, Any]]
_LONGEST_FAULT = 300


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


class Task:
    """
    What a process is asked for, one thing at a time, after what it has to do already.

    fault : why the last one has failed; '' if it has not
    """

    def __init__(self, executor: Executor, drive: Drive,
                 function: Callable[[Any, Drive], dict[str, Any]]) -> None:
        """Ask for a function of a module, of something and the configuration."""
        self._executor, self._drive, self._function = executor, drive, function
        self._running: Future[dict[str, Any]] | None = None
        self._found: dict[str, Any] = {}
        self.fault = ''

    @property
    def under_way(self) -> bool:
        """Return whether something is being done."""
        return self._running is not None

    def _ask(self, given: object) -> None:
        self._running = self._executor.submit(self._function, given, self._drive)

    def take(self) -> bool:
        """
        Take what was found; return whether a task has ended.

        Raises BrokenExecutor: its process was ended.
        """
        if self._running is None or not self._running.done():
            return False
        future, self._running = self._running, None
        self._found, self.fault = {}, ''
        try:
            self._found = future.result()
        except BrokenExecutor:
            raise
        except Exception as error:  # noqa: B902 (a fault of the task must not end the twin)
            self.fault = one_line(error, _LONGEST_FAULT)
        return True


class GrowingVerdict(Task):
    """
    Looks at the tests of one machine while they are made.

    executor : that looks, one at a time
    drive : the configuration
    diagnose : what it does, a function of a module

    looks : what they said, in the order of time
    planning : what the design of a further test takes from the last one, {} before it
    """

    def __init__(self, executor: Executor, drive: Drive,
                 diagnose: Callable[[Mapping[str, Recording], Drive], dict[str, Any]] = diagnosed,
                 ) -> None:
        super().__init__(executor, drive, diagnose)
        self.rule = Rule()
        self._tests: dict[str, Recording] = {}
        self._lengths_s: list[float] = []  # of the tests that are looked at
        self.looks: list[Look] = []
        self.planning: Mapping[str, Any] = {}

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
        if self.under_way or self.decided:
            return False
        total = seconds + sum(map(_length, self._tests.values()))
        return total >= max(FIRST_S, GROWTH * sum(self._lengths_s))

    def begin(self, test: Recording) -> None:
        """Look at the present test and those before it."""
        tests = {**self._tests, f'test {len(self._tests) + 1}': test}
        self._lengths_s = [_length(item) for item in tests.values()]
        self._ask(tests)

    def take(self) -> bool:
        """Take the result of a look that has ended; see `Task.take`."""
        ended = super().take()
        if ended and not self.fault:
            self.looks.append(look_of(self._found, self._lengths_s))
            self.planning = self._found['planning']
        return ended

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


def designed(planning: Mapping[str, Any], drive: Drive) -> dict[str, Any]:
    """
    Return the test that tells the answers of a verdict apart, within the limits of the drive.

    planning : entry of the verdict's JSON
    drive : the configuration

    Returns say: lines of text; test: a test sheet as plain data, None if no test helps; sheet: the
    same as YAML, '' for none.

    Raises UserError: the verdict is of another configuration.
    """
    from antenna_drive.diagnosis.allowed_tests import AntennaTests
    from antenna_drive.diagnosis.drive_limits import DriveLimits
    from simgap.next_test.design import objective_for, TestDesign
    from simgap.next_test.proposal import as_data, lines
    from simgap.next_test.rivals import Findings
    findings = Findings.of_data(planning)
    space = AntennaTests(parse_sheet(planning['sheet']), drive, DriveLimits.of_drive(drive),
                         DURATION_S)
    try:
        found = TestDesign(space, findings, objective_for(findings), threads=1).run()
    except KeyError as error:
        raise UserError(f'{error.args[0]}: this configuration knows no such effect') from error
    data = as_data(found, space)
    return {'say': [line.strip() for line in lines(data)], 'test': data['test'],
            'sheet': dump_sheet(found.tests[0].test) if found.tests else ''}


class NextTest(Task):
    """
    The design of a next test: asked for, under way, there.

    executor, drive : that designs, and the configuration
    design : what it does, a function of a module
    """

    def __init__(self, executor: Executor, drive: Drive, design: Design = designed) -> None:
        super().__init__(executor, drive, design)
        self._seconds = 0.0

    def begin(self, planning: Mapping[str, Any], seconds: float) -> None:
        """Design one for a verdict after so much testing [s]; what was found before is gone."""
        self._found, self.fault, self._seconds = {}, '', seconds
        self._ask(planning)

    def message(self) -> dict[str, Any]:
        """Return what there is to say, as plain data for JSON."""
        return {'under_way': self.under_way, 'after_s': self._seconds, 'fault': self.fault,
                'say': self._found.get('say', []), 'test': self._found.get('test'),
                'sheet': self._found.get('sheet', '')}
