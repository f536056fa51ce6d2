# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The effects: their names, their closed forms, and that each one shows and none breaks."""

from __future__ import annotations

import functools
import math

from lab.antenna import equations, family_b, laws
from lab.antenna.cases import draw_truths
from lab.antenna.effect import Defect
from lab.antenna.effects import CATALOGUE
from lab.antenna.machine import LAW_A, LAW_B, reference_machine
from lab.antenna.outside import OUTSIDE
from lab.antenna.real_antenna import simulate
from lab.antenna.sensors import record
from lab.antenna.sheet import CaseSheet
import numpy as np
from numpy.typing import NDArray
import pytest

# Fast enough to reach the limits of current and voltage.
PLAIN = CaseSheet('new', 'new', {'type': 'circuit', 'bias_pot': 0.8, 'start': 'steady'},
                  {'type': 'triangle', 'amplitude_deg_s': 0.685, 'period_s': 3.0})
MOTOR_EFFECTS = {
    'viscous_friction', 'stribeck_friction', 'coulomb_friction', 'friction_asymmetry',
    'load_dependent_friction', 'torque_ripple', 'torque_constant', 'armature_resistance',
    'amplifier_gain', 'amplifier_offset', 'amplifier_dead_zone', 'current_limit'}
OTHER_EFFECTS = {
    'gearbox_1': {'gap', 'stiffness', 'hysteresis', 'transmission_error'},
    'gearbox_2': {'gap', 'stiffness', 'hysteresis', 'transmission_error'},
    'torque_share': {'bias_pot', 'fade_out_voltage', 'share_filter', 'filter_1_gain',
                     'filter_1_pole'},
    'axis': {'coulomb_friction', 'viscous_friction', 'stribeck_friction',
             'position_dependent_friction', 'gravity_imbalance', 'wind_steady', 'wind_gust',
             'inertia', 'mode_frequency', 'mode_damping', 'extra_mode', 'bull_gear_backlash'},
    'tach_1': {'gain', 'offset', 'ripple'}, 'tach_2': {'gain', 'offset', 'ripple'},
    'current_1': {'gain', 'offset'}, 'current_2': {'gain', 'offset'},
    'encoder': {'quantisation', 'cyclic_error', 'offset'}, 'bias_voltage': {'gain'},
    'loop': {'delay'}}


def signals(effect: Defect | None, size: float) -> NDArray[np.float64]:
    """Return fourteen seconds of recorded signals, with an effect and all noises alike."""
    machine = reference_machine('new', 'new', 0.8)
    if effect is not None:
        effect.change(machine, effect.draw(size, np.random.default_rng(5)))
    times = np.arange(0.0, 14.0, 0.01)
    history = simulate(machine, PLAIN, times, (0.2, -0.4))
    columns = record(history, machine, PLAIN.sensors, times, np.random.default_rng(6))
    return np.stack(list(columns.values()))


@functools.cache
def unchanged_signals() -> NDArray[np.float64]:
    """Return the signals without any effect."""
    return signals(None, 0.0)


def test_catalogue_names_every_effect_of_the_specification() -> None:
    specified = {f'{motor}.{name}' for motor in ('motor_1', 'motor_2', 'motors')
                 for name in MOTOR_EFFECTS}
    specified |= {f'{part}.{name}' for part, names in OTHER_EFFECTS.items() for name in names}
    assert set(CATALOGUE) == specified
    assert len(OUTSIDE) >= 10
    assert not set(OUTSIDE) & set(CATALOGUE)


OTHER_LAWS = [effect for effect in family_b.CATALOGUE.values()
              if effect.key.split('.')[1] in family_b.LAWS]


def test_family_b_has_other_laws_for_the_same_effects_and_other_outsiders() -> None:
    assert set(family_b.CATALOGUE) == set(CATALOGUE)
    for key, effect in family_b.CATALOGUE.items():
        assert effect.quantities == CATALOGUE[key].quantities
        assert (effect in OTHER_LAWS) == (effect.form != CATALOGUE[key].form)
    assert len(family_b.OUTSIDE) >= 12
    assert not set(family_b.OUTSIDE) & set(OUTSIDE)


@pytest.mark.parametrize('effect', OTHER_LAWS, ids=lambda effect: effect.key)
@pytest.mark.slow
def test_the_other_law_is_another_one(effect: Defect) -> None:
    assert np.any(signals(effect, 1.0) != signals(CATALOGUE[effect.key], 1.0))


@pytest.mark.parametrize('effect', [*CATALOGUE.values(), *OUTSIDE.values(), *OTHER_LAWS,
                                    *family_b.OUTSIDE.values()],
                         ids=lambda effect: effect.form[:40] + effect.key)
@pytest.mark.slow
def test_every_effect_shows_at_both_ends_of_its_range(effect: Defect) -> None:
    before = unchanged_signals()
    for size in (0.0, 1.0):
        after = signals(effect, size)
        assert np.all(np.isfinite(after))
        assert np.any(after != before)


