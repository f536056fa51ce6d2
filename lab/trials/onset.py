# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Tests in which the antenna changes: what a twin has to notice.

Each machine goes on from the state that the one before has left, with the same command. Moments
of effects (a load that shifts, the phase of a gust) count from the machine's own beginning.

A case is one antenna with the tolerances and imperfections of a wild one, in one long test: a
square wave, a triangle or a multisine, which go on for ever. It stays healthy, or an effect of the
catalogue is switched on in the middle.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
import math
from typing import Any

from lab.antenna import equations, integrator
from lab.antenna.cases import build_machine, case_name, round_robin, sheet_of, Truth
from lab.antenna.effects import CATALOGUE
from lab.antenna.imperfections import draw_imperfections, recorder_noise
from lab.antenna.machine import Records
from lab.antenna.programme import draw_sheets
from lab.antenna.real_antenna import (
    FloatArray, history_of, input_edges, SimulationError, start_state, state_sizes, TOLERANCE,
    TrueSignals,
)
from lab.antenna.sensors import record, sample_instants
from lab.antenna.sheet import CaseSheet
import numpy as np
from numpy.typing import NDArray

RATE_HZ = 100.0
# The effect is switched on in this part of the test, which ends so much later [s].
ONSET_S, AFTER_S = (330.0, 350.0), 30.0
# Of the range of sizes: middle and large ones.
SIZES = (1.0 / 3.0, 1.0)


def draw_truths(count: int, seed: int, tolerance: float, healthy_s: float = 0.0) -> list[Truth]:
    """
    Draw the cases of a trial of the twin; an effect is switched on in each unless `healthy_s`.

    `tolerance` is the largest relative deviation of any parameter from the reference. `healthy_s`
    is the length of tests in which nothing happens [s].
    """
    effects = round_robin(list(CATALOGUE.values()), np.random.default_rng([seed, 0]))
    return [_truth(number, seed, tolerance, healthy_s, effects) for number in range(1, count + 1)]


def _truth(number: int, seed: int, tolerance: float, healthy_s: float,
           effects: Iterator[Any]) -> Truth:
    random = np.random.default_rng([seed, number])
    onset = float(random.uniform(*ONSET_S))
    size = float(random.uniform(*SIZES))
    sheets = draw_sheets(tolerance, 30.0, random)
    while sheets[2].waveform['type'] == 'chirp':  # which would end
        sheets = draw_sheets(tolerance, 30.0, random)
    sheet = sheets[int(random.integers(len(sheets)))]
    effect = next(effects)
    return {
        'case': case_name(number), 'kind': 'none' if healthy_s else 'single',
        'effects': [] if healthy_s else [
            {'id': effect.key, 'size': size, 'parameters': effect.draw(size, random)}],
        'tolerance': tolerance, 'seed': [seed, number], 'sample_rate_hz': RATE_HZ,
        'onset_s': healthy_s or onset,
        'duration_s': healthy_s or onset + AFTER_S, 'sheets': [sheet.plain()],
        'imperfections': draw_imperfections(random)}


def make_recording(truth: Truth) -> dict[str, FloatArray]:
    """
    Return the columns of a case's recording by name, each of shape (n,).

    Raise SimulationError where the antenna of this case cannot be integrated.
    """
    random = np.random.default_rng([*truth['seed'], 2])
    sheet, rate = sheet_of(truth, 0), truth['sample_rate_hz']
    instants, stamps = sample_instants(rate, truth['duration_s'], random)
    place = (float(random.uniform(-1.0, 1.0)), float(random.uniform(-1.0, 1.0)))
    machines = [build_machine({**truth, 'effects': []}, 0)]
    if truth['effects']:
        machines.append(build_machine(truth, 0))
    history = simulate_changes(list(zip(machines, [truth['onset_s'], truth['duration_s']])),
                               sheet, instants, place)

    def recorded(machine: Records) -> dict[str, FloatArray]:
        # the same noise for each: the recorder's own errors change with the machine
        noise = recorder_noise(truth['imperfections'], rate,
                               np.random.default_rng([*truth['seed'], 4]))
        return record(history, machine, sheet.sensors, stamps,
                      np.random.default_rng([*truth['seed'], 3]), noise)

    columns = recorded(machines[0])
    if len(machines) > 1:
        later, late = recorded(machines[1]), instants >= truth['onset_s']
        columns = {name: np.where(late, later[name], columns[name]) for name in columns}
    return columns


