# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder: true signals with noise, quantisation and clock jitter."""

from collections.abc import Callable
import math

from lab.antenna.machine import LAW_B, Records
from lab.antenna.real_antenna import FloatArray, TrueSignals
from lab.antenna.sheet import SensorGrade
import numpy as np
from scipy.signal import lfilter

JITTER = 0.03               # spread of the sampling instants, in sample periods
STAMP_ERROR_S = 5e-5        # spread of the time stamps about the true instants
STAMP_DIGIT_S = 1e-6
# Largest zero error of the encoder.
ENCODER_ZERO_RAD = 5e-6

COLUMNS = ('time_s', 'rate_command_rad_s', 'current_1_A', 'current_2_A', 'tach_rate_1_rad_s',
           'tach_rate_2_rad_s', 'encoder_rad', 'bias_voltage_V')
# Noise of a column in its standard deviations on the sheet, from the column and the number of
# samples.
Noise = Callable[[str, int], FloatArray]


def sample_instants(rate: float, duration: float,
                    random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """
    Return the true sampling instants and their time stamps of a recording of `duration` [s].

    Both ascend strictly from 0, shape (n,) [s]; `rate` is the mean sample rate [Hz].
    """
    count = int(round(rate * duration)) + 1
    grid = np.arange(count) / rate
    jitter = np.clip(random.normal(0.0, JITTER, count), -0.3, 0.3) / rate
    instants = np.maximum(grid + jitter, 0.0)
    error = np.clip(random.normal(0.0, STAMP_ERROR_S, count), -0.1 / rate, 0.1 / rate)
    stamps = np.round((instants + error) / STAMP_DIGIT_S) * STAMP_DIGIT_S
    instants[0] = stamps[0] = 0.0
    return instants, stamps


def _digits(values: FloatArray, step: float) -> FloatArray:
    # Adding zero turns -0 into 0.
    return np.round(values / step) * step + 0.0 if step > 0.0 else values


def _encoder(angle: FloatArray, machine: Records, grade: SensorGrade,
             random: np.random.Generator) -> FloatArray:
    sensors = machine.sensors[0]
    phase = sensors['encoder_lines'] * angle + sensors['encoder_phase']
    if sensors['encoder_play'] > 0.0:
        angle = _behind_play(angle, float(sensors['encoder_play']))
    reading = angle + sensors['encoder_offset'] + random.uniform(-1.0, 1.0) * ENCODER_ZERO_RAD
    wave = (np.sin(phase) + 0.2 * np.sin(3.0 * phase + 1.0) if sensors['law'] == LAW_B
            else np.sin(phase) + 0.25 * np.sin(2.0 * phase + 0.5))
    reading = reading + sensors['encoder_cyclic'] * wave
    step = float(sensors['encoder_step']) or 2.0 * math.pi / 2**grade.encoder_bits
    # An encoder counts whole lines and so rounds down.
    return np.floor(reading / step) * step


def _behind_play(angle: FloatArray, half: float) -> FloatArray:
    """Return the angle of a shaft that another one drags along behind a play."""
    dragged, at = np.empty_like(angle), float(angle[0])
    for k, value in enumerate(angle.tolist()):
        at = min(max(at, value - half), value + half)
        dragged[k] = at
    return dragged


def _ammeters(current: FloatArray, machine: Records, stamps: FloatArray) -> FloatArray:
    """Return what the ammeters are given, shape (2, n) [A]."""
    sensors = machine.sensors[0]
    if sensors['ammeter_crosstalk'] != 0.0:
        current = current + sensors['ammeter_crosstalk'] * current[::-1]
    if sensors['ammeter_lag'] > 0.0 and len(stamps) > 1:
        step = float(stamps[-1] - stamps[0]) / (len(stamps) - 1)
        keep = math.exp(-step / float(sensors['ammeter_lag']))
        filtered, _ = lfilter([1.0 - keep], [1.0, -keep], current, axis=1,
                              zi=keep * current[:, :1])
        current = np.asarray(filtered)
    return current


def record(history: TrueSignals, machine: Records, grade: SensorGrade, stamps: FloatArray,
           random: np.random.Generator, noise: Noise | None = None) -> dict[str, FloatArray]:
    """
    Return the recording of true signals: its columns by name, each of shape (n,).

    Stamps have shape (n,) [s]. Without `noise` it is white and as loud as the sheet says.
    """
    def white(column: str, count: int) -> FloatArray:
        return random.normal(0.0, 1.0, count)

    count, noise = len(stamps), noise or white
    sensors = machine.sensors[0]
    current = _ammeters(history.current, machine, stamps)
    columns = {'time_s': stamps, 'rate_command_rad_s': history.command}
    for which in range(2):
        gain = 1.0 + float(sensors[f'current_error_{which + 1}'])
        offset = float(sensors[f'current_offset_{which + 1}'])
        offset += random.uniform(-1.0, 1.0) * grade.current_noise_A
        name = f'current_{which + 1}_A'
        columns[name] = _digits(gain * current[which] + offset
                                + noise(name, count) * grade.current_noise_A,
                                grade.current_step_A)
    for which in range(2):
        name = f'tach_rate_{which + 1}_rad_s'
        true = (1.0 + float(sensors[f'tach_error_{which + 1}'])) * history.tach[which]
        offset = random.uniform(-1.0, 1.0) * grade.tach_noise_rad_s
        sigma = np.hypot(grade.tach_noise_rad_s, grade.tach_noise_relative * true)
        columns[name] = _digits(true + offset + noise(name, count) * sigma, grade.tach_step_rad_s)
    columns['encoder_rad'] = _encoder(history.encoder_angle, machine, grade, random)
    bias = (1.0 + float(sensors['bias_error'])) * history.bias
    bias = bias + float(sensors['bias_zero'])
    bias = bias + random.uniform(-1.0, 1.0) * grade.bias_noise_V
    columns['bias_voltage_V'] = _digits(
        bias + noise('bias_voltage_V', count) * grade.bias_noise_V, grade.bias_step_V)
    return {name: columns[name] for name in COLUMNS}