def test_sizes_span_the_range_and_turn_both_ways() -> None:
    effect = CATALOGUE['motor_1.amplifier_gain']
    quantity = effect.quantities[0]
    drawn = [quantity.at(0.5, np.random.default_rng(seed)) for seed in range(20)]
    middle = math.sqrt(quantity.low * quantity.high)
    assert sorted({round(value, 12) for value in drawn}) == pytest.approx([1 / middle, middle])
    for part, end in ((0.0, quantity.low), (1.0, quantity.high)):
        value = quantity.at(part, np.random.default_rng(0))
        assert max(value, 1.0 / value) == pytest.approx(end)


def test_mesh_error_is_the_rounded_saw_tooth() -> None:
    machine = reference_machine()
    machine.motors['mesh_error'] = 0.01
    machine.motors['mesh_cycles'] = 3.0
    for theta in (0.1, 1.0, 2.2, -1.4):
        x, rate, _ = laws.gear_deflection(
            machine.motors[0], machine.structure[0], theta, 2.0, 0.0, 0.0)
        terms = np.arange(1, 60)
        series = np.sum(np.sin(terms * 3.0 * theta) / (terms * 2.0**(terms - 1)))
        slope = np.sum(3.0 * np.cos(terms * 3.0 * theta) / 2.0**(terms - 1))
        assert x == pytest.approx(theta - 0.01 * series, abs=1e-14)
        assert rate == pytest.approx(2.0 - 0.01 * slope * 2.0, abs=1e-13)


def test_damaged_tooth_moves_as_fast_as_it_says() -> None:
    machine = reference_machine()
    machine.motors['tooth_height'] = 0.1
    machine.motors['tooth_ratio'] = 2.5
    step = 1e-6
    for theta in (0.2, -0.4, 1.0):
        (before, _, _), (_, rate, _), (after, _, _) = (
            laws.gear_deflection(
                machine.motors[0], machine.structure[0], theta + shift, 3.0, 0.0, 0.0)
            for shift in (-step, 0.0, step))
        assert rate == pytest.approx(3.0 * (after - before) / (2.0 * step), rel=1e-7)


@pytest.mark.parametrize('frequency', [0.5, 5.0, 20.0])
def test_delay_is_a_delay(frequency: float) -> None:
    """The approximant's response against exp(-j w delay), from its own state equations."""
    delay, rows = 0.01, 4
    y, slope = np.zeros(rows), np.zeros(rows)
    matrix, gain, out = np.zeros((rows, rows)), np.zeros(rows), np.zeros(rows)
    for k in range(rows):
        y[:] = 0.0
        y[k] = 1.0
        out[k] = laws.delayed(y, slope, 0, 0.0, delay)
        matrix[:, k] = slope
    y[:] = 0.0
    laws.delayed(y, slope, 0, 1.0, delay)
    gain[:] = slope
    omega = 2.0 * math.pi * frequency
    response = out @ np.linalg.solve(1j * omega * np.eye(rows) - matrix, gain)
    first_missing_term = 6.0 * 24.0 / (math.factorial(7) * math.factorial(8)) * (omega * delay)**8
    assert abs(response - np.exp(-1j * omega * delay)) < 1.5 * first_missing_term + 1e-12


def test_stribeck_falls_as_a_hyperbola() -> None:
    assert laws.stribeck_torque(4.0, 0.0, 2.0, LAW_A) == 4.0
    assert laws.stribeck_torque(4.0, -2.0, 2.0, LAW_A) == 2.0
    assert laws.stribeck_torque(4.0, 6.0, 2.0, LAW_A) == 1.0


def test_laws_of_family_b_have_the_limits_of_their_kind() -> None:
    """Each law agrees with the other at low and at high rate or load, and not between."""
    assert laws.stribeck_torque(4.0, 0.0, 2.0, LAW_B) == 4.0
    assert laws.stribeck_torque(4.0, -2.0, 2.0, LAW_B) == 2.0
    assert laws.stribeck_torque(4.0, 6.0, 2.0, LAW_B) == pytest.approx(0.4)
    # Eyring's fluid is Newton's at low rate, and a logarithm at high rate
    assert laws.viscous_torque(0.1, 0.01, 20.0, LAW_B) == pytest.approx(1e-3)
    rise = (laws.viscous_torque(0.1, 2e5, 20.0, LAW_B)
            - laws.viscous_torque(0.1, 1e5, 20.0, LAW_B))
    assert rise == pytest.approx(0.1 * 100.0 * math.log(2.0))
    for law in (LAW_A, LAW_B):
        # a dead zone lets nothing through in its middle and takes its half width away far off
        assert laws.crossover(1e-4, 0.5, law) == pytest.approx(0.0, abs=1e-9)
        assert laws.crossover(100.0, 0.5, law) == pytest.approx(99.5, abs=1e-4)
        angles = np.arange(0.0, 2.0 * math.pi, 1e-3)
        shape = [laws.ripple_shape(a, law) for a in angles]
        assert np.mean(shape) == pytest.approx(0.0, abs=1e-3)
        assert 0.9 < np.max(np.abs(shape)) < 1.25


