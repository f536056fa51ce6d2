# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A wild trial: its imperfections are what they claim to be, and its files are what they were."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any

from antenna_drive.recording.files import read_recording
from antenna_drive.recording.sheet import parse_sheet, Sensors, TestSheet
from hypothesis import given, settings, strategies as st
from lab.antenna import imperfections, waveform
from lab.antenna.cases import build_machine, draw_truths
from lab.antenna.detectability import PERFECT
from lab.antenna.family import FAMILIES
from lab.antenna.machine import FILTER_1, nominal, reference_machine
from lab.antenna.real_antenna import simulate
from lab.antenna.sensors import record
from lab.antenna.sheet import CaseSheet
from lab.antenna.wild_programme import (
    draw_programme, LONGEST_S, MOST_SAMPLES, RATE_HZ, RECORDINGS, SHORTEST_S,
)
from lab.trials import batch, sealing
import numpy as np
from numpy.typing import NDArray
import pytest
from scipy.signal import welch

SEEDS = st.integers(0, 2**32 - 1)
FASTEST_DEG_S = 0.69
COUNT = 4


@pytest.fixture(scope='module', params=['a', 'b'])
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small wild trial with all recordings."""
    folder = tmp_path_factory.mktemp('wild') / request.param
    manifest = batch.prepare(folder, COUNT, 3, 0.02, 200.0, 30.0, wild=True,
                             family=request.param)
    batch.make_cases(folder, manifest, jobs=1)
    return folder


def truth_of(folder: Path, case: str) -> dict[str, Any]:
    """Return the truth of a case."""
    truth: dict[str, Any] = json.loads((folder / 'truth' / f'{case}.json').read_text())
    return truth


@pytest.mark.slow
def test_every_recording_can_be_read_and_has_the_rows_that_its_truth_leaves(made: Path) -> None:
    for k in range(1, COUNT + 1):
        case = f'case_{k:04d}'
        truth = truth_of(made, case)
        paths = [*sorted((made / case).glob('*.csv')), made / 'kept' / case / 'rec_d.csv']
        assert [path.stem for path in paths] == list(RECORDINGS)
        for path, duration, sheet in zip(paths, truth['durations_s'], truth['given_sheets'],
                                         strict=True):
            recording = read_recording(path)
            samples = round(truth['sample_rate_hz'] * duration) + 1
            missing = round(truth['imperfections']['missing_share'] * samples)
            for channel in recording.channels.values():
                assert len(channel) == samples - missing
            assert path.with_suffix('.yaml').exists() == (sheet is not None)
            assert recording.sheet == (parse_sheet(sheet) if sheet else TestSheet())


def test_seal_covers_imperfections_and_sheets(made: Path, tmp_path: Path) -> None:
    manifest = json.loads((made / 'manifest.json').read_text())
    truth = truth_of(made, 'case_0001')
    text = json.dumps(truth, sort_keys=True, separators=(',', ':'))
    assert hashlib.sha256(text.encode()).hexdigest() == manifest['seals']['case_0001']
    (tmp_path / 'truth').mkdir()
    changes: list[dict[str, Any]] = [
        {'imperfections': {**truth['imperfections'], 'clock_ppm': 0.0}},
        {'given_sheets': []}, {'durations_s': []}, {'family': 'c'}]
    for change in changes:
        (tmp_path / 'truth' / 'case_0001.json').write_text(json.dumps({**truth, **change}))
        with pytest.raises(sealing.SealError, match='not the truth'):
            sealing.open_truth(tmp_path, 'case_0001', manifest)


def test_case_follows_from_its_truth(made: Path, tmp_path: Path) -> None:
    batch.make_case(tmp_path, truth_of(made, 'case_0002'))
    batch.make_case(tmp_path, truth_of(made, 'case_0002'))      # over what is there
    for path in (*made.glob('case_0002/*'), *made.glob('kept/case_0002/*')):
        assert (tmp_path / path.relative_to(made)).read_bytes() == path.read_bytes()


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.sampled_from(sorted(FAMILIES)), st.sampled_from([SHORTEST_S, 30.0, LONGEST_S]))
def test_programme_is_of_four_kinds_within_its_limits(
        seed: int, family: str, longest: float) -> None:
    drawn = draw_programme(FAMILIES[family].shapes, 0.02, longest, np.random.default_rng(seed))
    assert RATE_HZ[0] <= drawn.sample_rate_hz <= RATE_HZ[1]
    assert len(drawn.sheets) == len(drawn.durations_s) == len(RECORDINGS)
    for duration, sheet, said in zip(drawn.durations_s, drawn.sheets, drawn.given):
        assert SHORTEST_S <= duration <= longest
        assert duration * drawn.sample_rate_hz <= 1.01 * MOST_SAMPLES
        test = sheet.record()
        end = duration + 1.0 / drawn.sample_rate_hz
        corners = waveform.corners(test[0], end)
        assert np.all(np.diff(corners) > 0.0)
        bounds = np.concatenate(([0.0], corners, [end]))
        middles = 0.5 * (bounds[1:] + bounds[:-1])
        rates = [math.degrees(waveform.command(test[0], t, t)) for t in middles]
        assert max(np.abs(rates)) <= FASTEST_DEG_S
        assert any(rates) or sheet.waveform['type'] in ('multisine', 'chirp')
        # no programme ends earlier than its longest pause before the recording does
        if sheet.waveform['type'] == 'knots':
            assert duration - sheet.waveform['times_s'][-1] < 2.001
        if said is not None:
            assert isinstance(parse_sheet(said), TestSheet)
            assert ('waveform' in said) == (
                parse_sheet(said).waveform is not None)
    sensors = {said is not None and 'sensors' in said for said in drawn.given[:3]}
    assert len(sensors) == 1


def test_knots_are_straight_lines_and_jumps() -> None:
    sheet = CaseSheet('old', 'old', {'type': 'circuit'}, {
        'type': 'knots', 'times_s': [1.0, 2.0, 2.0, 5.0, 6.0],
        'rates_deg_s': [0.1, 0.1, -0.2, 0.4, 0.0]})
    test = sheet.record()[0]
    for t in np.arange(0.05, 7.0, 0.1):
        branch = [1.0, 2.0] if t < 2.0 else [2.0, 5.0, 6.0]
        rates = [0.1, 0.1] if t < 2.0 else [-0.2, 0.4, 0.0]
        expected = np.interp(t, branch, rates, left=0.0, right=0.0)
        assert math.degrees(waveform.command(test, t, t)) == pytest.approx(expected, abs=1e-12)
    assert waveform.corners(test, 5.5).tolist() == [1.0, 2.0, 5.0]


@pytest.mark.parametrize('kind', ['square', 'triangle'])
def test_a_rest_only_shifts_the_command(kind: str) -> None:
    shape = {'type': kind, 'amplitude_deg_s': 0.1, 'period_s': 3.0, 'phase': 0.25}
    at_once, later = (CaseSheet('old', 'old', {'type': 'circuit'}, s).record()[0]
                      for s in (shape, {**shape, 'start_s': 4.0}))
    corners = waveform.corners(later, 20.0)
    assert corners == pytest.approx(np.array(
        [4.0, *(4.0 + waveform.corners(at_once, 16.0))]))
    for t in np.arange(0.013, 16.0, 0.1):
        middle = t      # never a corner
        assert waveform.command(later, t + 4.0, middle + 4.0) == pytest.approx(
            waveform.command(at_once, t, middle), abs=1e-15)
        assert waveform.command(later, 0.25 * t, 0.25 * t) == 0.0 or t >= 16.0


@pytest.mark.parametrize(('share', 'corner'), [(0.0, 5.0), (0.4, 1.0), (0.8, 20.0)])
def test_noise_has_the_colour_and_level_that_are_stated(share: float, corner: float) -> None:
    """Welch's spectrum against the closed one of a first-order autoregression and white noise."""
    rate, count = 200.0, 400_000
    noise = imperfections.coloured(count, rate, share, corner, np.random.default_rng(1))
    assert np.var(noise) == pytest.approx(1.0, rel=0.03)
    frequency, power = welch(noise, rate, nperseg=4096)
    keep = math.exp(-2.0 * math.pi * corner / rate)
    slow = (1.0 - keep**2) / np.abs(1.0 - keep * np.exp(-2j * np.pi * frequency / rate))**2
    expected = (share * slow + 1.0 - share) * 2.0 / rate
    for low, high in ((0.2, 1.0), (1.0, 5.0), (5.0, 25.0), (25.0, 99.0)):
        band = (frequency > low) & (frequency < high)
        assert np.mean(power[band]) == pytest.approx(np.mean(expected[band]), rel=0.08)


