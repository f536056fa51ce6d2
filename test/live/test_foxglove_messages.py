# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a Foxglove channel says, against the samples behind it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to look at')
pytest.importorskip('foxglove', reason='foxglove-sdk is not installed')

from antenna_drive.emulator.run import simulate  # noqa: E402, I100
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL  # noqa: E402
from antenna_drive.live.foxglove import messages, schema  # noqa: E402
from antenna_drive.live.history import History  # noqa: E402
from antenna_drive.parameters import load  # noqa: E402

RUN = 1795262948317196
UNIT = 'motor_2'


def test_messages_have_the_last_the_least_and_the_greatest_sample() -> None:
    run = simulate(load('new_circuit'), 0.2)
    history = History({unit: len(signals) for unit, signals in OUTPUTS.items()}, TEST_SIGNAL)
    columns, column = {}, 0
    for unit, signals in OUTPUTS.items():
        columns[unit] = slice(column, column + len(signals))
        # the steps 0 to 200, of which the motor has not sent step 39
        kept = np.setdiff1d(np.arange(201), [39] if unit == UNIT else [])
        samples = run.samples[:, columns[unit]].reshape(201, -1)
        header = np.column_stack([
            np.full(201, float(RUN)), np.arange(201), np.full(201, 1e-3), np.full(201, 7.0)])
        history.take(unit, np.column_stack([header, samples])[kept])
        column += len(signals)
    found = dict(messages(history.since(RUN, 0), OUTPUTS[UNIT], columns[UNIT]))
    assert list(found) == [step * 1_000_000 for step in range(9, 200, 10) if step != 39]
    for time_ns, message in found.items():
        last = round(time_ns * 1e-6)
        for name in ('current', 'tach_rate'):
            samples = run[f'{UNIT}/{name}'][last - 9:last + 1]
            assert message[name] == samples[-1]
            assert message['least'][name] == samples.min()
            assert message['greatest'][name] == samples.max()
        # a reader finds every number by the schema, and the other way round
        assert list(message) == list(schema(UNIT, OUTPUTS[UNIT])['properties'])


def test_a_schema_tells_the_units() -> None:
    described = schema(UNIT, OUTPUTS[UNIT])['properties']
    assert described['gear_torque']['description'].endswith('[N m]')
    assert described['tach_rate'] == {'type': 'number',
                                      'description': 'tachometer reading [rad/s]'}
