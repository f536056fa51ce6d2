# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The definition of a fit: valid and invalid target files, and the drives they lead to."""

from __future__ import annotations

import math
from pathlib import Path

from antenna_drive.parameters import load, ParameterError
from hypothesis import given, strategies as st
from lab.calibration.problem import (
    CalibrationProblem, Free, read_problem, SHIPPED, Target,
)
from lab.calibration.report import configuration
import pytest
import yaml

TARGETS = """
free:
  gearbox.half_gap: {low: 0.05, high: 0.3, scale: log}
  axis.coulomb_torque: {low: 1.0, high: 2.0}
  "axis.mode_inertias[1]": {low: 1.0e+6, high: 2.0e+6}
targets:
  T4a.final: {value: 22.0, tolerance: 0.3}
  T4a.overshoot: {at_least: 70.0, tolerance: 5.0, weight: 2.0}
"""


def written(folder: Path, text: str = TARGETS) -> Path:
    path = folder / 'targets.yaml'
    path.write_text(text)
    return path


@given(st.floats(0.0, 1.0), st.floats(1e-3, 1e3), st.floats(1.1, 1e3), st.booleans())
def test_a_share_of_the_bounds_and_back(share: float, low: float, ratio: float, log: bool) -> None:
    item = Free('gearbox.half_gap', low, low * ratio, log, 'rad')
    value = item.at(share)
    assert low * (1.0 - 1e-12) <= value <= low * ratio * (1.0 + 1e-12)
    assert item.share(value) == pytest.approx(share, abs=1e-9)


def test_a_candidate_changes_what_is_free_and_nothing_else(tmp_path: Path) -> None:
    problem = read_problem(written(tmp_path))
    assert problem.parameters([0.0, 1.0, 0.5]) == {
        'gearbox.half_gap': pytest.approx(0.05), 'axis.coulomb_torque': 2.0,
        'axis.mode_inertias': (2.82e6, 1.5e6, 0.99e6)}
    drive = problem.results([0.0, 1.0, 0.5]).drives['old_circuit']
    assert drive.motor_1.gearbox.half_gap == drive.motor_2.gearbox.half_gap == pytest.approx(0.05)
    assert drive.plant.axis.coulomb_torque == 2.0
    assert drive.plant.axis.mode_inertias == (2.82e6, 1.5e6, 0.99e6)
    assert drive.torque_share == load('old_circuit').torque_share
    own = problem.parameters(problem.start())
    assert own['gearbox.half_gap'] == pytest.approx(0.148)
    assert own['axis.coulomb_torque'] == pytest.approx(1.862)


def test_what_a_circuit_gives_is_not_the_candidates_to_change(tmp_path: Path) -> None:
    problem = read_problem(written(tmp_path, TARGETS.replace(
        'axis.coulomb_torque: {low: 1.0, high: 2.0}', 'torque_share.s_2: {low: 0.5, high: 2.0}')))
    drives = problem.results([0.5, 1.0, 0.5]).drives
    assert drives['new_circuit'].torque_share.circuit.s_2 == 0.8895


def test_costs_are_misses_in_tolerances() -> None:
    target = Target('x', 'value', 10.0, 2.0, 3.0)
    assert target.residual(14.0) == 2.0
    assert target.cost(10.0) == 0.0
    assert target.cost(10.02) == pytest.approx(3.0 * 0.01 ** 2, rel=1e-3)
    assert target.cost(210.0) == pytest.approx(3.0 * 2.0 * 99.0, rel=1e-2)
    assert Target('x', 'at_least', 10.0, 2.0).cost(11.0) == 0.0
    assert Target('x', 'at_most', 10.0, 2.0).cost(9.0) == 0.0
    assert Target('x', 'at_most', 10.0, 2.0).residual(12.0) == 1.0
    assert math.isfinite(target.cost(math.nan))


def test_figures_and_experiments_of_ones_own(tmp_path: Path) -> None:
    problem = read_problem(written(tmp_path, TARGETS + """
  my.peak: {at_most: 1.0, tolerance: 0.1}
figures:
  my.peak: {experiment: my_step, kind: high, signal: {motor_1/tach_rate: 0.5,
            motor_2/tach_rate: 0.5}, unit: rad/s}
experiments:
  my_step: {duration: 0.5, bias_share: 0.1, settings: {test_signal.rate.waveform: step,
            test_signal.rate.amplitude: 1.0e-4}}
"""))
    assert problem.results(problem.start())._known['my_step'].bias_share == 0.1
    figure = problem.figure('my.peak').value(problem.results(problem.start()))
    assert 0.0 < figure < 10.0


