# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The worked example: a real ball-screw axis, and what the model of its authors lacks.

The recordings are no part of the repository; ANTENNA_DRIVE_EMPS names the folder that holds them.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from simgap.model import check_model, diagnose_logs, load_model, Log, Model, read_log, unseen
from simgap.verdict.record import Verdict

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get('ANTENNA_DRIVE_EMPS', ROOT.parent / 'shared' / 'data' / 'emps'))
pytestmark = pytest.mark.skipif(
    not (DATA / 'emps.csv').is_file(),
    reason='the EMPS recordings are not there; ANTENNA_DRIVE_EMPS names their folder')
# With a recorded pulse of 5 the recorded output of the controller steps by 5.07 V.
VOLT_PER_RECORDED, FORCE_PER_VOLT = 1.0139, 35.15


@pytest.fixture(scope='module')
def model() -> Model:
    return load_model(str(ROOT / 'examples' / 'emps' / 'machine.py'))


@pytest.fixture(scope='module')
def plain(model: Model) -> Verdict:
    return diagnose_logs(model, [read_log(DATA / 'emps.csv')])


def test_nothing_is_wrong_with_the_model(model: Model) -> None:
    assert check_model(model, [read_log(DATA / 'emps.csv')]).faults == []


@pytest.mark.slow
def test_the_asymmetric_friction_is_named(plain: Verdict) -> None:
    named = next(entry for entry in plain.which if entry.effects != ['unknown'])
    assert 'guide.friction_asymmetry' in named.effects
    asymmetry = named.parameters['guide.friction_asymmetry.viscous_asymmetry']
    assert asymmetry['ci95'][1] < -0.05  # more drag on the way back


def test_the_recording_that_was_not_fitted_is_predicted_better(plain: Verdict) -> None:
    """At least 30 percent below the authors' symmetric model, as published and as fitted."""
    log = read_log(DATA / 'emps_pulses.csv')
    added = VOLT_PER_RECORDED * log['force_pulses_N']
    error = unseen(plain, Log(log.name, log.time, {**log.columns, 'added_V': added}))['position']
    assert error.after < 0.7 * min(error.configured, error.before)


@pytest.mark.slow
def test_the_hidden_pulses_are_found(model: Model) -> None:
    """A force, when and how large: 20 of 24 within 50 ms, sizes within 15 percent."""
    log = read_log(DATA / 'emps_pulses.csv')
    truth = log['force_pulses_N']
    rises = log.time[np.flatnonzero(np.diff(truth) > 0.0) + 1]
    falls = log.time[np.flatnonzero(np.diff(truth) < 0.0) + 1]
    hidden = Log(log.name, log.time, {name: values for name, values in log.columns.items()
                                      if name in ('reference_m', 'position_m')})
    found = diagnose_logs(model, [hidden]).as_data()
    assert found['verdict'] in ('unknown_effect', 'partly_explained')
    assert found['may_enter_at'][0]['name'] == 'force'
    begins = np.array([item['from_s'] for item in found['pushes']])
    ends = np.array([item['until_s'] for item in found['pushes']])
    assert begins.size <= 25  # the last one has no end
    hit = [np.abs(begins - rise).min() < 0.05 and np.abs(ends - fall).min() < 0.05
           for rise, fall in zip(rises, falls, strict=False)]
    assert len(hit) == 24 and sum(hit) >= 20
    sizes = np.array([item['size'] for item in found['pushes']])
    assert sizes == pytest.approx(FORCE_PER_VOLT * truth.max(), rel=0.15)
