# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The imperfections of a wild case, which no test sheet lists and no verdict should name.

Every real machine and recorder has them: zeros inside the rate loop, gains and zeros of the
recorder, delays of its channels, a clock that is off, noise of another level and colour than the
sheet says, spikes and missing rows. lab/notebook/trial.md has the table of their sizes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math
from typing import Any

from lab.antenna.days import Days, filtered
from lab.antenna.machine import Records
from lab.antenna.real_antenna import FloatArray, simulate, TrueSignals
from lab.antenna.sensors import Noise, record, sample_instants
from lab.antenna.sheet import CaseSheet
import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

TACH_ZERO_RAD_S = 0.01
AMPLIFIER_ZERO_V = 5e-4
RECORDER_GAIN = 0.01
# The recorder adds at most one standard deviation of noise to these: in all 0.02 A, 0.03 V.
CURRENT_ZERO_A = 0.01
BIAS_ZERO_V = 0.02
DELAY_SAMPLES = 1.0
CLOCK_PPM = 100.0
CLOCK_DRIFT_PPM_PER_MIN = 10.0
NOISE_LEVEL = 2.5               # and its inverse: over the sheet's
COLOURED_SHARE = 0.8            # of the noise's power
CORNER_HZ = (0.5, 20.0)
MISSING_SHARE = (1e-4, 1e-2)    # of the rows
LONGEST_GAP = 20                # rows
SPIKE_SHARE = (1e-5, 1e-3)      # of the samples of each channel
SPIKE_SIZE = (20.0, 200.0)      # in standard deviations of noise on the sheet

ANALOGUE = ('current_1_A', 'current_2_A', 'tach_rate_1_rad_s', 'tach_rate_2_rad_s',
            'bias_voltage_V')
DELAYED = (*ANALOGUE, 'encoder_rad')
# Moments of effects, which are those of a test of this length [s].
USUAL_DURATION_S = 30.0
Imperfections = Mapping[str, Any]


def draw_recorder(delayed: Sequence[str], analogue: Sequence[str],
                  random: np.random.Generator) -> dict[str, Any]:
    """Draw what any recorder does: delays and noise of its columns, clock, gaps and spikes."""
    def between(low: float, high: float) -> float:
        return float(math.exp(random.uniform(math.log(low), math.log(high))))

    return {
        'delay_samples': {name: float(random.uniform(0.0, DELAY_SAMPLES)) for name in delayed},
        'clock_ppm': float(random.uniform(-CLOCK_PPM, CLOCK_PPM)),
        'clock_drift_ppm_per_min': float(
            random.uniform(-CLOCK_DRIFT_PPM_PER_MIN, CLOCK_DRIFT_PPM_PER_MIN)),
        'noise': {name: {'level': between(1.0 / NOISE_LEVEL, NOISE_LEVEL),
                         'coloured_share': float(random.uniform(0.0, COLOURED_SHARE)),
                         'corner_hz': between(*CORNER_HZ)} for name in analogue},
        'missing_share': between(*MISSING_SHARE),
        'spike_share': between(*SPIKE_SHARE)}


def draw_imperfections(random: np.random.Generator) -> dict[str, Any]:
    """Draw the imperfections of one antenna and its recorder."""
    def within(limit: float) -> float:
        return float(random.uniform(-limit, limit))

    return {
        'tach_zero_rad_s': [within(TACH_ZERO_RAD_S) for _ in range(2)],
        'amplifier_zero_V': [within(AMPLIFIER_ZERO_V) for _ in range(2)],
        'current_gain': [within(RECORDER_GAIN) for _ in range(2)],
        'tach_gain': [within(RECORDER_GAIN) for _ in range(2)],
        'bias_gain': within(RECORDER_GAIN),
        'current_zero_A': [within(CURRENT_ZERO_A) for _ in range(2)],
        'bias_zero_V': within(BIAS_ZERO_V),
        **draw_recorder(DELAYED, ANALOGUE, random)}


def apply_imperfections(machine: Records, imperfections: Imperfections) -> None:
    """Set the imperfections of a machine; an effect that is set later replaces its own."""
    sensors = machine.sensors[0]
    machine.motors['tach_offset'] = imperfections['tach_zero_rad_s']
    machine.motors['input_offset'] = imperfections['amplifier_zero_V']
    for which in range(2):
        sensors[f'current_error_{which + 1}'] = imperfections['current_gain'][which]
        sensors[f'current_offset_{which + 1}'] = imperfections['current_zero_A'][which]
        sensors[f'tach_error_{which + 1}'] = imperfections['tach_gain'][which]
    sensors['bias_error'] = imperfections['bias_gain']
    sensors['bias_zero'] = imperfections['bias_zero_V']


def spread_events(machine: Records, duration: float) -> None:
    """Spread the moments of effects over a test that is shorter or longer than usual."""
    for name in ('brake_start', 'brake_end', 'dropout'):
        machine.motors[name] *= duration / USUAL_DURATION_S
    machine.structure['ballast_at'] *= duration / USUAL_DURATION_S


