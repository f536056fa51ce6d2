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
A test in which the antenna changes: what a twin has to notice.

Each machine goes on from the state that the one before has left, with the same command. Moments
of effects (a load that shifts, the phase of a gust) count from the machine's own beginning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
import math
from typing import Any

from antenna_drive.trial import equations, integrator
from antenna_drive.trial.machine import Records
from antenna_drive.trial.real_antenna import (
    FloatArray, History, history_of, input_edges, SimulationError, start_state, state_sizes,
    TOLERANCE,
)
from antenna_drive.trial.sheet import CaseSheet
import numpy as np
from numpy.typing import NDArray


def simulate_changes(stretches: Sequence[tuple[Records, float]], sheet: CaseSheet,
                     times: FloatArray, place: tuple[float, float] = (0.0, 0.0)) -> History:
    """
    Simulate one test from rest, with one machine after the other.

    Parameters
    ----------
    stretches
        each machine, and the time at which its part ends [s]; the last part goes on to the last
        of `times`
    sheet
        the test
    times
        of the signals, ascending, from 0 on, shape (n,) [s]
    place
        position of each motor in its gap at the start, -1 to 1

    Raises
    ------
    SimulationError : the integration failed

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
             times: FloatArray, length: float) -> History:
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


def _joined(parts: Sequence[History]) -> History:
    values: dict[str, Any] = {}
    for item in fields(History):
        own = [getattr(part, item.name) for part in parts]
        axis = 0 if item.name == 'state' else -1
        values[item.name] = sum(own) if isinstance(own[0], int) else np.concatenate(own, axis)
    return History(**values)