def test_hysteresis_of_family_b_settles_at_the_same_share() -> None:
    """Bouc and Wen's law with exponent 2 is a hyperbolic tangent of the path from rest."""
    machine = reference_machine()
    machine.motors['hysteresis'] = 0.2
    machine.motors['law'] = LAW_B
    at, lag, step = equations.MOTOR_AT, 0.0, 1e-5
    y, dy = np.zeros(equations.STATES), np.zeros(equations.STATES)
    mode, margin = np.zeros(equations.SWITCHES, np.int64), np.zeros(equations.SWITCHES)
    y[at + equations.W] = 1.0
    for _ in range(int(0.07 / step)):
        y[at + equations.LAG_Z] = lag
        equations.motor_derivative(machine.motors[0], machine, y, dy, at, 0, 0.0, 0.5, mode,
                                   margin)
        lag += step * dy[at + equations.LAG_Z]
    assert lag == pytest.approx(math.tanh(1.0), abs=1e-3)


def test_lags_of_family_b_are_as_late_as_they_say() -> None:
    """The area above the answer to a step is the delay, whatever the order."""
    delay, step = 0.02, 1e-5
    y, dy, area = np.zeros(4), np.zeros(4), 0.0
    for _ in range(20000):
        area += step * (1.0 - laws.lagged(y, dy, 0, 1.0, delay))
        y += step * dy
    assert area == pytest.approx(delay, rel=1e-2)


def test_gust_has_the_strength_it_says() -> None:
    machine = reference_machine()
    CATALOGUE['axis.wind_gust'].change(machine, {'rms': 2e4, 'corner': 0.2, 'seed': 9.0})
    structure = machine.structure[0]
    assert math.sqrt(0.5 * float(np.sum(structure['gust']**2))) == pytest.approx(2e4)
    assert structure['gust_frequency'].max() < 2.0 * math.pi * 5.0
    torque = [laws.load_torque(structure, 0.0, t, t, 0.0) for t in np.arange(0, 1000, 0.05)]
    assert np.std(torque) == pytest.approx(2e4, rel=0.1)


def test_tach_ripple_leaves_the_mean_alone() -> None:
    motor = reference_machine().motors
    motor['tach_ripple'] = 0.2
    motor['tach_cycles'] = 6.0
    y = np.zeros(equations.STATES)
    y[equations.MOTOR_AT + equations.W] = 10.0
    readings = []
    for theta in np.arange(0.0, 2.0 * math.pi, 2.0 * math.pi / 6000):
        y[equations.MOTOR_AT + equations.THETA] = theta
        readings.append(equations.tach_reading(motor[0], y, equations.MOTOR_AT, 0.0, 0.5))
    assert np.mean(readings) == pytest.approx(10.0, rel=1e-4)
    assert np.std(readings) == pytest.approx(0.2 * 10.0 * 0.592, rel=0.01)


def test_cases_keep_the_mix_and_take_turns() -> None:
    truths = draw_truths(200, 4, 0.02)
    kinds = [truth['kind'] for truth in truths]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {
        'single': 110, 'pair': 30, 'none': 30, 'outside': 30}
    singles = [truth['effects'][0] for truth in truths if truth['kind'] == 'single']
    assert {entry['id'] for entry in singles} == set(CATALOGUE)
    sizes = sorted(entry['size'] for entry in singles)
    assert all(k / 110 <= size < (k + 1) / 110 for k, size in enumerate(sizes))
    for truth in truths:
        ids = [entry['id'] for entry in truth['effects']]
        assert len(set(ids)) == {'single': 1, 'pair': 2, 'none': 0, 'outside': 1}[truth['kind']]
        assert (truth['kind'] == 'outside') == any(name in OUTSIDE for name in ids)
    assert truths == draw_truths(200, 4, 0.02)
    assert truths != draw_truths(200, 5, 0.02)


@pytest.mark.parametrize('largest', [0.1, 0.4])
def test_a_trial_of_small_effects_has_the_same_cases_with_smaller_sizes(largest: float) -> None:
    usual = draw_truths(40, 4, 0.02)
    small = draw_truths(40, 4, 0.02, largest=largest)
    for large, little in zip(usual, small, strict=True):
        assert little['kind'] == large['kind']
        assert [e['id'] for e in little['effects']] == [e['id'] for e in large['effects']]
        for before, after in zip(large['effects'], little['effects'], strict=True):
            assert after['size'] <= largest
            if little['kind'] != 'pair':
                assert after['size'] == pytest.approx(largest * before['size'])
            else:
                assert after['size'] >= min(0.25, largest)
