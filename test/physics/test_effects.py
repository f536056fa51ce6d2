# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a motor and its amplifier may have beyond the article, against closed forms."""

from dataclasses import replace
import math
from operator import attrgetter
from typing import Any

from antenna_drive.emulator.run import simulate
from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed, LAW_PLACES
from antenna_drive.physics.amplifier import armature_voltage, limit_centre, limited
from antenna_drive.physics.armature import current_rate
from antenna_drive.physics.gearbox import gear_torque, presliding_rate
from antenna_drive.physics.harmonics import wave, wave_slope
from antenna_drive.physics.table import tabled
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from simgap.laws.backlash import contact_side

ANGLES = st.floats(-20.0, 20.0)


PHASES = st.floats(-3.0, 3.0)


@given(ANGLES, st.floats(0.1, 40.0), PHASES, PHASES, PHASES)
def test_slope_of_a_wave_is_its_derivative(angle: float, cycles: float, phase: float,
                                           second: float, third: float) -> None:
    d = 1e-6 / cycles
    here = [wave(angle + s * d, 0.7, 0.2, 0.1, cycles, phase, second, third)
            for s in (-1.0, 1.0)]
    slope = wave_slope(angle, 0.7, 0.2, 0.1, cycles, phase, second, third)
    assert slope == pytest.approx((here[1] - here[0]) / (2.0 * d), abs=1e-6 * cycles)


def test_a_wave_holds_its_harmonics_and_nothing_else() -> None:
    turn = np.arange(64) * 2.0 * math.pi / 64
    lines = np.fft.rfft([wave(a, 0.7, 0.2, 0.1, 3.0, 0.4, 1.1, 0.6) for a in turn]) / 32.0
    assert abs(lines[3]) == pytest.approx(0.7)
    assert abs(lines[6]) == pytest.approx(0.2)
    assert abs(lines[9]) == pytest.approx(0.1)
    assert np.abs(np.delete(lines, [3, 6, 9])).max() < 1e-12


def test_crossover_swallows_what_it_is_said_to() -> None:
    drive = load().motor_1
    armature = record_of(drive.armature)[0]
    ideal = record_of(drive.amplifier)[0]
    worn = record_of(replace(drive.amplifier, crossover=0.2))[0]
    slope = armature_voltage(1e-3, 0.0, ideal, armature) / 1e-3
    for sign in (-1.0, 1.0):
        # a large demand loses it whole, a small one nearly all of itself
        lost = armature_voltage(5.0 * sign, 0.0, ideal, armature) - armature_voltage(
            5.0 * sign, 0.0, worn, armature)
        assert lost / slope == pytest.approx(0.2 * sign, rel=0.05)
        assert abs(armature_voltage(0.002 * sign, 0.0, worn, armature)) < 0.01 * slope * 0.002


def test_gain_of_amplifier_2_acts_on_the_demand_alone() -> None:
    drive = load().motor_1
    armature = record_of(drive.armature)[0]
    ideal = record_of(drive.amplifier)[0]
    other = record_of(replace(drive.amplifier, forward_gain_share=1.1))[0]
    forward = armature_voltage(0.5, 0.0, ideal, armature)
    assert armature_voltage(0.5, 0.0, other, armature) == pytest.approx(1.1 * forward)
    assert armature_voltage(0.0, 0.5, other, armature) == armature_voltage(
        0.0, 0.5, ideal, armature)


@given(st.floats(-4.0, 4.0), st.floats(-50.0, 50.0), st.floats(-0.3, 2.0))
def test_a_current_that_was_learnt_is_a_winding_that_has_changed(
        demand: float, rate: float, ohm: float) -> None:
    drive = load().motor_1
    whole = drive.armature.resistance + drive.amplifier.current_feedback_gain
    # of the current that is asked for a share flows: whole / (whole + ohm)
    table = np.linspace(-12.0, 12.0, LAW_PLACES) * -ohm / (whole + ohm)
    amplifier, learnt = record_of(drive.amplifier)[0], record_of(replace(
        drive.amplifier, learnt=1.0, current_by_demand=tuple(table.tolist()),
        current_by_demand_reach=12.0))[0]
    armature, warm = record_of(drive.armature)[0], record_of(replace(
        drive.armature, resistance_change=ohm))[0]
    centre = limit_centre(rate, amplifier, armature)
    current = demand * whole / (whole + ohm)
    for part, winding in ((amplifier, warm), (learnt, armature)):
        asked = limited(centre + demand, centre, 5.0, part)
        volts = armature_voltage(asked, current, part, winding)
        assert current_rate(volts, current, rate, winding) == pytest.approx(0.0, abs=1e-6)


