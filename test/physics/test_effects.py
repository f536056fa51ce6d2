# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a motor and its amplifier may have beyond the article, against closed forms."""

from dataclasses import replace
import math

from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
from antenna_drive.physics.amplifier import armature_voltage
from antenna_drive.physics.armature import current_rate
from antenna_drive.physics.gearbox import gear_torque, presliding_rate
from antenna_drive.physics.harmonics import wave, wave_slope
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

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
