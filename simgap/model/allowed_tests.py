# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The tests that a model of one's own declares, as the design of the next test asks for them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from simgap.logs.log import Log
from simgap.machine.contract import FloatArray, Machine, Point
from simgap.model.declared import Model, ModelError
from simgap.model.machine import OwnMachine
from simgap.next_test.candidate import Proposal
from simgap.next_test.design import objective_for, TestDesign
from simgap.next_test.rivals import Findings
from simgap.next_test.space import TestSpace
from simgap.verdict.record import Verdict


class OwnTests(TestSpace):
    """The tests of `duration_s` [s] that a model of one's own declares, within its limits."""

    def __init__(self, model: Model, duration_s: float) -> None:
        """Take the tests from a model; ModelError if it declares none."""
        if not model.tests:
            raise ModelError('tests: the model does not say what a test may be; give machine(..., '
                             'tests={kind: f(duration_s, random) -> Log})')
        self.families = tuple(model.tests)
        self._model, self._duration = model, duration_s
        self.limits = model.limits

    def draw(self, family: str, random: np.random.Generator) -> Log:
        log = self._model.tests[family](self._duration, random)
        if not isinstance(log, Log):
            raise ModelError(f'tests: {family}: {type(log).__name__} returned, allowed is a Log')
        return replace(log, name='next')

    def machine(self, test: Any) -> OwnMachine:
        """Return the machine in one test, with the readings of the model as configured."""
        silent = self._with_readings(test, np.zeros((test.time.size, len(self._model.readings))))
        rate = 1.0 / float(np.median(np.diff(test.time)))
        every_sample = OwnMachine(replace(self._model, judged_hz=rate), [silent])
        return OwnMachine(self._model, [self._with_readings(test, every_sample.predict({}, 0))])

    def use(self, machine: Machine, points: Sequence[Point]) -> Mapping[str, float]:
        readings = [np.abs(machine.predict(point, 0)).max(axis=0) for point in points]
        # a run that diverged keeps no limit
        worst = np.nan_to_num(np.max(readings, axis=0), nan=np.inf)
        return {name: float(worst[list(self._model.readings).index(name)]) / limit
                for name, limit in self._model.limits.items()}

    def command(self, test: Any) -> tuple[FloatArray, FloatArray, str]:
        """Return times and values of the first command of a test; its unit is not known."""
        return test.time, next(iter(test.columns.values()), np.zeros_like(test.time)), ''

    def as_data(self, test: Any) -> dict[str, Any]:
        return {'columns': list(test.columns), 'samples': int(test.time.size),
                'length_s': float(test.time[-1] - test.time[0]), 'constants': dict(test.constants)}

    def files(self, test: Any, path: Path) -> Mapping[Path, str]:
        """Return the commands of a test as CSV, and its constants as the YAML beside it."""
        columns = {'time_s': test.time, **test.columns}
        rows = [','.join(columns)]
        rows += [','.join(f'{x:.9g}' for x in row)
                 for row in zip(*(values.tolist() for values in columns.values()), strict=True)]
        found = {path: '\n'.join(rows) + '\n'}
        if test.constants:
            import yaml
            found[path.with_suffix('.yaml')] = yaml.safe_dump({'constants': dict(test.constants)})
        return found

    def _with_readings(self, test: Log, readings: FloatArray) -> Log:
        columns = {item.column or name: values for (name, item), values in zip(
            self._model.readings.items(), readings.T, strict=True)}
        return replace(test, columns={**columns, **test.columns})


def propose(model: Model, verdict: Verdict | None = None, duration_s: float = 30.0,
            threads: int = 2, seed: int = 0) -> Proposal:
    """
    Design the next test of a machine, of `duration_s` [s], among those that its model declares.

    It tells the answers of `verdict` apart, or is the one that detects most. `seed` is that of the
    tests that are drawn. Raises ModelError if the model declares no tests.
    """
    findings = Findings.of_data(verdict.planning) if verdict else Findings()
    return TestDesign(OwnTests(model, duration_s), findings, objective_for(findings),
                      threads=threads, seed=seed).run()
