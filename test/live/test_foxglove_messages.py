# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a Foxglove channel says, against the samples behind it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to look at')
pytest.importorskip('foxglove', reason='foxglove-sdk is not installed')

from antenna_drive.emulator.run import simulate  # noqa: E402, I100
from antenna_drive.emulator.wiring import DRIVE, OUTPUTS  # noqa: E402
from antenna_drive.live.foxglove import messages, schema  # noqa: E402
from antenna_drive.live.history import History  # noqa: E402
from antenna_drive.parameters import load  # noqa: E402

RUN = 1795262948317196
UNIT = 'motor_2'


def test_messages_have_the_last_the_least_and_the_greatest_sample() -> None:
    run = simulate(load('new_circuit'), 0.2)
    history = History(len(DRIVE.signals))
    history.begin(RUN, run.step_s)
    for step in np.setdiff1d(run.steps, [39]).tolist():
        history.take(step, run.samples[step, :, 0])
    first = [name.partition('/')[0] for name in DRIVE.signals].index(UNIT)
    columns = slice(first, first + len(OUTPUTS[UNIT]))
    found = dict(messages(history.since(RUN, 0), OUTPUTS[UNIT], columns))
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
