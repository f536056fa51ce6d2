# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Which waves a residual holds, and how the noise is set while something strong is missing."""

from __future__ import annotations

from antenna_drive.diagnosis.catalogue import catalogue
from antenna_drive.diagnosis.waves import likely_orders, Wave
from antenna_drive.physics.harmonics import wave
from antenna_drive.readings import AT, READINGS, SIGNALS
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from simgap.machine.contract import Experiment


def experiment(seed: int) -> Experiment:
    """Return a test in which the motors turn to and fro at up to three turns a second."""
    time = np.arange(0.0, 20.0, 0.015)
    random = np.random.default_rng(seed)
    measured = np.zeros((time.size, len(SIGNALS)))
    for c in (AT['tach_1'], AT['tach_2']):
        measured[:, c] = 18.0 * np.sin(0.9 * time) + 1e-3 * random.normal(size=time.size)
    return Experiment('a', time, tuple(AT), tuple(reading.unit for reading in READINGS), measured,
                      np.ones_like(measured))


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 30), st.integers(0, 10 ** 6))
def test_planted_wave_is_found_beneath_a_slow_misfit_that_is_louder(order: int,
                                                                    seed: int) -> None:
    test = experiment(seed)
    form = catalogue()['motor_1.torque_ripple'].forms[0]
    assert isinstance(form, Wave)
    rate = test.measured[:, AT['tach_1']]
    angle = np.r_[0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(test.time))]
    residual = np.random.default_rng(seed).normal(size=test.measured.shape)
    residual[:, AT['current_1']] += 2.0 * np.sin(order * angle + 0.3) + 6.0 * np.sign(rate)
    assert float(order) in likely_orders(form, [test], [residual], 3)


@given(st.lists(st.floats(-1e-3, 1e-3), min_size=7, max_size=7), st.floats(-0.5, 0.5),
       st.floats(-3.0, 3.0))
def test_wave_of_readings_is_that_of_the_physics(
        parts: list[float], angle: float, turned: float) -> None:
    """Sine and cosine parts on readings say what the fields of the record say to the physics."""
    form = catalogue()['encoder.cyclic_error'].forms[0]
    assert isinstance(form, Wave)
    form = form.at(700.0)
    value = form.shape.fields(parts, turned)
    assert form.shape.along(np.array([turned + angle]), parts)[0] == pytest.approx(wave(
        angle, value[''], value['_second'], value['_third'], value['_cycles'], value['_phase'],
        value['_second_phase'], value['_third_phase']), abs=1e-12)
