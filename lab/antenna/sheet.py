# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The test sheet of a recording: waveform, bias and sensors, as the tester knows them.

The YAML has the diagnosis' input format. Phases of a square or triangle are in periods, those of
a multisine in radians; a sine of phase zero starts at zero.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
import math
from typing import Any

from lab.antenna import waveform
import numpy as np
from numpy.typing import NDArray

SHAPES = {'square': waveform.SQUARE, 'triangle': waveform.TRIANGLE,
          'multisine': waveform.MULTISINE, 'chirp': waveform.CHIRP, 'knots': waveform.KNOTS}


@dataclass(frozen=True)
class SensorGrade:
    """Noise (standard deviation) and resolution of the recorder's sensors."""

    current_noise_A: float = 0.01
    current_step_A: float = 0.01
    tach_noise_rad_s: float = 0.0035
    tach_noise_relative: float = 0.0015
    tach_step_rad_s: float = 0.002
    encoder_bits: int = 21
    bias_noise_V: float = 0.01
    bias_step_V: float = 0.01


@dataclass(frozen=True)
class CaseSheet:
    """
    One test: command, source of the bias, and grade of the sensors.

    More than the input format has: square and triangle with `start_s`; knots, with `times_s` and
    `rates_deg_s`, between which the rate is linear.
    """

    circuit: str                        # of Table 1, 'old' or 'new'
    filter_1: str                       # of Table 1, 'old' or 'new'
    bias: Mapping[str, Any]             # of the input format: circuit, fixed or fixed_step
    waveform: Mapping[str, Any]         # square, triangle, multisine, chirp or knots; empty: rest
    elevation_deg: float = 45.0         # at the start
    sensors: SensorGrade = SensorGrade()
    parameter_tolerance: float = 0.02   # largest relative deviation from the reference

    def plain(self) -> dict[str, Any]:
        """Return the content of the YAML file."""
        return {
            'circuit': self.circuit, 'filter_1': self.filter_1, 'bias': dict(self.bias),
            'waveform': dict(self.waveform), 'start': 'rest',
            'elevation_deg': self.elevation_deg, 'sensors': asdict(self.sensors),
            'parameter_tolerance': self.parameter_tolerance}

    def given(self, *, sensors: bool = True) -> dict[str, Any]:
        """Return what the input format can say of this test, with or without the sensors."""
        plain = self.plain()
        kind = self.waveform.get('type')
        if kind == 'knots' or (kind in ('square', 'triangle') and 'start_s' in self.waveform):
            del plain['waveform']
        if not sensors:
            del plain['sensors']
        return plain

    def record(self) -> NDArray[Any]:
        """Return the record for the compiled equations, shape (1,), waveform.TEST."""
        test = np.zeros(1, waveform.TEST)
        record = test[0]
        record['elevation'] = math.radians(self.elevation_deg)
        record['period'] = record['duration'] = 1.0
        if self.bias['type'] != 'circuit':
            record['bias_source'] = 1.0
            record['bias_voltage'] = self.bias['voltage_V']
            record['bias_at'] = self.bias.get('at_s', 0.0)
        if not self.waveform:
            record['shape'] = waveform.REST
            return test
        shape = self.waveform
        record['shape'] = SHAPES[shape['type']]
        if shape['type'] == 'knots':
            count = len(shape['times_s'])
            record['knots'] = count
            record['knot_time'][:count] = shape['times_s']
            record['knot_rate'][:count] = np.radians(shape['rates_deg_s'])
            return test
        record['amplitude'] = math.radians(shape['amplitude_deg_s'])
        record['start'] = shape.get('start_s', 0.0)
        if shape['type'] in ('square', 'triangle'):
            record['period'] = shape['period_s']
            record['phase'] = shape.get('phase', 0.0)
        elif shape['type'] == 'multisine':
            count = len(shape['frequencies_hz'])
            record['sines'] = count
            record['frequency'][:count] = shape['frequencies_hz']
            record['weight'][:count] = shape['weights']
            record['sine_phase'][:count] = shape['phases']
        else:
            record['first_frequency'] = shape['f0_hz']
            record['last_frequency'] = shape['f1_hz']
            record['duration'] = shape['duration_s']
        return test
