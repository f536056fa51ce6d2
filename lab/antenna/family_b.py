# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Family B: other laws for the same effects, other outsiders and other programmes.

It is used only to report how a diagnosis does on forms that nothing was tuned on;
lab/notebook/history.md lists each use. Effects have the names, numbers and ranges of `effects`.
Those in LAWS act by another law, the others are changes of a constant and have only one.
"""

from dataclasses import replace
import math
from typing import Any

from lab.antenna import programme
from lab.antenna.effect import Change, Defect, defects, Parameters
from lab.antenna.effects import CATALOGUE as CATALOGUE_A, gust_of
from lab.antenna.machine import LAW_B, Records
from lab.antenna.table import read_table
from lab.antenna.wild_programme import knots, levels, Shapes, SIDEREAL_DEG_S
import numpy as np

_TABLE = read_table('family_b.yaml')
LAWS: dict[str, str] = _TABLE['laws']


def _gust(machine: Records, values: Parameters) -> None:
    # Kaimal's spectrum of wind speed, f S ~ x / (1 + x)^(5/3).
    gust_of(machine, values, lambda x: x / (1.0 + x)**(5.0 / 3.0))


def _under_law_b(change: Change) -> Change:
    def changed(machine: Records, values: Parameters) -> None:
        machine.motors['law'] = machine.structure['law'] = machine.sensors['law'] = LAW_B
        change(machine, values)
    return changed


def _other_law(effect: Defect) -> Defect:
    name = effect.key.split('.')[1]
    if name not in LAWS:
        return effect
    change = _gust if name == 'wind_gust' else effect.change
    return replace(effect, form=LAWS[name], change=_under_law_b(change))


CATALOGUE = {key: _other_law(effect) for key, effect in CATALOGUE_A.items()}


def _shaker(machine: Records, values: Parameters) -> None:
    machine.structure['gust'][0, 0] = values['torque']
    machine.structure['gust_frequency'][0, 0] = 2.0 * math.pi * values['frequency']


OUTSIDE = defects({'outside': _TABLE['outside']}, {'outside.shaker': _shaker})


def _staircase(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Five steps up and five steps down, in both directions."""
    hold = programme.log_uniform(2.0, 5.0, 2, random)
    size = programme.log_uniform(0.04, 0.15, 4, random)
    starts = np.arange(rest, duration, hold)
    place = np.arange(len(starts)) % 20
    rates = size * (5.0 - np.abs(5.0 - place % 10)) / 5.0 * np.where(place < 10, 1.0, -1.0)
    return levels(starts.tolist(), rates.tolist(), duration + hold)


def _raster(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Scan lines to and fro at a constant rate, on a source that moves."""
    rate, line = programme.log_uniform(0.03, 0.12, 4, random), float(random.uniform(3.0, 8.0))
    turn = float(random.uniform(0.3, 1.0))
    times, rates, t, sign = [rest], [0.0], rest, 1.0
    while t < duration:
        for length in (turn, line):
            t += length
            times.append(t)
            rates.append(SIDEREAL_DEG_S + sign * rate)
        sign = -sign
    return knots(times, rates)


def _saw_tooth(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Rise slowly through zero, and fly back."""
    rate, rise = float(random.uniform(0.4, 0.685)), float(random.uniform(3.0, 6.0))
    back = float(random.uniform(0.3, 1.0))
    times, rates, t = [rest], [0.0], rest
    for length, reached in [(0.5 * rise, rate)] + 200 * [(back, -rate), (rise, rate)]:
        t += length
        times.append(t)
        rates.append(reached)
        if t > duration:
            break
    return knots(times, rates)


def _sprints(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Run without a jerk, to and fro in turn: the rate is a raised cosine."""
    rate = float(random.uniform(0.4, 0.685))
    run, pause = float(random.uniform(4.0, 7.0)), float(random.uniform(1.0, 2.0))
    course = 0.5 - 0.5 * np.cos(2.0 * math.pi * np.arange(7) / 6.0)
    times: list[float] = []
    rates: list[float] = []
    t, sign = rest, 1.0
    while t < duration:
        times += (t + run * np.arange(7) / 6.0).tolist()
        rates += (sign * rate * course).tolist()
        t, sign = t + run + pause, -sign
    return knots(times, rates)


def _random_binary(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """One rate to and fro, reversed at random beats of a clock."""
    beat = max(float(random.uniform(0.5, 1.2)), duration / 230.0)
    starts = np.arange(rest, duration, beat)
    signs = random.choice([-1.0, 1.0], len(starts))
    # about zero in the mean: the second half repeats the first with the other sign
    half = len(starts) // 2
    signs[half:2 * half] = -signs[:half]
    size = programme.log_uniform(0.05, 0.2, 4, random)
    return levels(starts.tolist(), (size * signs).tolist(), duration + beat)


def _tones(duration: float, rest: float, random: np.random.Generator) -> dict[str, Any]:
    """Four tones without a common period."""
    frequencies = [float(f) for f in np.round(
        [random.uniform(0.1, 0.25), random.uniform(0.5, 1.1), random.uniform(1.9, 3.1),
         random.uniform(4.0, 7.0)], 4)]
    return {'type': 'multisine', 'amplitude_deg_s': programme.log_uniform(0.08, 0.2, 4, random),
            'frequencies_hz': frequencies, 'weights': [0.7, 0.5, 0.4, 0.3],
            'phases': [round(float(p), 4) for p in random.uniform(0.0, 2.0 * math.pi, 4)],
            'start_s': round(max(rest, 0.5), 2)}


SHAPES: Shapes = {
    'slow': {'staircase': _staircase, 'raster': _raster},
    'fast': {'saw_tooth': _saw_tooth, 'sprints': _sprints},
    'broad': {'random_binary': _random_binary, 'tones': _tones}}
