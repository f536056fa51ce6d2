# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What acts every day: its pattern where a machine is linear, and that there is none elsewhere."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from simgap.machine.contract import Course, DisturbanceInput, FloatArray, Machine, Point
from simgap.machine.everyday import with_everyday
from simgap.machine.process import acting, calm, process
from two_lags import answered, TIME, TwoLags

RMS = 0.5
EVERY_DAY = (DisturbanceInput('force on the left', 'left', everyday=RMS),)


class Pushed(TwoLags):
    """Two lags, with a force on the left every day."""

    disturbance_inputs = EVERY_DAY


class Hunting(Pushed):
    """The same, whose left reading is a wave of which a little force decides the phase."""

    def simulate_disturbed(self, point: Point, place: DisturbanceInput,
                           courses: Sequence[Course]) -> list[FloatArray]:
        """Return both readings with a force."""
        readings = self.predict(point, 0)
        readings[:, 0] = self._wave(30.0 * np.cumsum(courses[0](TIME)) * TIME[1])
        return [readings]

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return both readings."""
        return np.column_stack([self._wave(0.0 * TIME), 0.0 * TIME])

    @staticmethod
    def _wave(late: FloatArray) -> FloatArray:
        return np.asarray(np.sin(2.0 * np.pi * 1.5 * TIME + late))


def calm_machine(kind: type[TwoLags]) -> Machine:
    """Return a machine on which no force acts."""
    return kind(0.0 * TIME, 0.0 * TIME)


def courses(count: int) -> FloatArray:
    """Return courses with as much in each octave of time, as sums of lagged noise, (count, n)."""
    random, step = np.random.default_rng(11), float(TIME[1] - TIME[0])
    whole = np.zeros((count, TIME.size))
    times = np.geomspace(0.075, TIME[-1], 8)
    for time in times:
        keep = np.exp(-step / time)
        noise = np.sqrt(1.0 - keep ** 2) * random.normal(size=whole.shape)
        state = random.normal(size=count)
        for i in range(TIME.size):
            state = keep * state + noise[:, i]
            whole[:, i] += state
    return RMS * whole / np.sqrt(times.size)


def test_a_linear_machine_is_moved_as_the_covariance_says() -> None:
    [found] = process(calm_machine(Pushed), {})
    assert found is not None
    moves = (found.matrix(TIME.size) @ found.root).reshape(TIME.size, 2, -1)
    said = np.sqrt((moves ** 2).sum(axis=-1))
    # answers to a force by the lag's own equation
    seen = np.array([answered(course) for course in courses(300)])
    inner = slice(TIME.size // 10, -TIME.size // 10)
    assert said[inner, 0] == pytest.approx(np.sqrt((seen ** 2).mean(axis=0))[inner], rel=0.2)
    covariance = moves[:, 0] @ moves[:, 0].T
    sampled = seen.T @ seen / len(seen)
    for apart in (TIME.size // 50, TIME.size // 10):
        assert np.diag(covariance, apart)[inner] == pytest.approx(
            np.diag(sampled, apart)[inner], abs=0.2 * float(said.max()) ** 2)
    assert not said[:, 1].any()
    assert np.all(found.beyond[inner, 0] < 0.2 * said[inner, 0])


def test_where_sums_say_nothing_patterns_do() -> None:
    """Other courses than those that were drawn vary as much, and alike at times close together."""
    [found] = process(calm_machine(Hunting), {})
    assert found is not None
    late = 30.0 * np.cumsum(courses(300), axis=1) * TIME[1]
    apart = np.sin(2.0 * np.pi * 1.5 * TIME + late) - np.sin(2.0 * np.pi * 1.5 * TIME)
    end = slice(TIME.size // 2, -TIME.size // 10)
    moves = (found.matrix(TIME.size) @ found.root).reshape(TIME.size, 2, -1)[:, 0]
    told, power = np.sum(moves[end] ** 2, axis=-1).mean(), np.mean(apart[:, end] ** 2)
    assert told + np.mean(found.beyond[end, 0] ** 2) == pytest.approx(power, rel=0.3)
    assert told > 0.8 * power
    near = 5  # samples, in a block of 30
    assert np.mean(np.sum(moves[near:] * moves[:-near], axis=-1)[end]) == pytest.approx(
        np.mean((apart[:, near:] * apart[:, :-near])[:, end]), rel=0.3)


def test_a_gap_in_a_recording_leaves_the_rest() -> None:
    """Where nothing was measured, the noise may be anything."""
    whole = calm_machine(Hunting)
    [one] = whole.experiments
    measured, noise = one.measured.copy(), one.noise.copy()
    measured[300:330], noise[300:330] = np.nan, np.nan
    [found], [gap] = process(whole, {}), process(whole.with_experiments(
        [replace(one, measured=measured, noise=noise)]), {})
    assert found is not None and gap is not None
    assert gap.beyond[TIME.size // 2:] == pytest.approx(found.beyond[TIME.size // 2:])
    assert np.isfinite(gap.beyond).all() and np.isfinite(gap.matrix(TIME.size).data).all()


def test_noise_beyond_the_sums_is_added_once() -> None:
    machine = with_everyday(calm_machine(Hunting))
    [one] = machine.experiments
    assert one.process is not None
    patterns = (one.process.matrix(TIME.size) @ one.process.root).reshape(TIME.size, 2, -1)
    whole = np.sqrt(one.noise ** 2 + (patterns ** 2).sum(axis=-1))
    assert np.median(whole[:, 0]) > 10.0 * np.median(one.noise[:, 1])
    # a twentieth of the variance is white
    assert np.median(one.process.beyond[:, 0]) == pytest.approx(
        np.median(whole[:, 0]) / np.sqrt(20.0), rel=0.1)
    again = machine.with_experiments([replace(one, colours=())])
    assert again.experiments[0].noise == pytest.approx(one.noise, rel=1e-9)
    bare = calm(one)
    assert bare.process is None
    assert acting(bare, one.process).noise == pytest.approx(one.noise, rel=1e-9)
    assert acting(bare, None).noise == pytest.approx(bare.noise)