def test_recorded_noise_is_as_loud_as_the_truth_says() -> None:
    truth = draw_truths(1, 8, 0.0, wild=True)[0]
    own = truth['imperfections']
    own |= {'missing_share': 0.0, 'spike_share': 0.0}
    sheet = CaseSheet('old', 'old', {'type': 'fixed', 'voltage_V': 0.0}, {})
    # without bias and command the drive stands still, but for what zeros make it creep
    own |= {'tach_zero_rad_s': [0.0, 0.0], 'amplifier_zero_V': [0.0, 0.0]}
    machine = reference_machine()
    imperfections.apply_imperfections(machine, own)
    columns = imperfections.imperfect_recording(machine, sheet, own, 200.0, 100.0,
                                                np.random.default_rng(4))
    for name, noise, digit in (('current_1_A', 0.01, 0.01), ('tach_rate_2_rad_s', 0.0035, 0.002),
                               ('bias_voltage_V', 0.01, 0.01)):
        level = own['noise'][name]['level'] * noise
        assert np.std(columns[name]) == pytest.approx(
            math.hypot(level, digit / math.sqrt(12.0)), rel=0.15)


@settings(max_examples=200)
@given(st.integers(2, 3000), st.floats(0.0, 1.0), SEEDS)
def test_missing_rows_are_counted(count: int, share: float, seed: int) -> None:
    rows = imperfections.kept_rows(count, share, np.random.default_rng(seed))
    assert len(rows) == count - min(round(share * count), count - 2)
    assert np.all(np.diff(rows) > 0)
    assert rows[0] == 0
    assert rows[-1] == count - 1


