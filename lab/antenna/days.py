# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What every day and every logger bring to a wild case of family c, and no verdict should name.

Friction is warmer or colder from recording to recording, a wind blows, a filter sits somewhere in
the logger, and each sensor and part has a little of the faults that the catalogue knows.
"""

from collections.abc import Mapping
import math
from typing import Any

from lab.antenna.effects import CATALOGUE
from lab.antenna.machine import Records
from lab.antenna.real_antenna import FloatArray, TrueSignals
import numpy as np
from scipy.signal import lfilter

# Largest share of its level by which a friction differs from recording to recording.
FRICTION = 0.08
WIND = (0.01, 0.02)             # rms, as a share of the axis' Coulomb friction
WIND_CORNER_HZ = (0.05, 0.3)
FILTER_HZ = (25.0, 80.0)
FILTERED = ('current_1', 'current_2', 'tach_1', 'tach_2', 'bias', 'encoder')
# Size of a little fault, as a share of the least one that a trial draws.
LITTLE = 0.2
# Faults that are nothing where their number is zero.
FAULTS = ('torque_ripple', 'transmission_error', 'ripple', 'cyclic_error', 'friction_asymmetry',
          'load_dependent_friction', 'hysteresis', 'gravity_imbalance', 'amplifier_dead_zone')
Days = Mapping[str, Any]


def draw_days(recordings: int, random: np.random.Generator) -> dict[str, Any]:
    """Draw what the days bring to so many recordings of one antenna."""
    faults = {}
    for key, defect in CATALOGUE.items():
        place, name = key.split('.')
        if name in FAULTS and place != 'motors':
            values = defect.draw(0.0, random)
            values[defect.quantities[0].name] *= LITTLE * float(random.uniform())
            faults[key] = values
    return {
        'friction': random.uniform(-FRICTION, FRICTION, (recordings, 3)).tolist(),
        'wind': [{'share': float(random.uniform(*WIND)), 'seed': int(random.integers(2 ** 31)),
                  'corner': float(math.exp(random.uniform(*np.log(WIND_CORNER_HZ))))}
                 for _ in range(recordings)],
        'filter_hz': {str(random.choice(FILTERED)): float(random.uniform(*FILTER_HZ))},
        'faults': faults}


def apply_days(machine: Records, days: Days, recording: int) -> None:
    """Set what the days bring to a recording; an effect that is set later replaces its own."""
    for key, values in days['faults'].items():
        CATALOGUE[key].change(machine, values)
    axis, *motors = days['friction'][recording]
    level = float(machine.structure['coulomb'][0])
    machine.structure['coulomb'] *= 1.0 + axis
    machine.motors['coulomb'] *= 1.0 + np.array(motors)
    wind = dict(days['wind'][recording])
    CATALOGUE['axis.wind_gust'].change(machine, {'rms': wind.pop('share') * level, **wind})


def filtered(signals: TrueSignals, days: Days, rate: float) -> TrueSignals:
    """Return signals as a logger's filter lets them through, at a mean sample rate [Hz]."""
    places = {'current_1': signals.current[0], 'current_2': signals.current[1],
              'tach_1': signals.tach[0], 'tach_2': signals.tach[1], 'bias': signals.bias,
              'encoder': signals.encoder_angle}
    for name, corner in days['filter_hz'].items():
        places[name][:] = _low_pass(places[name], math.exp(-2.0 * math.pi * corner / rate))
    return signals


def _low_pass(values: FloatArray, keep: float) -> FloatArray:
    """Return values, shape (n,), behind a first-order low-pass that starts settled."""
    found, _ = lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])
    return np.asarray(found)