def coloured(count: int, rate: float, share: float, corner: float,
             random: np.random.Generator) -> FloatArray:
    """
    Return noise of variance 1, shape (count,): white, and a first-order low-pass part.

    That part has a `share` of the variance and a `corner` [Hz]; `rate` is the sample rate [Hz].
    """
    keep = math.exp(-2.0 * math.pi * corner / rate)
    first = random.normal(0.0, 1.0, 1)
    slow, _ = lfilter([math.sqrt(1.0 - keep**2)], [1.0, -keep],
                      random.normal(0.0, 1.0, count), zi=keep * first)
    white = random.normal(0.0, 1.0, count)
    return np.asarray(math.sqrt(share) * slow + math.sqrt(1.0 - share) * white)


def spikes(count: int, share: float, random: np.random.Generator) -> FloatArray:
    """Return `count` zeros, of which a share (rounded) are spikes of SPIKE_SIZE, either sign."""
    found = np.zeros(count)
    at = random.choice(count, int(round(share * count)), replace=False)
    found[at] = random.uniform(*SPIKE_SIZE, len(at)) * random.choice([-1.0, 1.0], len(at))
    return found


def kept_rows(count: int, share: float, random: np.random.Generator) -> NDArray[np.int64]:
    """
    Return the indices of the rows that are not missing; the first and the last one never are.

    `share` of the `count` rows is missing (rounded), in gaps of 1 to LONGEST_GAP rows.
    """
    there = np.ones(count, dtype=bool)
    missing = min(int(round(share * count)), max(count - 2, 0))
    while missing:
        length = min(missing, int(random.integers(1, LONGEST_GAP + 1)))
        inside = np.flatnonzero(there[1:-1]) + 1
        gap = inside[int(random.integers(len(inside))):][:length]
        there[gap] = False
        missing -= len(gap)
    return np.flatnonzero(there).astype(np.int64)


def late_history(machine: Records, sheet: CaseSheet, instants: FloatArray,
                 delays: Mapping[str, float], place: tuple[float, float]) -> TrueSignals:
    """
    Simulate a test and return what each channel reads at the instants: what was so much earlier.

    Instants ascend from 0, shape (n,) [s]. `delays` [s] are by column, for each in DELAYED.
    """
    early = [np.maximum(instants - delays.get(name, 0.0), 0.0)
             for name in ('rate_command_rad_s', *DELAYED)]
    times, places = np.unique(np.concatenate(early), return_inverse=True)
    whole = simulate(machine, sheet, times, place)
    command, current_1, current_2, tach_1, tach_2, bias, encoder = places.reshape(
        len(early), len(instants))
    return replace(
        whole, command=whole.command[command],
        current=np.stack([whole.current[0, current_1], whole.current[1, current_2]]),
        tach=np.stack([whole.tach[0, tach_1], whole.tach[1, tach_2]]),
        bias=whole.bias[bias], encoder_angle=whole.encoder_angle[encoder])


def imperfect_recording(machine: Records, sheet: CaseSheet, imperfections: Imperfections,
                        rate: float, duration: float, random: np.random.Generator,
                        days: Days | None = None) -> dict[str, FloatArray]:
    """
    Return one test's columns as an imperfect recorder writes them, by name, each of shape (n,).

    `rate` is the mean sample rate [Hz], `duration` that of the test [s]. Noise, jitter, spikes,
    missing rows and the places in the gaps are random.
    """
    instants, stamps = sample_instants(rate, duration, random)
    place = (float(random.uniform(-1.0, 1.0)), float(random.uniform(-1.0, 1.0)))
    delays = {name: part / rate for name, part in imperfections['delay_samples'].items()}
    history = late_history(machine, sheet, instants, delays, place)
    if days is not None:
        history = filtered(history, days, rate)
    columns = record(history, machine, sheet.sensors, _clock(stamps, imperfections), random,
                     recorder_noise(imperfections, rate, random))
    rows = kept_rows(len(stamps), imperfections['missing_share'], random)
    return {name: column[rows] for name, column in columns.items()}


def _clock(stamps: FloatArray, imperfections: Imperfections) -> FloatArray:
    """Return the time stamps of a clock that is off, and drifts [s]."""
    drift = imperfections['clock_drift_ppm_per_min'] / 60.0
    return stamps * (1.0 + 1e-6 * (imperfections['clock_ppm'] + 0.5 * drift * stamps))


def recorder_noise(imperfections: Imperfections, rate: float,
                   random: np.random.Generator) -> Noise:
    """Return what gives so many samples of a column's noise and spikes, in units of its noise."""
    def noise(column: str, count: int) -> FloatArray:
        own = imperfections['noise'][column]
        found = own['level'] * coloured(count, rate, own['coloured_share'], own['corner_hz'],
                                        random)
        return found + spikes(count, imperfections['spike_share'], random)

    return noise
