# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Tests of the catalogue: every effect is there, neutral by default, and acts on what it names."""

from __future__ import annotations

from typing import Any

from antenna_drive.diagnosis.catalogue import catalogue
from antenna_drive.diagnosis.excitation import Bias, Longest, schedule, SheetCommand
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.modifiers import AntennaParameter
from antenna_drive.diagnosis.planned_tests import BUILT_IN, planned
from antenna_drive.diagnosis.waves import Wave
from antenna_drive.emulator import batch
from antenna_drive.emulator.run import simulate
from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed
from antenna_drive.readings import AT, SIGNALS
from antenna_drive.recording.sheet import Square
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

MOTOR_EFFECTS = (
    'viscous_friction stribeck_friction coulomb_friction friction_asymmetry '
    'load_dependent_friction torque_ripple torque_constant armature_resistance amplifier_gain '
    'amplifier_offset amplifier_dead_zone current_limit').split()
REQUIRED = {
    *(f'{motor}.{name}' for motor in ('motor_1', 'motor_2', 'motors') for name in MOTOR_EFFECTS),
    *(f'gearbox_{m}.{name}' for m in (1, 2)
      for name in ('gap', 'stiffness', 'hysteresis', 'transmission_error')),
    *(f'torque_share.{name}' for name in (
        'bias_pot', 'fade_out_voltage', 'share_filter', 'filter_1_gain', 'filter_1_pole')),
    *(f'axis.{name}' for name in (
        'coulomb_friction', 'viscous_friction', 'stribeck_friction',
        'position_dependent_friction', 'gravity_imbalance', 'wind_steady', 'inertia',
        'mode_frequency', 'mode_damping', 'extra_mode', 'bull_gear_backlash')),
    *(f'tach_{m}.{name}' for m in (1, 2) for name in ('gain', 'offset', 'ripple')),
    *(f'current_{m}.{name}' for m in (1, 2) for name in ('gain', 'offset')),
    'encoder.quantisation', 'encoder.cyclic_error', 'encoder.offset', 'bias_voltage.gain',
    'loop.delay',
}


@pytest.fixture(scope='module')
def model() -> Any:
    """Return the drive in two short tests of which nothing was read."""
    return AntennaMachine({name: planned(BUILT_IN[name], 4.0, 200.0)
                           for name in ('square', 'triangle')}, load(), threads=1)


def forms_of(model: Any, effect: Any) -> Any:
    """Return all forms of an effect, a wave at its first order."""
    for form in model.catalogue[effect.id].forms:
        if isinstance(form, Wave):
            form = model.catalogue.wave_at(form, form.orders[3])
        yield form


def test_catalogue_holds_what_the_specification_names() -> None:
    assert set(catalogue()) == REQUIRED


@pytest.mark.parametrize('effect', catalogue().values(), ids=lambda effect: effect.id)
def test_effect_is_neutral_until_it_has_a_size(model: Any, effect: Any) -> None:
    reference = model.simulate([{}])[0]
    for form in forms_of(model, effect):
        assert form.parameters[0].low <= 0.0 <= form.parameters[0].high
        for with_effect, without in zip(model.simulate([form.start])[0], reference,
                                        strict=True):
            assert with_effect.tobytes() == without.tobytes()


@pytest.mark.parametrize('effect', catalogue().values(), ids=lambda effect: effect.id)
def test_effect_changes_some_reading(model: Any, effect: Any) -> None:
    reference = model.simulate([{}])[0]
    changed_one = False
    for form in forms_of(model, effect):
        first = form.parameters[0]
        points = [{**form.start, first.name: 0.6 * bound} for bound in (first.low, first.high)]
        changed_one |= any(not np.array_equal(a, b) for a, b in zip(
            sum(model.simulate(points), []), 2 * reference, strict=True))
    # this short test does not saturate, a limit set higher does not show
    assert changed_one or effect.id.endswith('current_limit')


@pytest.mark.parametrize('name', ['motor_1.current_limit.change', 'motors.torque_constant.change',
                                  'motor_2.armature_resistance.change'])
def test_effect_knows_by_how_much_its_number_may_be_off_anyway(model: Any, name: str) -> None:
    """Whether a number is scaled or added to, and whatever else it moves with; 2 percent here."""
    resistance = load().motor_2.armature.resistance
    expected = 0.02 * (resistance if 'resistance' in name else 1.0)
    found = {p.name: p.tolerance for effect in model.catalogue.values()
             for form in effect.forms for p in form.parameters}
    assert found[name] == pytest.approx(expected)
    assert found['motor_1.viscous_friction.flow_index'] == 0.0, 'a shape may be anything'


