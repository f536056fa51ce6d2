# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Which effects a test can and cannot tell apart, before anybody goes to the antenna.

Each effect's derivative is freed of what the offsets within the tolerance could do in its place.
What remains, in standard deviations of the sensors, says how small an effect shows, and the angle
between what remains of two effects says whether one passes for the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from antenna_drive.diagnosis.least_squares import Problem, pull_of
from antenna_drive.diagnosis.machine import FloatArray
from antenna_drive.diagnosis.search import starts
from antenna_drive.machines.antenna.excitation import SheetCommand
from antenna_drive.machines.antenna.field_test import CHANNELS
from antenna_drive.machines.antenna.machine import DriveModel
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import CircuitBias, parse_sheet, Square, TestSheet
import numpy as np
from scipy import linalg

# An effect shows when it takes half a chi-square of this much to do without it.
DETECTABLE = 12.0
# Two effects pass for each other if they share so much of what they do.
ALIKE = 0.95

BUILT_IN: Mapping[str, TestSheet] = {
    name: replace(parse_sheet({'waveform': waveform, 'start': 'rest', 'elevation_deg': elevation,
                               'parameter_tolerance': 0.02}),
                  bias=CircuitBias(start='steady'))
    for name, elevation, waveform in (
        ('square', 45.0, {'type': 'square', 'amplitude_deg_s': 0.05, 'period_s': 6.3,
                          'phase': 0.25}),
        ('triangle', 30.0, {'type': 'triangle', 'amplitude_deg_s': 0.5, 'period_s': 6.0,
                            'phase': 0.0}),
        ('multisine', 60.0, {'type': 'multisine', 'amplitude_deg_s': 0.1,
                             'frequencies_hz': [0.2, 0.5, 0.9, 1.7, 3.1, 5.3],
                             'weights': [0.5, 0.4, 0.3, 0.2, 0.15, 0.1],
                             'phases': [0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 'start_s': 1.0}),
        ('chirp', 60.0, {'type': 'chirp', 'amplitude_deg_s': 0.06, 'f0_hz': 0.1, 'f1_hz': 8.0,
                         'duration_s': 28.0, 'start_s': 1.0}),
    )
}


@dataclass(frozen=True)
class Confusability:
    """
    What a set of tests can tell.

    Attributes
    ----------
    effects : ids, m of them
    detectable : least size that shows, in the unit of the effect's first parameter; infinite if
        none does; shape (m,)
    units : of that size
    alike : share of the squared trace of one effect that another can imitate, shape (m, m)

    """

    effects: tuple[str, ...]
    detectable: FloatArray
    units: tuple[str, ...]
    alike: FloatArray

    def groups(self) -> list[list[str]]:
        """Return the groups of effects that pass for each other."""
        left = set(range(len(self.effects)))
        found = []
        while left:
            group = [min(left)]
            left.discard(group[0])
            for member in group:
                near = [j for j in sorted(left) if self.alike[member, j] > ALIKE]
                group += near
                left -= set(near)
            if len(group) > 1:
                found.append([self.effects[j] for j in group])
        return found

    def separated(self) -> float:
        """Return the share of all pairs of effects that can be told apart."""
        m = len(self.effects)
        pairs = self.alike[np.triu_indices(m, 1)]
        return float(np.mean(pairs < ALIKE)) if pairs.size else 1.0


def planned(sheet: TestSheet, duration: float, rate: float) -> Recording:
    """Return a test that has not been made: its command, and nothing read yet."""
    time = np.arange(int(duration * rate) + 1) / rate
    command = SheetCommand(sheet.waveform or Square(0.05, 6.3, 0.25))
    signals = {'test_signal/rate_command': command(time)}
    signals.update({name: np.zeros(time.size) for name in CHANNELS})
    return Recording.from_arrays(time, signals, sheet=sheet)


def confusability(tests: Mapping[str, Recording], drive: Drive,
                  progress: Callable[[float], None] = lambda share: None,
                  threads: int = 2) -> Confusability:
    """
    Say which effects these tests can tell apart.

    Parameters
    ----------
    tests
        planned or made ones, by name
    drive
        the configuration
    progress
        called with the share that is done
    threads
        simulations at once

    """
    model = DriveModel(tests, drive, threads)
    predicted = model.simulate([{}])[0]
    model.experiments = tuple(
        replace(e, measured=np.asarray(p))
        for e, p in zip(model.experiments, predicted, strict=True))
    problem = Problem(model)
    state = problem.start(model.nuisances, {})
    pull = pull_of(state.parameters)
    factor = linalg.cho_factor(state.hessian + np.diag(pull))
    ids, units, sizes, traces = [], [], [], []
    count = len(model.effects)
    for i, effect in enumerate(model.effects.values()):
        progress(i / count)
        form: Any = effect.forms[0]
        if hasattr(form, 'at'):
            form = form.at(form.orders[min(11, len(form.orders) - 1)])
            model.register(form)
        first = form.parameters[0]
        column = problem.columns({**state.point(), **starts(form)}, [first], state.residual,
                                 central=False)[:, 0]
        cross = state.jacobian.T @ column
        inner = linalg.cho_solve(factor, cross)
        trace = column - state.jacobian @ inner
        power = float(column @ column - cross @ inner)
        ids.append(effect.id)
        units.append(first.unit)
        sizes.append(np.sqrt(2.0 * DETECTABLE / power) if power > 1e-9 else np.inf)
        traces.append(trace)
    matrix = np.array(traces)
    gram = matrix @ matrix.T
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    alike = (gram / np.outer(size, size)) ** 2
    return Confusability(tuple(ids), np.array(sizes), tuple(units), np.asarray(alike))
