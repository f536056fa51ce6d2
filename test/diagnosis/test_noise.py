# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The noise that a recording shows, against processes whose levels and colours are known."""

from __future__ import annotations

from dataclasses import replace
import json
import math

from hypothesis import given, strategies as st
import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular, toeplitz
from scipy.signal import lfilter
from simgap.fit.noise import (
    estimated, found_noise, Process, whitened, with_estimated_noise, with_found_noise,
    with_model_error,
)
from simgap.machine.contract import Colour, Experiment, FloatArray
from simgap.settings import DEFAULT

SETTINGS = DEFAULT.noise
INTERVAL_S = 1.0 / 70.0


def pole(corner_hz: float) -> float:
    return math.exp(-2.0 * math.pi * corner_hz * INTERVAL_S)


def drawn(process: Process, count: int, seed: int = 0) -> FloatArray:
    random = np.random.default_rng(seed)
    drive = math.sqrt(process.slow * (1.0 - process.pole ** 2))
    slow = lfilter([drive], [1.0, -process.pole], random.normal(size=count + 500))[500:]
    return np.asarray(slow + math.sqrt(process.white) * random.normal(size=count))


@pytest.mark.parametrize('process', [
    Process(1.0, 0.0, 0.0), Process(1.3, 5.0, pole(0.6)), Process(0.3, 0.5, pole(5.0)),
    Process(4.0, 2.0, pole(20.0))])
def test_level_and_colour_are_found(process: Process) -> None:
    found = estimated([drawn(process, 20000)], INTERVAL_S, 9.0, SETTINGS)
    assert found.white == pytest.approx(process.white, rel=0.25, abs=0.05)
    assert found.white + found.slow == pytest.approx(process.white + process.slow, rel=0.25)
    innovations = whitened(drawn(process, 20000, seed=1), found.colour)
    assert np.std(innovations) == pytest.approx(1.0, abs=0.05)
    for lag in (1, 2, 5, 20):
        assert np.mean(innovations[lag:] * innovations[:-lag]) == pytest.approx(0.0, abs=0.06)


def test_the_filter_is_the_cholesky_factor_of_the_covariance() -> None:
    """Whitening by the steady filter is what the inverse factor of the covariance does."""
    process, count = Process(0.8, 3.0, 0.9), 400
    covariance = toeplitz(process.slow * process.pole ** np.arange(count))
    covariance += process.white * np.eye(count)
    z = drawn(process, count)
    exact = solve_triangular(cholesky(covariance, lower=True), z, lower=True)
    assert whitened(z, process.colour)[60:] == pytest.approx(exact[60:], abs=1e-6)


def test_gaps_and_spikes_change_nothing_far_away() -> None:
    process = Process(1.0, 4.0, pole(1.0))
    z = drawn(process, 20000)
    clean = estimated([z], INTERVAL_S, 9.0, SETTINGS)
    spoilt, random = z.copy(), np.random.default_rng(3)
    spoilt[random.integers(0, z.size, 20)] += 200.0
    spoilt[random.integers(0, z.size, 200)] = np.nan
    found = estimated([spoilt], INTERVAL_S, 9.0, SETTINGS)
    assert found.white == pytest.approx(clean.white, rel=0.2)
    assert found.slow == pytest.approx(clean.slow, rel=0.3)
    assert np.isnan(whitened(spoilt, found.colour)).sum() == np.isnan(spoilt).sum()


def test_what_is_louder_than_noise_may_be_is_no_noise() -> None:
    """A misfit stays a misfit: both levels are bounded."""
    found = estimated([drawn(Process(400.0, 900.0, pole(1.0)), 5000)], INTERVAL_S, 2.0, SETTINGS)
    assert found.white == SETTINGS.greatest_level ** 2
    assert found.slow == 2.0


def test_too_few_samples_tell_no_noise() -> None:
    z = drawn(Process(4.0, 0.0, 0.0), SETTINGS.least_samples - 1)
    assert estimated([z], INTERVAL_S, 9.0, SETTINGS) == Process(1.0, 0.0, 0.0)


