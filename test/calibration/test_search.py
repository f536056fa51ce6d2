# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The search and its report, on a problem whose best fit and slopes are known by hand."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import Path
import sys
from typing import Any

from antenna_drive.parameters import load, ParameterError
from lab import cli
from lab.calibration.problem import Evaluation, Free, Target
from lab.calibration.report import report
from lab.calibration.search import FitCandidate, search
import numpy as np
import pytest
from simgap.command.programs import BAD_INPUT, NOT_INSTALLED, OK
from simgap.errors import UserError

pytest.importorskip('cma')

# The figures are these sums of the shares: they determine a + b and a - b, but not c.
SLOPES = np.array([[100.0, 100.0, 0.0], [20.0, -20.0, 0.0]])
BEST = np.array([0.3, 0.7, 0.5])


class Linear:
    """A stand-in for a problem: figures that are linear in the shares of the bounds."""

    def __init__(self, interrupted_after: int | None = None) -> None:
        self.free = tuple(Free(f'gearbox.{name}', 0.0, 1.0, False, '1') for name in 'abc')
        self.targets = tuple(Target(name, 'value', float(number), 1.0)
                             for name, number in zip(('sum', 'difference'), SLOPES @ BEST))
        self.population, self.spread = 8, 0.2
        self.evaluated = 0
        self._interrupted_after = interrupted_after

    def start(self) -> list[float]:
        return [0.5, 0.5, 0.5]

    def parameters(self, shares: Sequence[float]) -> dict[str, Any]:
        return dict(zip('abc', shares))

    def figure(self, name: str) -> Any:
        return self.targets[0]  # has no unit, and nobody asks for one here

    def evaluate(self, shares: Sequence[float], give_up_at: float = math.inf) -> Evaluation:
        if self.evaluated == self._interrupted_after:
            raise KeyboardInterrupt
        self.evaluated += 1
        figures = dict(zip(('sum', 'difference'), map(float, SLOPES @ np.array(shares))))
        cost = 0.0
        for done, target in enumerate(self.targets, 1):
            cost += target.cost(figures[target.figure])
            if cost > give_up_at and done < len(self.targets):
                return Evaluation(cost, {target.figure: figures[target.figure]}, False)
        return Evaluation(cost, figures, True)


def places(candidates: Sequence[FitCandidate]) -> list[tuple[float, ...]]:
    return [candidate.shares for candidate in candidates]


def test_processes_try_the_same_candidates_in_the_same_order(tmp_path: Path) -> None:
    """Some are given up early, and those beside them must not change that."""
    alone = search(Linear(), 80, log=tmp_path / 'alone.log')  # type: ignore[arg-type]
    shared = search(Linear(), 80, log=tmp_path / 'shared.log', jobs=3)  # type: ignore[arg-type]
    assert shared == alone
    assert (tmp_path / 'shared.log').read_text() == (tmp_path / 'alone.log').read_text()
    # a log that was cut is continued by processes, too
    lines = (tmp_path / 'alone.log').read_text().splitlines(keepends=True)
    (tmp_path / 'cut.log').write_text(''.join(lines[:30]))
    assert search(Linear(), 80, log=tmp_path / 'cut.log',  # type: ignore[arg-type]
                  jobs=2) == alone
    assert (tmp_path / 'cut.log').read_text() == ''.join(lines)


def test_the_search_finds_what_the_targets_tell() -> None:
    found = search(Linear(), 800)  # type: ignore[arg-type]
    assert np.array(found.best.shares[:2]) == pytest.approx(BEST[:2], abs=5e-3)
    assert found.best.evaluation.complete


def test_a_seed_repeats_and_another_differs() -> None:
    first, again, other = (search(Linear(), 40, seed=seed)  # type: ignore[arg-type]
                           for seed in (1, 1, 2))
    assert places(first.candidates) == places(again.candidates)
    assert places(first.candidates)[1:] != places(other.candidates)[1:]


def test_an_interrupted_search_goes_on_and_ends_where_it_would_have_ended(tmp_path: Path) -> None:
    whole = search(Linear(), 80)  # type: ignore[arg-type]
    log = tmp_path / 'fit.log'
    with pytest.raises(KeyboardInterrupt):
        search(Linear(interrupted_after=30), 80, log=log)  # type: ignore[arg-type]
    # a line cut short by the interruption
    log.write_text(log.read_text()[:-20])
    rest = Linear()
    found = search(rest, 80, log=log)  # type: ignore[arg-type]
    assert places(found.candidates) == places(whole.candidates)
    assert found.best == whole.best
    assert rest.evaluated < 80 - 20
    # a further run simulates only the start
    rest = Linear()
    search(rest, 80, log=log)  # type: ignore[arg-type]
    assert rest.evaluated == 1


