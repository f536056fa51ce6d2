# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive as the diagnosis runs it: rough steps for derivatives, fine ones for judgement."""

from __future__ import annotations

from dataclasses import replace

from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import BUILT_IN, planned
from antenna_drive.parameters import load
from antenna_drive.readings import AT
from antenna_drive.recording.sheet import FixedBias, FixedStepBias
import numpy as np
import pytest
from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import with_initial_conditions

LENGTH_S = 8.0


@pytest.fixture(scope='module')
def model() -> AntennaMachine:
    """Return the drive in two tests whose readings are those of the model itself."""
    drive = AntennaMachine({name: planned(BUILT_IN[name], LENGTH_S, 200.0)
                            for name in ('square', 'multisine')}, load(), threads=1)
    shown = drive.simulate([{}])[0]
    drive.experiments = tuple(replace(e, measured=values) for e, values in zip(
        drive.experiments, shown, strict=True) if values is not None)
    return drive


@pytest.mark.parametrize('effect', ['motor_1.viscous_friction', 'gearbox_2.stiffness',
                                    'gearbox_1.hysteresis', 'axis.inertia', 'tach_1.gain'])
def test_a_derivative_of_rough_runs_is_nearly_that_of_fine_ones(
        model: AntennaMachine, effect: str) -> None:
    """Two runs of 2.5 ms, taken here by hand, against the column that a fit is given."""
    form = model.catalogue[effect].forms[0]
    size, point = form.parameters[0], form.start
    problem = LeastSquares(model)
    residual = problem.residuals(point)
    column = problem.jacobian(point, [size], residual, central=False)[:, 0]
    moved = problem.residuals({**point, size.name: size.step})
    fine = (residual - moved) / size.step
    assert np.linalg.norm(column - fine) < 0.15 * np.linalg.norm(fine)


@pytest.mark.parametrize('name, value', [
    ('motor_2.viscous_friction.torque_per_rate', 0.05), ('gearbox_1.hysteresis.torque', 0.5),
    ('axis.inertia.change', 0.3), ('motors.armature_resistance.trimmed_change', 1.0),
    ('torque_share.filter_1_pole.change', 0.5)])
def test_rough_runs_stay_within_the_noise_of_fine_ones(
        model: AntennaMachine, name: str, value: float) -> None:
    form = next(form for effect in model.catalogue.values() for form in effect.forms
                if form.parameters[0].name == name)
    point = {**form.start, name: value}
    fine, rough = (of.simulate([point])[0] for of in (model, model.low_fidelity()))
    for experiment, a, b in zip(model.experiments, fine, rough, strict=True):
        assert a is not None
        assert b is not None
        assert np.sqrt(np.mean(((a - b) / experiment.noise) ** 2)) < 0.5


def test_the_rough_model_is_rough_once(model: AntennaMachine) -> None:
    assert model.low_fidelity() is model.low_fidelity()
    assert model.low_fidelity() is not model
    assert model.low_fidelity().low_fidelity() is model.low_fidelity()
    brief = model.truncated()
    assert brief.low_fidelity() is brief


def test_a_source_of_bias_that_is_off_gives_as_much_more() -> None:
    """Tables of steps are kept for each voltage, and none passes for another."""
    sheet = replace(BUILT_IN['square'], bias=FixedStepBias(voltage_V=6.0, at_s=1.0))
    drive = AntennaMachine({'stepped': planned(sheet, 2.0, 200.0)}, load(), threads=1)
    for share in (0.0, 0.01, -0.02, 0.01):
        drive._runs.clear()
        shown = drive.simulate([{'supply:stepped': share}])[0][0]
        assert shown is not None
        expected = np.where(drive.experiments[0].time < 1.0, 0.0, 6.0 * (1.0 + share))
        away = np.abs(drive.experiments[0].time - 1.0) > 1e-9
        assert shown[away, AT['bias_voltage']] == pytest.approx(expected[away], abs=1e-12)


@pytest.mark.parametrize('places', [(0.1, -0.9), (-0.6, -0.6), (0.3, 0.9)])
def test_both_motors_are_found_where_they_start_when_a_bias_closes_their_gaps_at_once(
        places: tuple[float, float]) -> None:
    sheet = replace(BUILT_IN['square'], bias=FixedBias(voltage_V=8.5))
    drive = AntennaMachine({'biased': planned(sheet, 2.0, 200.0)}, load(), threads=1)
    names = [f'start:biased.{motor}' for motor in ('motor_1', 'motor_2')]
    shown = drive.simulate([dict(zip(names, places, strict=True))])[0][0]
    assert shown is not None
    drive.experiments = (replace(drive.experiments[0], measured=shown),)
    found = with_initial_conditions(LeastSquares(drive), {})
    # within one step of the places that are tried
    assert [found.get(name, 0.0) for name in names] == pytest.approx(list(places), abs=0.16)