def experiment(measured: FloatArray) -> Experiment:
    shape = (measured.size, 2)
    time = np.asarray(INTERVAL_S * np.arange(measured.size), np.float64)
    return Experiment('test', time, ('rate', 'angle'),
                      ('rad/s', 'rad'), np.stack([measured, measured], axis=1),
                      np.full(shape, 0.5), quantised=('angle',))


def test_noise_of_an_experiment_is_taken_by_channel() -> None:
    z = drawn(Process(4.0, 0.0, 0.0), 5000)
    item = experiment(np.zeros(5000))
    residual = np.stack([0.5 * z, 0.5 * z], axis=1)
    [found] = with_estimated_noise([item], [residual], SETTINGS)
    assert found.colours[0].level == pytest.approx(2.0, rel=0.05)
    assert found.colours[1] == Colour(), 'a quantised reading has no noise of its own'


@given(st.floats(0.1, 10.0), st.floats(0.01, 10.0), st.floats(0.0, 0.99))
def test_a_process_is_known_from_its_colour(white: float, slow: float, pole: float) -> None:
    process = Process(white, slow if pole else 0.0, pole)
    back = Process.of(process.colour)
    assert back.white == pytest.approx(process.white, rel=1e-6)
    assert back.slow == pytest.approx(process.slow, rel=1e-6, abs=1e-9)


def test_a_planned_test_has_the_noise_that_others_have_shown() -> None:
    """At another sample rate, the slow part has the same variance and the same corner."""
    random = np.random.default_rng(5)
    size, pole = 200_000, math.exp(-2.0 * math.pi * 2.0 / 500.0)
    slow = lfilter([math.sqrt(1.0 - pole ** 2)], [1.0, -pole], random.normal(size=size))
    item = replace(experiment(np.zeros(size)), time=np.arange(size) / 500.0)
    noise = 0.5 * (1.5 * random.normal(size=size) + slow)
    [shown] = with_estimated_noise([item], [np.stack([noise, noise], axis=1)], SETTINGS)
    found = json.loads(json.dumps(found_noise([shown])))
    first = item.channels[0]
    assert found[first]['white'] == pytest.approx(1.5 ** 2, rel=0.05)
    assert found[first]['slow'] == pytest.approx(1.0, rel=0.2)
    assert 1.0 < found[first]['corner_hz'] < 4.0
    other = replace(experiment(np.zeros(1000)), time=np.arange(1000) / 100.0)
    [planned] = with_model_error(with_found_noise([other], found), SETTINGS)
    process = Process.of(planned.colours[0])
    assert process.white == pytest.approx(found[first]['white'])
    assert process.slow == pytest.approx(found[first]['slow'])
    assert process.pole == pytest.approx(math.exp(
        -2.0 * math.pi * found[first]['corner_hz'] / 100.0))
    # a signal of which nothing is known has the noise of its sensor
    [stated] = with_model_error(with_found_noise([other], {}), SETTINGS)
    assert Process.of(stated.colours[0]).white == pytest.approx(1.0)


def test_a_models_error_does_not_vanish_with_the_sampling_rate() -> None:
    """Sampled ten times as often, a slow signal tells hardly more of a model that is wrong."""
    def information(rate: float) -> float:
        time = np.arange(0.0, 30.0, 1.0 / rate)
        motion = 100.0 * np.sin(2.0 * np.pi * time / 10.0)
        item = replace(experiment(motion), time=time)
        [planned] = with_model_error([item], SETTINGS)
        return float(np.sum(whitened(motion / 0.5, planned.colours[0]) ** 2))

    def plain(rate: float) -> float:
        time = np.arange(0.0, 30.0, 1.0 / rate)
        return float(np.sum((200.0 * np.sin(2.0 * np.pi * time / 10.0)) ** 2))

    assert plain(700.0) / plain(70.0) == pytest.approx(10.0, rel=0.01)
    assert information(700.0) / information(70.0) < 2.0
