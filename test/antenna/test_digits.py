# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The digits of a reading, told by the reading itself, and steps short enough for a wave."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
import math

from antenna_drive.diagnosis.excitation import Bias, Longest, schedule, SheetCommand
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import planned
from antenna_drive.diagnosis.sensors import digit_of
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import AT, SIGNALS
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import Square, TestSheet
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from simgap.machine.contract import FloatArray

WAVEFORM = Square(0.05, 3.0, 0.25)
SHEET = TestSheet(waveform=WAVEFORM, parameter_tolerance=0.02)


@settings(max_examples=60, deadline=None)
@given(digit=st.floats(1e-7, 1e-3), shift=st.floats(-1.0, 1.0), seed=st.integers(0, 999),
       largest=st.integers(1, 30))
def test_digit_of_rounded_readings_is_found(digit: float, shift: float, seed: int,
                                            largest: int) -> None:
    """Walks in whole digits tell the digit, where single digits are among them."""
    walk = np.random.default_rng(seed).integers(-largest, largest + 1, 400)
    readings = digit * np.cumsum(np.r_[0, walk]) + shift
    readings[::37] = np.nan
    changes = np.abs(np.diff(np.cumsum(np.r_[0, walk])[np.isfinite(readings)]))
    least = np.gcd.reduce(changes)
    if least in changes:
        assert digit_of(readings) == pytest.approx(least * digit, rel=1e-4)


def test_reading_with_noise_behind_its_digits_has_none() -> None:
    """Noise behind the quantiser leaves no lattice; too few changes tell nothing."""
    random = np.random.default_rng(5)
    steps: FloatArray = 1e-4 * np.cumsum(random.integers(-2, 3, 500)).astype(float)
    assert digit_of(steps) == pytest.approx(1e-4, rel=1e-9)
    noise: FloatArray = random.normal(0.0, 5e-5, steps.size)
    assert digit_of(np.asarray(steps + noise)) == 0.0
    assert digit_of(np.r_[np.zeros(50), np.full(50, 1e-4)]) == 0.0


def recorded(drive: Drive, digit: float, rounding: Callable[[FloatArray], FloatArray],
             ) -> Recording:
    """Return a square wave as the model itself would show it, through an encoder of digits."""
    sheet = SHEET
    time = np.arange(601) / 100.0
    signals = {'test_signal/rate_command': SheetCommand(WAVEFORM)(time)}
    signals.update({name: np.zeros(time.size) for name in SIGNALS})
    model = AntennaMachine({'a': Recording.from_arrays(time, signals, sheet=sheet)}, drive, 1)
    shown, when = readings_of(model, {}), model.experiments[0].time
    signals.update({name: np.interp(time, when, shown[:, c])
                    for c, name in enumerate(SIGNALS)})
    signals['plant/encoder'] = digit * rounding(signals['plant/encoder'] / digit)
    return Recording.from_arrays(time, signals, sheet=sheet)


def readings_of(model: AntennaMachine, point: Mapping[str, float]) -> FloatArray:
    """Return what the sensors of the one test would have shown."""
    shown = model.simulate([point])[0][0]
    assert shown is not None
    return shown


@pytest.mark.parametrize(('rounding', 'turn'), [(np.floor, 0.5), (np.round, 0.0),
                                                (np.ceil, -0.5)])
def test_angle_within_the_digit_that_was_read_is_no_residual(
        rounding: Callable[[FloatArray], FloatArray], turn: float) -> None:
    """An encoder of coarse digits is no gap once they are known, wherever it rounds."""
    drive, digit = load(), 2e-4
    model = AntennaMachine({'a': recorded(drive, digit, rounding)}, drive, 1)
    step, edge = model.catalogue['encoder.quantisation'].forms[0].parameters
    assert step.high == pytest.approx(digit, rel=1e-6)
    measured = model.experiments[0].measured[:, AT['encoder']]
    plain = readings_of(model, {})[:, AT['encoder']]
    assert np.abs(measured - plain).max() > 0.4 * digit
    known = readings_of(model, {step.name: digit, edge.name: turn})[:, AT['encoder']]
    assert np.abs(measured - known).max() < 1e-9


def test_planned_test_is_read_in_the_digits_that_were_seen() -> None:
    """A verdict that saw digits leads to a next test, whose readings are whole digits."""
    drive, digit = load(), 2e-4
    seen = AntennaMachine({'a': recorded(drive, digit, np.floor)}, drive, 1)
    [form] = seen.catalogue['encoder.quantisation'].forms
    next_test = AntennaMachine({'b': planned(replace(SHEET, waveform=Square(0.1, 4.0, 0.0)),
                                             5.0, 100.0)}, drive, 1)
    own = next_test.catalogue.form_named(next_test.catalogue['encoder.quantisation'], form.name)
    assert {p.name for p in own.parameters} <= {p.name for p in form.parameters}
    read = readings_of(next_test, {own.parameters[0].name: digit})[:, AT['encoder']]
    assert np.ptp(read) > 10 * digit, 'it moves'
    assert np.abs(read / digit - np.round(read / digit)).max() < 1e-6


def test_fine_encoder_has_the_digits_of_its_sheet() -> None:
    """Digits that the sheet gives are no effect."""
    drive = load()
    model = AntennaMachine({'a': recorded(drive, 2.0 * math.pi / 2 ** 21, np.floor)}, drive, 1)
    assert [p.name for p in model.catalogue['encoder.quantisation'].forms[0].parameters] == [
        'encoder.quantisation.step']
    assert model.catalogue['encoder.quantisation'].forms[0].parameters[0].high > 1e-3


def test_steps_are_short_where_a_wave_turns_fast() -> None:
    """No step lets a wave turn further than it may, and slow motion keeps its long steps."""
    command = SheetCommand(Square(0.5, 4.0, 0.0))
    time = np.linspace(0.0, 4.0, 401)
    longest = Longest(2.5e-3, 1e-4, 0.7, 200000.0)
    fine = schedule(command, Bias(), time, longest)
    rate = math.radians(0.5)
    assert fine.steps[:, 0].max() * rate * 200000.0 <= 0.7 * 1.0001
    assert schedule(command, Bias(), time, Longest(2.5e-3)).steps.shape[0] == 1600
    assert schedule(command, Bias(), time, replace(longest, cycles=100.0)).steps.shape[0] == 1600
    assert fine.steps[:, 0].sum() == pytest.approx(4.0)