def test_every_effect_but_lost_bits_has_a_size_that_is_healthy(model: Any) -> None:
    without = {effect.id for effect in model.catalogue.values()
               if not any(p.tolerance for form in effect.forms for p in form.sizes)}
    assert without == {'encoder.quantisation'}


@pytest.mark.parametrize('effect', [e for e in catalogue().values() if e.simpler],
                         ids=lambda effect: effect.id)
def test_effect_becomes_the_simpler_one_that_it_names(model: Any, effect: Any) -> None:
    """At the end of its range, in a slow test, most of what it does is what the other does."""
    form = model.catalogue[effect.id].forms[0]
    if isinstance(form, Wave):
        form = model.catalogue.wave_at(form, form.orders[0])  # the longest wave
        size, end = form.sizes[1], form.start        # a cosine does not vanish at the start
    else:
        [size] = form.sizes
        end = {p.name: p.high for p in form.parameters if p.is_shape}
    point = {**end, size.name: 4.0 * size.tolerance}
    [simpler] = model.catalogue[effect.simpler[0]].forms[0].sizes

    def change(point: dict[str, float]) -> Any:
        [with_it, *_], [without, *_] = model.simulate([point, {}])
        return np.ravel((with_it - without) / model.experiments[0].noise)

    done, slope = change(point), change({simpler.name: simpler.step}) / simpler.step
    guess = float(slope @ done / (slope @ slope))
    found = minimize_scalar(
        lambda value: np.linalg.norm(done - change({simpler.name: value})),
        bounds=sorted((0.5 * guess, 2.0 * guess)), method='bounded')
    assert found.fun < 0.2 * np.linalg.norm(done)


def test_time_stamps_err_more_on_what_is_faster(model: Any) -> None:
    """The noise of a reading that ripples is the sheet's and the ripple's slope times jitter."""
    form = model.catalogue.wave_at(model.catalogue['tach_1.ripple'].forms[0], 3.0)
    point = {**form.start, form.parameters[0].name: 0.2}
    quiet, loud = model.experiments, model.with_noise_at(point).experiments
    late = 3e-7
    for k, (test, before, after) in enumerate(zip(model._tests, quiet, loud, strict=True)):
        shifted = model.simulate([point, *(
            {**point, f'clock:{test.name}': times * late} for times in (1.0, 2.0))])
        # of second order: a ripple is curved
        slope = (4.0 * shifted[1][k] - 3.0 * shifted[0][k] - shifted[2][k])[:, AT['tach_1']] / (
            2.0 * late)
        more = after.noise[:, AT['tach_1']] ** 2 - (test.jitter * slope) ** 2
        rate = shifted[0][k][:, AT['tach_1']]
        known = test.sensors.known
        assert more == pytest.approx(
            known['tach_noise_rad_s'] ** 2 + known['tach_step_rad_s'] ** 2 / 12.0
            + (known['tach_noise_relative'] * rate) ** 2, rel=1e-6)
        assert after.noise[:, AT['tach_1']].max() > before.noise[:, AT['tach_1']].max()
        assert after.measured is before.measured


def test_every_field_of_the_catalogue_is_one_of_the_record() -> None:
    record = record_of(load())
    for effect in catalogue().values():
        for form in effect.forms:
            for parameter in form.parameters:
                assert isinstance(parameter, AntennaParameter)
                for path in parameter.modifier.fields:
                    place = record
                    for part in path.split('.'):
                        if not part.isdigit():
                            place = place[part]


def test_batch_agrees_with_the_converged_emulator() -> None:
    drive = changed(load('new_circuit'), {
        'test_signal.rate.waveform': 'square', 'test_signal.rate.amplitude': 7.4e-4,
        'test_signal.rate.period': 3.0, 'motor_1.start_in_gap': -0.3,
        'torque_share.circuit.start': 'steady'})
    fine = simulate(drive, 3.0, 2.5e-5, every=400)
    command = SheetCommand(Square(np.degrees(7.4e-4), 3.0, 0.0))
    out = batch.run(record_of(drive), schedule(command, Bias(), fine.time, Longest(2.5e-3)))
    for c, name in enumerate(SIGNALS):
        scale = np.sqrt(np.mean(fine[name] ** 2))
        assert np.sqrt(np.mean((out[:, c, 0] - fine[name]) ** 2)) < 2e-4 * scale
