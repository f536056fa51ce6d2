# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""T5: the static profile's corners by hand, and the loaded axis against Eq. (14)."""

from __future__ import annotations

from antenna_drive.article import loaded_axis
from antenna_drive.article.static_profile import (
    as_in_the_text, bias_voltage, corners, NEW_GAIN, TEXT_GAIN,
)
from antenna_drive.parameters import load
import numpy as np
import pytest


@pytest.mark.parametrize(('circuit', 'gain', 'dc_gain'), [
    ('old_circuit', TEXT_GAIN, 3.502 / 1.093), ('new_circuit', NEW_GAIN, 2.114 / 0.8895)])
@pytest.mark.parametrize('fade_out', [-7.0, -9.0, -11.0])
def test_corners_are_those_of_equation_14(circuit: str, gain: float, dc_gain: float,
                                          fade_out: float) -> None:
    share = as_in_the_text(load(circuit).torque_share.circuit, gain, fade_out)
    found = corners(share)
    assert found.flat_A == pytest.approx((-fade_out - 13.0 / dc_gain) / gain, rel=1e-6)
    assert found.zero_A == pytest.approx(-fade_out / gain, rel=1e-6)


def test_the_profile_is_even_and_bounded() -> None:
    share = load('old_circuit').torque_share.circuit
    current = np.linspace(-10.0, 10.0, 401)
    volts = bias_voltage(share, current)
    assert volts == pytest.approx(volts[::-1])
    assert volts.min() == 0.0
    assert volts.max() == pytest.approx(0.7 * 13.0)


def test_equation_14_alone_splits_the_load_between_the_motors() -> None:
    load_percent = np.array([-90.0, 0.0, 90.0])
    torques = loaded_axis.by_equation_14(load('old_circuit'), 0.2, load_percent)
    assert torques.mean(axis=1) == pytest.approx(load_percent)
    assert torques[:, 1] - torques[:, 0] == pytest.approx([0.0, 20.0, 0.0])


def test_a_fade_out_is_found_through_swings_of_the_currents() -> None:
    load_percent = np.linspace(-90.0, 90.0, 18001)
    # 20 percent up to a load of 30, then a straight line to nothing at 70
    bias = 20.0 * np.clip((70.0 - np.abs(load_percent)) / 40.0, 0.0, 1.0)
    bias[::7] += 15.0
    # nine tenths are left at 34, one tenth at 66; the medians are of one percent of load each
    assert loaded_axis.fade_out(load_percent, bias) == pytest.approx((34.0, 66.0), abs=1.0)


@pytest.mark.trial
@pytest.mark.parametrize('circuit', ['old_circuit', 'new_circuit'])
@pytest.mark.parametrize('share', loaded_axis.SHARES)
def test_the_loaded_axis_keeps_the_bias_and_carries_the_load(circuit: str, share: float) -> None:
    drive = load(circuit)
    loop = loaded_axis.loaded(drive, circuit, share)
    assert loaded_axis.bias_at_rest(loop) == pytest.approx(100.0 * share, rel=0.03)
    # the motors carry the load except for friction: at rest at most the stiction of the axis and
    # of both motors, as a share of the greatest torque
    axis, motor = drive.plant.axis, drive.motor_1.motor
    friction = (axis.stiction_ratio * axis.coulomb_torque
                + 2.0 * motor.stiction_ratio * motor.coulomb_torque) / (2.0 * motor.current_limit)
    # an axis that breaks away overshoots for a moment
    missing = np.abs(loop.drive - loop.load) / 100.0
    assert np.quantile(missing, 0.98) <= friction
    # friction is the only difference: rising and falling differ by about twice the Coulomb torque
    up = np.interp(0.0, loop.load[loop.rising], loop.drive[loop.rising])
    down = np.interp(0.0, -loop.load[~loop.rising], loop.drive[~loop.rising])
    assert down - up > axis.coulomb_torque / motor.current_limit * 50.0
