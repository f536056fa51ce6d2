# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The diagnosis of a machine of one's own.

>>> from simgap.model import diagnose_logs, load_model, read_log  # doctest: +SKIP
>>> found = diagnose_logs(load_model('my_machine.py'), [read_log('a.csv')])     # doctest: +SKIP
>>> print(found.summary())                                                      # doctest: +SKIP
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from simgap.fit.least_squares import LeastSquares
from simgap.logs.log import Log
from simgap.machine import check
from simgap.machine.by_label import ByLabel, without_labels
from simgap.machine.contract import Machine, Point
from simgap.model.declared import Model
from simgap.model.machine import OwnMachine
from simgap.model.pushes import pushes
from simgap.model.response import derivative_error
from simgap.search.rival import Rival
from simgap.settings import DEFAULT, Settings
from simgap.verdict.diagnosis import diagnose, Progress
from simgap.verdict.record import Verdict
from simgap.verdict.spoken import quantity

# Pushes that the summary lists.
_PUSHES = 6
# However smooth a simulation is, a fit is linear about its end only so far.
_LEAST_ERROR = 0.01


@dataclass(frozen=True, repr=False)
class OwnVerdict(Verdict):
    # value, configured and unit of each number of the simulation, as fitted
    numbers: Mapping[str, Any]
    # where something enters that no effect names: test, place, from_s, until_s, size and unit
    pushes: Sequence[Mapping[str, Any]]

    def summary(self) -> str:
        lines = [f'  {item["test"]}: {item["place"]} {quantity(item["size"], item["unit"])} from '
                 f'{item["from_s"]:.2f} to {item["until_s"]:.2f} s'
                 for item in self.pushes[:_PUSHES]]
        if len(self.pushes) > _PUSHES:
            lines.append(f'  and {len(self.pushes) - _PUSHES} more, see the JSON')
        return '\n'.join([super().summary(), *lines])


def diagnose_logs(model: Model, logs: Sequence[Log],
                  progress: Progress = lambda share, doing: None, threads: int = 2,
                  settings: Settings = DEFAULT, without: Sequence[str] = (),
                  limits: Mapping[str, float] | None = None,
                  earlier: Sequence[Rival] = ()) -> OwnVerdict:
    """
    Say where a machine and its model part, which effect is behind it, and how far it goes.

    Raises UserError if model or logs cannot be used; the message says what is wrong.

    progress : called with the share that is done, 0 to 1, and what is being done
    threads : how many hypotheses are fitted at once
    without : effects that the catalogue shall lack
    limits : for some readings, the remainder beyond noise from which it matters
    earlier : answers of a verdict on some of the logs, see `diagnosis.diagnose`
    """
    machine = OwnMachine(model, logs)
    check.check_tests(machine)
    searched = check.without(machine, without, limits or ())
    # thresholds with the error that this simulation's derivatives have
    interval = replace(settings.interval, derivative_error=min(
        max(derivative_error(machine), _LEAST_ERROR), settings.interval.derivative_error))
    found = diagnose(searched, progress, threads, replace(settings, interval=interval), limits,
                     earlier)
    return OwnVerdict(**vars(found), numbers=numbers_as_fitted(
        found.machine, found.best.state.point()), pushes=pushes_found(found, settings))


def numbers_as_fitted(machine: Machine, point: Point) -> dict[str, Any]:
    """Return every number of the simulation as fitted, per test where it is a test's own."""
    own = without_labels(machine)
    assert isinstance(own, OwnMachine)
    model = own.model
    points = [machine.labels.in_test(point, k) if isinstance(machine, ByLabel) else point
              for k in range(len(own.logs))]
    fitted = [own.numbers(here, k) for k, here in enumerate(points)]
    numbers: dict[str, Any] = {
        name: {'value': own.numbers(point, 0)[name], 'configured': item.value, 'unit': item.unit}
        for name, item in model.base.items()}
    for name, item in model.per_test.items():
        for log, values in zip(own.logs, fitted, strict=True):
            numbers[f'{name}[{log.name}]'] = {
                'value': values[name], 'configured': item.value, 'unit': item.unit}
    known = {p.name for p in own.nuisances}
    for log, here, values in zip(own.logs, points, fitted, strict=True):
        for parameter in here:
            name = own.number_of(parameter)
            if parameter in known or not name:
                continue
            # a number by label is one of each test
            ending = '' if parameter in point else f'[{log.name}]'
            numbers[name + ending] = {'value': values[name], 'configured': None}
            if '@' in parameter:
                order = f'{name.rpartition("_")[0]}_order'
                numbers[order + ending] = {'value': values[order], 'configured': None,
                                           'unit': '1/rev'}
    return numbers


def pushes_found(verdict: Verdict, settings: Settings = DEFAULT) -> list[dict[str, Any]]:
    """Return when something enters that no effect names, and how strongly; empty for nothing."""
    machine = without_labels(verdict.machine)
    assert isinstance(machine, OwnMachine)
    labels = {place.name: place for place in machine.disturbance_inputs}
    best = next(iter(verdict.may_enter_at), None)
    if best is None or best.name not in labels:
        return []
    place = machine.model.push[machine.push_at(best.name)]
    problem = LeastSquares(machine, settings=settings)
    return [{'place': best.name, **vars(item), 'unit': place.unit} for item in pushes(
        problem, verdict.none.state.point(), labels[best.name])]