def test_a_candidate_is_given_up_once_it_costs_too_much(tmp_path: Path) -> None:
    problem = read_problem(written(tmp_path, TARGETS.replace('value: 22.0', 'value: 99.0')))
    evaluation = problem.evaluate(problem.start(), 1.0)
    assert not evaluation.complete
    assert set(evaluation.figures) == {'T4a.final'}
    assert problem.evaluate(problem.start()).complete


@pytest.mark.parametrize(('old', 'new', 'says'), [
    ('gearbox.half_gap', 'gearbox.half_gab', 'did you mean half_gap?'),
    ('gearbox.half_gap', 'gearbocks.half_gap', 'did you mean gearbox?'),
    ('low: 0.05', 'low: 0.5', 'low below high'),
    ('low: 0.05', 'low: -1.0', 'free.gearbox.half_gap.low'),
    ('scale: log', 'scale: lin', 'linear'),
    ('mode_inertias[1]', 'mode_inertias', 'one of a list'),
    ('T4a.final', 'T4a.finale', 'did you mean T4a.final?'),
    ('value: 22.0, ', '', 'one of value, at_least, at_most'),
    ('tolerance: 0.3', 'tolerance: 0.0', 'targets.T4a.final.tolerance'),
    ('tolerance: 0.3', 'tolerance: 3e-1x', 'targets.T4a.final.tolerance'),
    ('targets:', 'target:', 'did you mean targets?'),
    ('weight: 2.0', 'wait: 2.0', 'did you mean weight?'),
])
def test_mistakes_are_told_in_one_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = written(tmp_path, TARGETS.replace(old, new, 1))
    with pytest.raises(ParameterError) as raised:
        read_problem(path)
    assert str(raised.value).startswith(str(path))
    assert says in str(raised.value)
    assert '\n' not in str(raised.value)


@pytest.mark.parametrize('section', ['free', 'targets'])
def test_a_name_without_end_is_not_printed_whole(tmp_path: Path, section: str) -> None:
    text = TARGETS.replace(f'{section}:\n', f'{section}:\n  ? {"x" * 100_000}\n  : {{a: 1}}\n')
    assert text != TARGETS
    with pytest.raises(ParameterError) as raised:
        read_problem(written(tmp_path, text))
    assert f'{section}.xxx' in str(raised.value) and len(str(raised.value)) < 1000


def test_the_shipped_targets_are_valid() -> None:
    problem = read_problem(SHIPPED / 'article.yaml')
    assert isinstance(problem, CalibrationProblem)
    for item, share in zip(problem.free, problem.start()):
        assert 0.0 < share < 1.0, f'{item.name} starts at a bound'


def test_a_fitted_set_is_a_configuration_over_its_start(tmp_path: Path) -> None:
    problem = read_problem(written(tmp_path))
    out = tmp_path / 'fitted.yaml'
    out.write_text(configuration(problem, [0.5, 0.25, 0.5], 'reference'))
    fitted, start = load(str(out)), load()
    assert fitted.motor_1.gearbox.half_gap == pytest.approx(math.sqrt(0.05 * 0.3), rel=1e-6)
    assert fitted.plant.axis.coulomb_torque == pytest.approx(1.25)
    assert fitted.plant.axis.mode_inertias == (2.82e6, 1.5e6, 0.99e6)
    assert fitted.torque_share == start.torque_share
    # a fit that starts from another file keeps the other entries of that file
    own = tmp_path / 'own.yaml'
    own.write_text('amplifier: {lag: 0.02}\ngearbox: {stiffness: 30.0, half_gap: 0.1}\n')
    again = read_problem(written(tmp_path), [str(own)])
    out.write_text(configuration(again, [0.5, 0.25, 0.5], str(own)))
    fitted = load(str(out))
    assert fitted.motor_1.amplifier.lag == 0.02
    assert fitted.motor_1.gearbox.stiffness == 30.0
    assert fitted.motor_1.gearbox.half_gap == pytest.approx(math.sqrt(0.05 * 0.3), rel=1e-6)
    assert yaml.safe_load(out.read_text())['gearbox']['half_gap']['source'] == 'fitted'