def test_a_log_of_another_search_is_refused(tmp_path: Path) -> None:
    log = tmp_path / 'fit.log'
    search(Linear(), 8, log=log)  # type: ignore[arg-type]
    before = log.read_bytes()
    with pytest.raises(UserError, match='belongs to another search'):
        search(Linear(), 8, seed=2, log=log)  # type: ignore[arg-type]
    assert log.read_bytes() == before
    log.write_text('not a log\n')
    with pytest.raises(UserError, match='fit.log'):
        search(Linear(), 8, log=log)  # type: ignore[arg-type]


def test_the_report_tells_what_is_determined(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = Linear()
    monkeypatch.setattr(problem, 'figure', lambda name: type('', (), {'unit': '1'}))
    found = search(problem, 800)  # type: ignore[arg-type]
    told = report(problem, found, ['sum'])  # type: ignore[arg-type]
    a, b, c = told['parameters']
    # by hand: the covariance is (S^T S)^-1, with 100 and 20 along a + b and a - b
    expected = math.sqrt(0.25 / 100.0 ** 2 + 0.25 / 20.0 ** 2)
    for item in (a, b):
        assert 0.5 * np.ptp(item['marginal']) == pytest.approx(expected, rel=1e-3)
        assert item['determined']
        alone = 1.0 / math.hypot(100.0, 20.0)
        assert 0.5 * np.ptp(item['conditional']) == pytest.approx(alone, rel=1e-3)
    assert not c['determined']
    pair, = told['correlations']
    wanted = (1 / 100.0 ** 2 - 1 / 20.0 ** 2) / (1 / 100.0 ** 2 + 1 / 20.0 ** 2)
    assert pair['correlation'] == pytest.approx(wanted, rel=1e-3)
    flat, = told['flat_directions']
    assert abs(flat['gearbox.c']) == pytest.approx(1.0)
    # the profile over c is level, and over a it rises on both sides
    assert np.ptp([cost for _, cost in c['profile']]) == pytest.approx(0.0, abs=1e-3)
    assert min(cost for _, cost in (a['profile'][0], a['profile'][-1])) > 1.0
    assert all(target['met'] for target in told['targets'])
    # the least cost of the difference, by the level of the sum, has its minimum near the aim
    curve = told['trade_offs']['sum']
    assert all(point['cost_of_the_others'] >= 0.0 for point in curve)
    cheapest = min(curve, key=lambda point: point['cost_of_the_others'])
    assert cheapest['missed'] == []
    with pytest.raises(ParameterError, match='no such target, did you mean sum'):
        report(problem, found, ['sums'])  # type: ignore[arg-type]


def test_the_command_writes_a_configuration(tmp_path: Path,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    targets = tmp_path / 'targets.yaml'
    targets.write_text("""
free:
  gearbox.contact_damping: {low: 0.05, high: 0.4, scale: log}
targets:
  T4a.overshoot: {value: 78.0, tolerance: 3.0}
search: {population: 4, spread: 0.1}
""")
    out = tmp_path / 'fitted.yaml'
    arguments = ['calibrate', str(targets), '--out', str(out), '--count', '8',
                 '--log', str(tmp_path / 'fit.log')]
    assert cli.main(arguments) == OK
    said = capsys.readouterr().out
    assert 'T4a.overshoot' in said
    assert 'gearbox.contact_damping' in said
    # less damping overshoots more than the reference's 0.133 does
    assert 0.05 <= load(str(out)).motor_1.gearbox.contact_damping <= 0.4
    first = out.read_bytes()
    assert cli.main(arguments) == OK
    assert out.read_bytes() == first


@pytest.mark.parametrize(('name', 'shown'), [('nowhere', 'nowhere'), ('a\udcff', 'a ')])
def test_a_missing_file_is_told_in_one_line(
        name: str, shown: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The second name has a byte that is no UTF-8, which is shown as a space."""
    assert cli.main(['calibrate', name, '--out', str(tmp_path / 'x')]) == BAD_INPUT
    error = capsys.readouterr().err
    assert f'{shown}: no such file' in error
    assert error.count('\n') == 1


def test_without_its_library_what_to_do_is_told(
        monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(sys.modules, 'cma', None)
    for name in ('lab.calibration.search', 'lab.calibration.report', 'lab.cli.calibrate'):
        monkeypatch.delitem(sys.modules, name, raising=False)
    assert cli.main(['calibrate', '--help']) == NOT_INSTALLED
    assert capsys.readouterr().err == (
        'lab calibrate: needs cma: make set-up, or pip install cma\n')
