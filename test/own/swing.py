# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A machine in closed form for the tests: a damped swing, seen as an angle and as a rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from simgap.model import (
    effect, free, known, Log, machine, Model, push, reading, ripple, shape, size, within,
)

FloatArray = NDArray[np.float64]
TIME: FloatArray = 0.01 * np.arange(2000, dtype=np.float64)
NOISE, RATE_NOISE = 1e-3, 0.02


def simulate(numbers: Any, test: Any) -> dict[str, FloatArray]:
    """Return angle and rate of a swing about a bias, and what enters through a lag of 0.1 s."""
    n, time = numbers, test.time
    fall = np.exp(-n.decay * time)
    angle = n.start * fall * np.cos(n.pulsation * time) + n.bias
    angle = angle + n.drift * time + n.step * (time > n.moment)
    angle = angle + n.wave_cosine * np.cos(n.wave_order * test['turn'])
    angle = angle + n.wave_sine * np.sin(n.wave_order * test['turn'])
    angle = angle + lagged(test.push['wind'])
    return {'angle': angle, 'rate': np.gradient(angle, time)}


def lagged(course: FloatArray) -> FloatArray:
    """Return a course behind a lag of 0.1 s."""
    kernel = np.exp(-TIME[:100] / 0.1)
    return np.convolve(course, kernel / kernel.sum())[:course.size]


def swing(**changes: Any) -> Model:
    """Return the model of the swing, with some entries changed."""
    entries: dict[str, Any] = {
        'simulate': simulate,
        'base': {'pulsation': known(2.0, 'rad/s'), 'decay': within(0.1, 0.2, '1/s'),
                 'bias': free(-0.5, 0.5, 'rad')},
        'per_test': {'start': free(0.0, 2.0, 'rad')},
        'readings': {'angle': reading('rad', noise=NOISE),
                     'rate': reading('rad/s', noise=RATE_NOISE)},
        'effects': [
            effect('sensor.drift', cause='it warms up', drift=size(-0.05, 0.05, 'rad/s')),
            effect('sensor.slip', step=size(-0.5, 0.5, 'rad'), moment=shape(2.0, 18.0, 9.0, 's')),
            ripple('sensor.wave', 'wave', size(-0.1, 0.1, 'rad'), 'turn')],
        'push': {'wind': push('swing', 'wind on the swing', 'rad', 0.05)},
        'settles_s': 0.5,
    }
    return machine(**{**entries, **changes})


def log_of(name: str, start: float, seed: int, truth: Mapping[str, float] | None = None,
           wind: FloatArray | None = None) -> Log:
    """Return the log of a swing with what is true of it."""
    values = {'pulsation': 2.0, 'decay': 0.104, 'bias': 0.05, 'start': start, 'drift': 0.0,
              'step': 0.0, 'moment': 9.0, 'wave_cosine': 0.0, 'wave_sine': 0.0, 'wave_order': 1.0,
              **(truth or {})}
    turn = 0.7 * TIME

    class Numbers:
        """The values as attributes."""

    class Test:
        """A test as a simulation sees it."""

        time = TIME
        push = {'wind': 0.0 * TIME if wind is None else wind}

        def __getitem__(self, column: str) -> FloatArray:
            return turn

    numbers = Numbers()
    vars(numbers).update(values)
    random = np.random.default_rng(seed)
    found = simulate(numbers, Test())
    return Log(name, TIME, {
        'turn': turn, 'angle': found['angle'] + NOISE * random.normal(size=TIME.size),
        'rate': found['rate'] + RATE_NOISE * random.normal(size=TIME.size)})


def logs(truth: Mapping[str, float] | None = None, wind: FloatArray | None = None) -> list[Log]:
    """Return the logs of two tests."""
    return [log_of('far', 1.0, 1, truth, wind), log_of('near', 0.4, 2, truth, wind)]