def shows_by(truth: Truth, columns: Mapping[str, FloatArray], within_s: float) -> float:
    """
    Return how far an effect changes the readings, as half a chi-square of the sheet's noise.

    The first `within_s` [s] after the onset count. An effect may not show in a test at all: a
    circuit that is at its limit throughout has no speed.
    """
    healthy = make_recording({**truth, 'effects': []})
    grade = sheet_of(truth, 0).sensors
    noise = {'current_1_A': grade.current_noise_A, 'current_2_A': grade.current_noise_A,
             'tach_rate_1_rad_s': grade.tach_noise_rad_s,
             'tach_rate_2_rad_s': grade.tach_noise_rad_s,
             'encoder_rad': math.tau / 2**grade.encoder_bits,
             'bias_voltage_V': grade.bias_noise_V}
    since = columns['time_s'] - truth['onset_s']
    seen = (since >= 0.0) & (since < within_s)
    return 0.5 * sum(float(np.sum(((columns[name] - healthy[name])[seen] / sigma)**2))
                     for name, sigma in noise.items())


def simulate_changes(stretches: Sequence[tuple[Records, float]], sheet: CaseSheet,
                     times: FloatArray, place: tuple[float, float] = (0.0, 0.0)) -> TrueSignals:
    """
    Simulate one test from rest, with one machine after the other, as `simulate` does.

    Stretches have each machine and the time at which its part ends [s]; the last goes on to the
    end. Raise SimulationError where the integration failed.
    """
    y = start_state(stretches[0][0], sheet, place)
    mode = np.zeros(equations.SWITCHES, np.int64)
    mode[equations.LOAD_SIGN] = 1
    began, parts = 0.0, []
    ends = [*(end for _, end in stretches[:-1]), math.nextafter(float(times[-1]), math.inf)]
    for (machine, _), end in zip(stretches, ends, strict=True):
        wanted = times[(times >= began) & (times < end)]
        part = _stretch(machine, _later(sheet.record(), began), y, mode, wanted - began,
                        end - began)
        parts.append(replace(part, time=wanted))
        began = end
    return _joined(parts)


def _later(test: NDArray[Any], by: float) -> NDArray[Any]:
    """Return the record of a test whose time counts from `by` [s] after its start."""
    for name in ('start', 'knot_time', 'bias_at'):
        test[name] -= by
    return test


def _stretch(machine: Records, test: NDArray[Any], y: FloatArray, mode: NDArray[np.int64],
             times: FloatArray, length: float) -> TrueSignals:
    """Integrate one machine from its own zero of time; leave the last state in `y`."""
    instants = np.append(times, length)
    states = np.full((len(instants), equations.STATES), math.nan)
    statistics = np.zeros(3, np.int64)
    edges = input_edges(machine, test[0], length)
    reason = integrator.integrate(machine, test[0], y, mode, edges, instants, TOLERANCE,
                                  state_sizes(machine), states, statistics)
    if reason != integrator.DONE:
        raise SimulationError(f'the antenna cannot be integrated, reason {reason}')
    # the end of the stretch is no sample
    return history_of(machine, test, times, states[:-1], edges, statistics)


def _joined(parts: Sequence[TrueSignals]) -> TrueSignals:
    values: dict[str, Any] = {}
    for item in fields(TrueSignals):
        own = [getattr(part, item.name) for part in parts]
        axis = 0 if item.name == 'state' else -1
        values[item.name] = sum(own) if isinstance(own[0], int) else np.concatenate(own, axis)
    return TrueSignals(**values)
