# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One test more on the antenna of a sealed case."""

from collections.abc import Mapping
import math
from pathlib import Path
from typing import Any

from lab.antenna.cases import build_machine, make_recording, sheet_of, Truth
from lab.antenna.real_antenna import simulate
from lab.antenna.sensors import COLUMNS
from lab.trials.batch import FORMATS, write_csv
import numpy as np

DURATION_S = 30.0
# probability from which an answer is sure
SURE = 0.9


def known(truth: Truth) -> dict[str, Any]:
    """Return what a tester knows of every test of a case, as a test sheet without a waveform."""
    first = truth['sheets'][0]
    pot = next((sheet['bias']['bias_pot'] for sheet in truth['sheets']
                if 'bias_pot' in sheet['bias']), 0.7)
    return {**{key: first[key] for key in (
        'circuit', 'filter_1', 'start', 'elevation_deg', 'parameter_tolerance')},
        'bias': {'type': 'circuit', 'bias_pot': float(pot), 'start': 'steady'}}


def with_test(truth: Truth, sheet: Mapping[str, Any], place: int,
              duration_s: float = DURATION_S) -> tuple[Truth, int]:
    """
    Return a truth with one test more, and the number of its recording.

    The test has the given sheet but the case's sensors; its noise depends on `place`, from 0.
    """
    first = truth['sheets'][0]
    number = len(truth['sheets']) + place
    longer = {**truth, 'sheets': [*truth['sheets'], *([first] * place),
                                  {**first, **sheet, 'sensors': first['sensors']}]}
    if 'durations_s' in truth:
        longer['durations_s'] = [*truth['durations_s'], *([duration_s] * (place + 1))]
    else:
        longer['duration_s'] = duration_s
    return longer, number


def record_test(truth: Truth, number: int, path: Path) -> None:
    """Simulate a test of a truth and write its recording as CSV."""
    columns = make_recording(truth, number)
    write_csv(path, {key: columns[key] for key in COLUMNS}, FORMATS)


def reached(truth: Truth, number: int) -> dict[str, float]:
    """Return what a test of 30 s reaches on the antenna, in the units of the drive's limits."""
    times = np.linspace(0.0, DURATION_S, int(500 * DURATION_S) + 1)
    history = simulate(build_machine(truth, number), sheet_of(truth, number), times)
    acceleration = np.gradient(history.axis_rate, times)
    return {'rate_deg_s': math.degrees(float(np.abs(history.axis_rate).max())),
            'acceleration_deg_s2': math.degrees(float(np.abs(acceleration).max())),
            'travel_deg': math.degrees(float(np.ptp(history.axis_angle))),
            'current_A': float(np.abs(history.current).max())}