@settings(max_examples=100)
@given(st.integers(1, 3000), st.floats(0.0, 1.0), SEEDS)
def test_spikes_are_counted(count: int, share: float, seed: int) -> None:
    low, high = imperfections.SPIKE_SIZE
    found = imperfections.spikes(count, share, np.random.default_rng(seed))
    size = np.abs(found[found != 0.0])
    assert len(size) == round(share * count)
    assert np.all((size >= low) & (size <= high))


def steady(machine: Any, sheet: CaseSheet) -> tuple[float, float]:
    """Return current difference [A] and mean motor rate [rad/s] after everything settled."""
    times = np.arange(0.0, 150.0, 0.01)
    history = simulate(machine, sheet, times, (0.5, -0.5))
    late = times > 120.0
    return (float(np.mean((history.current[1] - history.current[0])[late])),
            float(np.mean(history.rate[:, late])))


@pytest.mark.parametrize('kind', ['old', 'new'])
def test_zero_in_the_loop_makes_the_currents_differ_as_the_integrators_demand(kind: str) -> None:
    """
    Check the effect of a tachometer's zero of 0.004 rad/s on a drive at a constant rate.

    Both integrators stand still only if both rate errors are zero: with r = k_t w,
    v_c - r - k_t z - s_F x = 0 and v_c - r + s_F x = 0. So x = -k_t z / (2 s_F) and the rate
    falls by z / 2; x = (k' / p) (v_b - k_f (i_2 - i_1)) gives the currents.
    """
    zero = 0.004
    sheet = CaseSheet(kind, kind, {'type': 'fixed', 'voltage_V': 5.0}, {
        'type': 'knots', 'times_s': [0.0, 3.0, 200.0], 'rates_deg_s': [0.0, 0.1, 0.1]})
    exact, off = reference_machine(kind, kind), reference_machine(kind, kind)
    off.motors['tach_offset'][0] = zero
    (before, rate), (after, slower) = steady(exact, sheet), steady(off, sheet)
    filter_1 = FILTER_1[kind]
    expected = (nominal('motors', 'tach_gain') * zero
                / (2.0 * nominal('circuit', 'counter_torque_gain'))
                / (filter_1['gain'] / filter_1['pole']) / nominal('circuit', 'difference_gain'))
    assert after - before == pytest.approx(expected, rel=0.02)
    assert slower - rate == pytest.approx(-0.5 * zero, rel=0.02)


