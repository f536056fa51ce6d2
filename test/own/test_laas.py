# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A real motor that cogs, with a current against it for a while: lab/notebook/laas.md."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from simgap.model import diagnose_logs, load_model, Log, read_logs, unseen

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / 'examples' / 'laas_motor'
DATA = Path(os.environ.get(
    'ANTENNA_DRIVE_LAAS', ROOT.parent / 'shared' / 'data' / 'laas_anti_cogging'))
pytestmark = [pytest.mark.skipif(
    not (DATA / 'map.csv').is_file(), reason='the logs of LAAS are not here'), pytest.mark.slow]


def part(file: str, flag: int) -> Log:
    """Return the last three quarters of that part of a speed test that has a flag."""
    [log] = read_logs([str(DATA / f'speed_{file}.csv')], EXAMPLE / f'flag_{flag}.yaml')
    begin = log.time.size // 4
    return Log(log.name, log.time[begin:], {
        name: values[begin:] for name, values in log.columns.items()})


def test_the_current_that_is_added_is_the_map_that_was_measured_at_rest() -> None:
    """The flag means one thing in a file, and the opposite in the other."""
    found = diagnose_logs(load_model(f'{EXAMPLE}/machine.py:controller'), [part('a', 0)])
    law = found.may_enter_at[0].law
    assert found.word == 'unknown_effect' and law is not None
    assert law.by == 'position within a turn'
    assert [order for order, _ in law.waves()[:6]] == [72, 18, 12, 144, 24, 36]
    # 7200 places in a turn [A]
    measured = np.loadtxt(DATA / 'map.csv', delimiter=',', skiprows=1)[:, 1]
    added = np.interp(2.0 * np.pi * np.arange(measured.size) / measured.size, law.at, law.values)
    assert np.corrcoef(added, measured)[0, 1] > 0.98
    with_it, without = (unseen(found, part('b', flag))['current'] for flag in (1, 0))
    assert with_it.lawful is not None and with_it.lawful < 0.3 * with_it.after
    assert without.lawful is not None and without.lawful > 5.0 * without.after


def test_the_torque_by_angle_predicts_the_speed_of_another_log() -> None:
    """As well as the feed-forward of LAAS does: 1.35 and 1.62 (rad/s)^2 are left there."""
    found = diagnose_logs(load_model(f'{EXAMPLE}/machine.py:motor'), [part('a', 1)])
    law = found.may_enter_at[0].law
    assert law is not None and found.may_enter_at[0].name == 'torque on the rotor'
    assert found.where[0]['component'] == 'motor'
    order, size = law.waves()[0]
    assert order == 72 and 0.15 < size < 0.25
    speed = unseen(found, part('b', 0))['speed']
    assert speed.lawful is not None and speed.after ** 2 > 9.0 and speed.lawful ** 2 < 2.5
