# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How clearly an effect shows through noise and tolerances; the ranges of sizes are based on it.

The measure is the effect's change of the recorded signals in standard deviations of noise, less
the part that tolerances, initial positions and sensor offsets can imitate. That part is a
first-order fit in which a ridge keeps each of them near its prior. Run
`python -m lab.antenna.detectability` for the table of lab/notebook/trial.md.
"""

import argparse
from collections.abc import Callable
import copy
import math

from lab.antenna.cases import build_machine, draw_truths, sheet_of, Truth
from lab.antenna.family import FAMILIES
from lab.antenna.machine import apply_tolerances, draw_tolerances, Records, ToleranceFactors
from lab.antenna.real_antenna import FloatArray, simulate
from lab.antenna.sensors import record
from lab.antenna.sheet import SensorGrade
import numpy as np

RECORDINGS = 3
PROBE = 0.1         # step of the derivatives, as a share of a prior's spread
# Standard deviation of a uniform distribution within +-1.
UNIFORM_SPREAD = 1.0 / math.sqrt(3.0)
RATE_HZ, DURATION_S = 200.0, 30.0


# Sensors without noise and quantisation: the study adds both by their statistics.
PERFECT = SensorGrade(current_noise_A=0.0, current_step_A=0.0, tach_noise_rad_s=0.0,
                      tach_noise_relative=0.0, tach_step_rad_s=0.0, encoder_bits=40,
                      bias_noise_V=0.0, bias_step_V=0.0)


class Study:
    """The standard programme on the reference antenna, and its derivatives by tolerances."""

    def __init__(self, tolerance: float = 0.02, seed: int = 1,
                 report: Callable[[float], None] = lambda part: None,
                 family: str = 'a') -> None:
        """
        Simulate the derivatives by every tolerance, initial position and offset.

        `tolerance` is the largest relative deviation of any parameter; `seed` is that of the
        programme. `report` gets the share that is done, 0 to 1.
        """
        truth = next(t for t in draw_truths(40, seed, tolerance) if t['kind'] == 'none')
        self._truth: Truth = {**truth, 'tolerance': 0.0, 'family': family}
        self._times = np.arange(int(RATE_HZ * DURATION_S) + 1) / RATE_HZ
        neutral = draw_tolerances(0.0, np.random.default_rng(0))
        self._base = self._signals(neutral, (0.3, -0.2), None)
        columns = []
        sigma = tolerance * UNIFORM_SPREAD
        total = sum(part.size for part in neutral)
        for place, part in enumerate(neutral):
            for index in np.ndindex(part.shape):
                sides = []
                for sign in (1.0, -1.0):
                    moved = copy.deepcopy(neutral)
                    moved[place][index] += sign * PROBE * sigma
                    sides.append(self._signals(moved, (0.3, -0.2), None))
                columns.append((sides[0] - sides[1]) / (2.0 * PROBE))
                report(len(columns) / total)
        columns += self._places(neutral) + self._offsets()
        self._nuisance = np.stack(columns, axis=1)
        gram = self._nuisance.T @ self._nuisance
        self._solver = np.linalg.inv(gram + np.eye(len(gram)))

    def _places(self, neutral: ToleranceFactors) -> list[FloatArray]:
        """Return the effects of the motors' places in their gaps, of each recording alone."""
        columns = []
        for place in ((0.4, -0.2), (0.3, -0.1)):
            change = (self._signals(neutral, place, None) - self._base) * UNIFORM_SPREAD / 0.1
            columns += list(change * np.kron(np.eye(RECORDINGS),
                                             np.ones(len(change) // RECORDINGS)))
        return columns

    def _offsets(self) -> list[FloatArray]:
        """Return a zero error of each column of each recording."""
        count = len(self._times)
        return list(UNIFORM_SPREAD * np.kron(np.eye(len(self._base) // count), np.ones(count)))

    def _signals(self, tolerances: ToleranceFactors, place: tuple[float, float],
                 effect: tuple[str, dict[str, float]] | None) -> FloatArray:
        """Return all recorded signals in standard deviations of noise, concatenated."""
        parts = []
        truth = dict(self._truth)
        if effect is not None:
            truth['effects'] = [{'id': effect[0], 'parameters': effect[1]}]
        for recording in range(RECORDINGS):
            machine = build_machine(truth, recording)
            apply_tolerances(machine, tolerances)
            parts.append(self._recording(machine, recording, place))
        return np.concatenate(parts)

    def _recording(self, machine: Records, recording: int,
                   place: tuple[float, float]) -> FloatArray:
        sheet = sheet_of(self._truth, recording)
        history = simulate(machine, sheet, self._times, place)
        columns = record(history, machine, PERFECT, self._times, np.random.default_rng(0))
        grade = sheet.sensors
        scaled = []
        for name, noise, step in (
                ('current_1_A', grade.current_noise_A, grade.current_step_A),
                ('current_2_A', grade.current_noise_A, grade.current_step_A),
                ('tach_rate_1_rad_s', grade.tach_noise_rad_s, grade.tach_step_rad_s),
                ('tach_rate_2_rad_s', grade.tach_noise_rad_s, grade.tach_step_rad_s),
                ('encoder_rad', 0.0, 2.0 * math.pi / 2**grade.encoder_bits),
                ('bias_voltage_V', grade.bias_noise_V, grade.bias_step_V)):
            scaled.append(columns[name] / math.hypot(noise, step / math.sqrt(12.0)))
        return np.concatenate(scaled)

    def of(self, effect_id: str, values: dict[str, float]) -> tuple[float, float]:
        """
        Return the change of the signals by an effect: in all, and beyond the tolerances.

        Both are the root of the sum of squares, in standard deviations of noise.
        """
        neutral = draw_tolerances(0.0, np.random.default_rng(0))
        change = self._signals(neutral, (0.3, -0.2), (effect_id, values)) - self._base
        explained = self._nuisance @ (self._solver @ (self._nuisance.T @ change))
        rest = float(change @ (change - explained))
        return float(np.linalg.norm(change)), math.sqrt(max(rest, 0.0))


def main() -> None:
    """Print the table: each effect at its smallest, middle and largest size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--tolerance', type=float, default=0.02)
    parser.add_argument('--only', default='', help='part of the ids to print')
    parser.add_argument('--family', choices=sorted(FAMILIES), default='a')
    arguments = parser.parse_args()
    study = Study(arguments.tolerance, family=arguments.family)
    forms = FAMILIES[arguments.family]
    print('| effect | range of the size | beyond tolerances: smallest, middle, largest |')
    print('|---|---|---|')
    for effect in (*forms.catalogue.values(), *forms.outside.values()):
        if arguments.only not in effect.key:
            continue
        size = effect.quantities[0]
        cells = []
        for part in (0.0, 0.5, 1.0):
            values = effect.draw(part, np.random.default_rng(3))
            cells.append(f'{study.of(effect.key, values)[1]:.0f}')
        print(f'| {effect.key} | {size.name} {size.low:g} to {size.high:g} {size.unit} '
              f'| {", ".join(cells)} |', flush=True)


if __name__ == '__main__':
    main()
