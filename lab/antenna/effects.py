# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue's effects in this program's own forms, with the range of each.

The smallest sizes are just detectable in the standard test programme through noise and tolerances
(measured in lab/notebook/trial.md); the largest would call for a repair. A tachometer is inside
the rate loop; errors of current, encoder and bias affect the recording only.
"""

from collections.abc import Callable
import math

from lab.antenna.effect import defects, Parameters
from lab.antenna.machine import GUST_WAVES, Records
from lab.antenna.table import read_table
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def _fade_out(machine: Records, values: Parameters) -> None:
    machine.circuit['fade_out'] += values['shift']


def gust_of(machine: Records, values: Parameters,
            spectrum: Callable[[FloatArray], FloatArray]) -> None:
    """
    Set a gust of rms [N m], corner [Hz] and seed as a sum of sines.

    `spectrum` is the power per unit of ln f, from frequency over corner.
    """
    frequency = np.geomspace(0.02, 3.0, GUST_WAVES)     # even in ln f
    amplitude = np.sqrt(spectrum(frequency / values['corner']))
    amplitude *= values['rms'] / math.sqrt(0.5 * float(np.sum(amplitude**2)))
    random = np.random.default_rng(int(values['seed']))
    structure = machine.structure[0]
    structure['gust'] = amplitude
    structure['gust_frequency'] = 2.0 * math.pi * frequency
    structure['gust_phase'] = random.uniform(0.0, 2.0 * math.pi, GUST_WAVES)


def _gust(machine: Records, values: Parameters) -> None:
    # Davenport's spectrum of wind speed, S ~ x^2 / (f (1 + x^2)^(4/3)).
    gust_of(machine, values, lambda x: x**2 / (1.0 + x**2)**(4.0 / 3.0))


def _one_mode(machine: Records, values: Parameters) -> None:
    machine.structure['mode_frequency'][0, int(values['mode']) - 1] *= values['factor']


def _extra_mode(machine: Records, values: Parameters) -> None:
    machine.structure['extra_inertia'] = values['inertia']
    machine.structure['extra_frequency'] = 2.0 * math.pi * values['frequency']
    machine.structure['extra_damping'] = values['damping_ratio']


CATALOGUE = defects(read_table('effects.yaml'), {
    'torque_share.fade_out_voltage': _fade_out,
    'axis.wind_gust': _gust,
    'axis.mode_frequency': _one_mode,
    'axis.extra_mode': _extra_mode})
