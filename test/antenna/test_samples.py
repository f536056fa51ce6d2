# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Spikes of one sample are found; nothing that the drive itself does passes for one."""

from __future__ import annotations

from antenna_drive.diagnosis.field_recording import FieldRecording
from antenna_drive.diagnosis.sensors import slips, spikes
from antenna_drive.parameters import load
from antenna_drive.readings import SIGNALS
from antenna_drive.recording.recording import Recording
from field_runs import field_run, SLOW_SQUARE
from hypothesis import given, strategies as st
import numpy as np
import pytest


@pytest.mark.parametrize('config', ['old_circuit', 'new_circuit'])
@pytest.mark.parametrize('every', [1, 3, 10, 20])
@pytest.mark.parametrize('noise', [0.0, 1.0])
def test_a_square_wave_of_the_drive_has_no_spikes(config: str, every: int, noise: float) -> None:
    """Impacts of teeth, stick-slip and saturation at 1000 to 50 samples a second."""
    run = field_run(load(config), 25.0, every=every, noise=noise, **SLOW_SQUARE)
    assert {name: np.count_nonzero(spikes(run[name].values)) for name in run} == dict.fromkeys(
        run, 0)


@given(st.lists(st.integers(1, 180).map(lambda i: 11 * i), min_size=1, max_size=6, unique=True),
       st.floats(20.0, 200.0), st.sampled_from([-1.0, 1.0]), st.integers(0, 2**32 - 1))
def test_spikes_are_found_and_nothing_else(places: list[int], size: float, sign: float,
                                           seed: int) -> None:
    time = 0.01 * np.arange(2000)
    values = np.sin(0.3 * time) + 0.01 * np.random.default_rng(seed).normal(size=time.size)
    values[places] += sign * 0.01 * size
    found = np.flatnonzero(spikes(values))
    assert sorted(places) == found.tolist()


@given(st.integers(100, 1900), st.floats(-1e3, 1e3).filter(lambda size: abs(size) > 1e-3))
def test_an_edge_is_never_cut(place: int, size: float) -> None:
    for values in (np.where(np.arange(2000) < place, 0.0, size),
                   size * np.clip((np.arange(2000) - place) / 1.5, 0.0, 1.0)):
        noisy = values + 1e-3 * np.random.default_rng(1).normal(size=2000)
        assert not spikes(values).any()
        assert not spikes(noisy)[place - 4:place + 5].any()


def test_a_pulse_of_two_samples_is_left_to_the_diagnosis() -> None:
    values = 0.01 * np.random.default_rng(2).normal(size=1000)
    values[500:502] += 1.0
    assert not spikes(values).any()


def test_a_recording_without_its_spikes_keeps_every_other_sample() -> None:
    plain = field_run(load('new_circuit'), 20.0, **SLOW_SQUARE)
    current = plain['motor_1/ammeter']
    values = current.values.copy()
    values[[700, 1500, 3001]] += [3.0, -2.0, 1.0]
    spiked = Recording.from_arrays(current.time_s, {
        **{name: plain[name].values for name in plain}, 'motor_1/ammeter': values})
    notes: list[str] = []
    clean = FieldRecording.of('rec', spiked, notes.append)
    assert 'rec: spikes of one sample were left out: motor_1/ammeter 3' in notes
    time = plain['motor_1/ammeter'].time_s
    measured, slope = clean.measured(time)
    expected = np.column_stack([plain[name].values for name in SIGNALS])
    expected[[700, 1500, 3001], 0] = np.nan
    np.testing.assert_array_equal(measured, expected)
    assert np.nanmax(np.abs(slope[1:-1, 0])) <= np.abs(np.gradient(current.values, time)).max()


def test_missing_rows_are_counted() -> None:
    plain = field_run(load('new_circuit'), 20.0, **SLOW_SQUARE)
    kept = np.ones(len(plain['plant/encoder']), bool)
    kept[1000:1007] = kept[2500] = False
    time = plain['plant/encoder'].time_s
    notes: list[str] = []
    FieldRecording.of('rec', Recording.from_arrays(time[kept], {
        name: plain[name].values[kept] for name in plain}), notes.append)
    assert f'rec: 8 of {time.size} rows are missing' in notes


def test_a_slip_of_a_motor_at_rest_is_found_and_a_drive_that_hunts_is_not_at_rest() -> None:
    random = np.random.default_rng(3)
    rates = random.normal(0.0, 0.003, 200)
    rates[60:75] += np.linspace(0.0, 0.05, 15)
    found = slips(rates, 0.003)
    assert found[70:75].all()
    assert not found[:60].any() and not found[75:].any()
    hunting = rates + 0.05 * np.sin(np.arange(200.0))
    assert not slips(hunting, 0.003).any()
    assert not slips(np.full(9, np.nan), 0.003).any()
