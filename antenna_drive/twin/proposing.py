# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The next test for a verdict that grows, designed when somebody asks for it.

It takes minutes of a core, in the process of the looks. So nobody gets it unasked, and it is not
for every look.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from typing import Any

from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.sheet import dump_sheet, parse_sheet
from antenna_drive.twin.outcome import outcome
from simgap.errors import UserError

DURATION_S = 30.0
Design = Callable[[Mapping[str, Any], Drive], dict[str, Any]]


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


class NextTest:
    """
    The design of a next test: asked for, under way, there.

    executor : that designs, after what it has to do already
    drive : the configuration
    design : what it does, a function of a module

    fault : why there is none although it was asked for; '' if that is not so
    """

    def __init__(self, executor: Executor, drive: Drive, design: Design = designed) -> None:
        """Begin with none."""
        self._executor, self._drive, self._design = executor, drive, design
        self._running: Future[dict[str, Any]] | None = None
        self._seconds = 0.0
        self._found: dict[str, Any] = {}
        self.fault = ''

    @property
    def under_way(self) -> bool:
        """Return whether one is being designed."""
        return self._running is not None

    def begin(self, planning: Mapping[str, Any], seconds: float) -> None:
        """Design one for a verdict after so much testing [s]; what was found before is gone."""
        self._found, self.fault, self._seconds = {}, '', seconds
        self._running = self._executor.submit(self._design, planning, self._drive)

    def take(self) -> bool:
        """
        Take what was found; return whether a design has ended.

        Raises BrokenExecutor: its process was ended.
        """
        if self._running is None or not self._running.done():
            return False
        future, self._running = self._running, None
        found, self.fault = outcome(future)
        self._found = found or {}
        return True

    def message(self) -> dict[str, Any]:
        """Return what there is to say, as plain data for JSON."""
        return {'under_way': self.under_way, 'after_s': self._seconds, 'fault': self.fault,
                'say': self._found.get('say', []), 'test': self._found.get('test'),
                'sheet': self._found.get('sheet', '')}