@given(st.floats(-0.2, 0.2), st.floats(-5.0, 5.0), st.floats(-0.5, 2.0))
def test_a_tooth_torque_that_was_learnt_is_a_stiffer_gearbox(
        angle: float, rate: float, share: float) -> None:
    gearbox = load().motor_1.gearbox
    stiff = record_of(replace(gearbox, stiffness=(1.0 + share) * gearbox.stiffness,
                              contact_damping=(1.0 + share) * gearbox.contact_damping))[0]
    table = share * np.linspace(-1e5, 1e5, LAW_PLACES)
    learnt = record_of(replace(gearbox, learnt=1.0, torque_by_load=tuple(table.tolist()),
                               torque_by_load_reach=1e5))[0]
    side = contact_side(angle, rate, gearbox.half_gap, gearbox.stiffness, gearbox.contact_damping)
    assert gear_torque(side, angle, rate, 0.0, learnt) == pytest.approx(
        gear_torque(side, angle, rate, 0.0, stiff), rel=1e-9, abs=1e-6)


def test_current_settles_by_ohms_law_with_what_the_winding_has_become() -> None:
    armature = load().motor_1.armature
    record = record_of(replace(armature, resistance_change=0.1, back_emf_share=0.8))[0]
    kappa = armature.physical_amperes_per_article_ampere
    rate, voltage = 5.0, 60.0
    current = (voltage - 0.8 * armature.back_emf_constant * rate) / kappa / (
        armature.resistance + 0.1)
    assert current_rate(voltage, current, rate, record) == pytest.approx(0.0, abs=1e-9)


def test_hysteresis_as_a_share_of_the_load_grows_with_the_load() -> None:
    gearbox = replace(load().motor_1.gearbox, half_gap=0.0, contact_damping=0.0)
    ideal = record_of(gearbox)[0]
    worn = record_of(replace(gearbox, hysteresis_share=0.1, hysteresis_angle=0.02))[0]
    for twist in (0.5, 1.0):
        elastic = gear_torque(1, twist, 0.0, 0.0, ideal)
        # wound up all the way it adds its share, and takes it on the way back
        for state in (1.0, -1.0):
            assert gear_torque(1, twist, 0.0, state, worn) == pytest.approx(
                elastic * (1.0 + 0.1 * state))
    # the state comes to rest where the teeth have moved far enough one way
    assert presliding_rate(1, 0.3, 1.0, worn) == 0.0
    assert presliding_rate(1, 0.3, 0.0, worn) == pytest.approx(0.3 / 0.02)


@given(st.floats(-5.0, 5.0), st.lists(ANGLES, min_size=2, max_size=12))
def test_a_table_is_straight_between_its_values_and_level_beyond(
        x: float, values: list[float]) -> None:
    table = np.array(values)
    expected = np.interp(x, np.linspace(-2.0, 2.0, table.size), table)
    assert tabled(x, 2.0, table) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(('path', 'values', 'span', 'known', 'change'), [
    ('motor_1.motor.friction_by_rate', 2.0, 60.0, 'motor_1.motor.coulomb_torque', 2.0),
    ('motor_1.motor.friction_by_load', 2.0, 60.0, 'motor_1.motor.coulomb_torque', 2.0),
    ('motor_1.motor.torque_by_current', (-6.0, 6.0), 10.0, 'motor_1.motor.torque_constant', 0.6),
    ('plant.axis.friction_by_rate', 3e5, 0.01, 'plant.axis.coulomb_torque', 3e5),
    ('plant.axis.torque_by_angle', 3e5, 0.1, 'plant.axis.steady_wind_torque', 3e5),
])
def test_a_learnt_function_does_what_the_effect_does_that_it_is(
        path: str, values: float | tuple[float, float], span: float, known: str,
        change: float) -> None:
    drive = changed(load('new_circuit'), {
        'test_signal.rate.waveform': 'square', 'test_signal.rate.amplitude': 0.002,
        'test_signal.rate.period': 2.0})
    owner, _, name = known.rpartition('.')
    part: Any = attrgetter(owner)(drive)
    per = part.friction_torque_per_ampere * getattr(part, 'gear_ratio', 1.0)
    named = {known: getattr(part, name) + change / (per if name == 'coulomb_torque' else 1.0)}
    first, last = np.broadcast_to(values, 2)
    table = np.linspace(first, last, LAW_PLACES)
    learnt = changed(drive, {
        path: tuple(table.tolist()), f'{path}_reach': span,
        f'{path.rpartition(".")[0]}.learnt': 1.0})
    healthy, want, found = (simulate(item, 3.0) for item in (
        drive, changed(drive, named), learnt))
    for name in ('motor_1/ammeter', 'plant/encoder'):
        moved = np.abs(want[name] - healthy[name]).max()
        assert moved > 0.0
        np.testing.assert_allclose(found[name], want[name], atol=1e-6 * moved, rtol=0.0)