def lag_by_correlation(first: NDArray[np.float64], second: NDArray[np.float64],
                       step: float) -> float:
    """Return by how much `second` is later, from the peak of the cross-correlation [s]."""
    finer = 64
    window = np.hanning(len(first))
    product = (np.conj(np.fft.rfft(window * (first - np.mean(first))))
               * np.fft.rfft(window * (second - np.mean(second))))
    correlation = np.fft.irfft(product, finer * len(window))
    shift = int(np.argmax(correlation))
    if shift > len(correlation) // 2:
        shift -= len(correlation)
    return shift * step / finer


def test_each_channel_is_late_by_its_own_delay() -> None:
    rate = 200.0
    # fast enough for the bias to move
    sheet = CaseSheet('old', 'old', {'type': 'circuit', 'bias_pot': 0.8, 'start': 'steady'}, {
        'type': 'triangle', 'amplitude_deg_s': 0.6, 'period_s': 6.0})
    machine = reference_machine('old', 'old', 0.8)
    instants = np.arange(0.0, 40.0, 1.0 / rate)
    delays = {name: (0.1 + 0.15 * k) / rate for k, name in enumerate(imperfections.DELAYED)}
    on_time, late = (record(
        imperfections.late_history(machine, sheet, instants, some, (0.1, 0.2)), machine, PERFECT,
        instants, np.random.default_rng(0)) for some in ({}, delays))
    assert np.array_equal(on_time['rate_command_rad_s'], late['rate_command_rad_s'])
    for name, delay in delays.items():
        measured = lag_by_correlation(on_time[name], late[name], 1.0 / rate)
        assert measured == pytest.approx(delay, abs=0.02 / rate)


def test_an_effect_replaces_the_zero_that_is_its_own() -> None:
    truths = [truth for truth in draw_truths(300, 2, 0.02, wild=True)
              if truth['kind'] == 'single' and truth['effects'][0]['id'] == 'tach_1.offset']
    assert truths
    for truth in truths:
        motors = build_machine(truth, 0).motors
        assert motors['tach_offset'][0] == truth['effects'][0]['parameters']['offset']
        assert motors['tach_offset'][1] == truth['imperfections']['tach_zero_rad_s'][1]
        assert motors['input_offset'].tolist() == truth['imperfections']['amplifier_zero_V']


def test_moments_of_effects_lie_within_every_recording() -> None:
    for truth in draw_truths(200, 6, 0.02, wild=True):
        for k, duration in enumerate(truth['durations_s']):
            machine = build_machine(truth, k)
            moments = [machine.structure['ballast_at'][0], *machine.motors['brake_end'],
                       *machine.motors['dropout'].ravel()]
            assert max(moments) < duration


def test_knowledge_of_the_tester_varies() -> None:
    truths = draw_truths(200, 9, 0.02, wild=True)
    sheets = [parse_sheet(truth['given_sheets'][0] or {}) for truth in truths]
    none = sum(not sheet for sheet in sheets)
    whole = sum(isinstance(sheet.sensors, Sensors) for sheet in sheets)
    assert 20 <= none <= 60
    assert 75 <= whole <= 125
    # what is kept back to judge by has its sheet, for the conditions of the test
    assert all(truth['given_sheets'][3]['circuit'] in ('old', 'new') for truth in truths)
