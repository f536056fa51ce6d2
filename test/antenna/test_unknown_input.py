# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where something that no effect names has entered, told from what it does to the readings."""

from __future__ import annotations

import math

from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import BUILT_IN, planned
from antenna_drive.parameters import load
from antenna_drive.readings import SIGNALS
from antenna_drive.recording.recording import Recording
import numpy as np
import pytest
from scipy import optimize, stats
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import FloatArray
from simgap.machine.everyday import with_everyday
from simgap.settings import DEFAULT
from simgap.verdict.input_evidence import InputEvidence
from simgap.verdict.unknown_input import components, places

NOISE = np.array([0.01, 0.01, 0.0035, 0.0035, 1.5e-6, 0.01])


def disturbed(place_name: str, strength: float, seed: int, fastest: float = 1.5) -> AntennaMachine:
    """Return a model against a drive that something of a wild course [Hz] has entered."""
    test = planned(BUILT_IN['square'], 12.0, 70.0)
    model = AntennaMachine({'square': test}, load(), threads=1)
    random = np.random.default_rng(seed)
    frequencies, phases = random.uniform(0.13 * fastest, fastest, 5), random.uniform(0.0, 6.3, 5)

    def course(time: FloatArray) -> FloatArray:
        waves = np.sin(2.0 * np.pi * np.multiply.outer(time, frequencies) + phases)
        return np.asarray(strength * waves.sum(axis=-1))

    place = next(e for e in model.disturbance_inputs if e.name == place_name)
    readings = model.simulate_disturbed({}, place, [course])[0]
    readings = readings + NOISE * random.normal(size=readings.shape)
    time = model.experiments[0].time
    command = test['test_signal/rate_command']
    signals = {'test_signal/rate_command': np.interp(time, command.time_s, command.values)}
    signals.update({name: readings[:, c] for c, name in enumerate(SIGNALS)})
    recording = Recording.from_arrays(time, signals, sheet=test.sheet)
    return AntennaMachine({'square': recording}, load(), threads=1)


@pytest.mark.parametrize(('name', 'strength', 'component'), [
    ('torque on the axis', 0.4, 'axis'), ('friction of motor 2', 0.4, 'motor_2'),
    ('voltage in amplifier 1', 0.4, 'motor_1'), ('reading of tachometer 2', 3.0, 'tach_2'),
])
@pytest.mark.slow
def test_part_that_something_unknown_enters_is_told(name: str, strength: float,
                                                    component: str) -> None:
    """The input is no pulse, and its answer is not linear: the part is found all the same."""
    told = 0
    for seed in (3, 4, 5, 6):
        found = places(LeastSquares(disturbed(name, strength, seed=seed)), {})
        shares = components(found, DEFAULT.localisation.caution)
        assert sum(shares.values()) == pytest.approx(1.0)
        assert found[0].evidence > 100.0 and 2.0 * DEFAULT.verdict.left < found[0].explained <= 1.0
        # an amplifier's voltage and its tachometer's reading look alike
        told += shares[component] > 0.3 * max(shares.values())
    # where the drive sticks, no sum of answers tells the part
    assert told >= 3


@pytest.mark.parametrize('seed', [3, 4, 5])
@pytest.mark.slow
def test_a_displacement_of_teeth_is_as_likely_as_a_reading_that_it_resembles(seed: int) -> None:
    """Through the rate loop both look alike: which is the first is a matter of the noise."""
    found = places(LeastSquares(disturbed('displacement in gearbox 1', 3.0, seed=seed)), {})
    evidence = {place.component: place.evidence for place in reversed(found)}
    assert evidence['gearbox_1'] > 0.9 * found[0].evidence
    assert evidence.get('axis', 0.0) < 0.9 * found[0].evidence


def test_noise_alone_enters_nowhere() -> None:
    """Where nothing has entered, no place has evidence worth the name."""
    found = places(LeastSquares(disturbed('torque on the axis', 0.0, seed=4)), {})
    assert found[0].evidence < 20.0


@pytest.mark.slow
def test_a_wind_of_every_day_is_nothing_unknown() -> None:
    """A slow torque of half the everyday size would be something on a day without wind."""
    machine = disturbed('torque on the axis', 0.03, seed=3, fastest=0.3)
    [daily] = (place for place in machine.disturbance_inputs if place.everyday)
    assert 0.03 * math.sqrt(2.5) < 0.5 * daily.everyday
    left = [max(place.explained for place in places(LeastSquares(item), {}))
            for item in (machine, with_everyday(machine))]
    assert left[0] > 2.0 * DEFAULT.verdict.left and left[1] < 0.5 * left[0]


def test_evidence_is_that_of_a_normal_distribution() -> None:
    """The marginal likelihood agrees with scipy's density of the whole vector."""
    random = np.random.default_rng(1)
    columns = random.normal(size=(40, 6))
    residual = columns @ random.normal(size=6) * 1.5 + random.normal(size=40)
    inputs = InputEvidence(residual, 1.0, np.ones(40), np.zeros((40, 1)), np.ones(1))

    evidence, *_ = inputs.of_course(*inputs.reduced([columns]), [6])

    def worst(size: FloatArray) -> float:
        spread = np.exp(size[0]) * (np.eye(40) + np.exp(size[1]) * columns @ columns.T)
        return -float(stats.multivariate_normal.logpdf(residual, np.zeros(40), spread))

    best = -float(optimize.minimize(worst, [0.0, 0.0], method='Nelder-Mead').fun)
    plain = float(np.sum(stats.norm.logpdf(residual, 0.0, np.sqrt(np.mean(residual ** 2)))))
    # the strength is tried on a grid, whose steps are worth little
    assert evidence == pytest.approx(best - plain, abs=0.3)
