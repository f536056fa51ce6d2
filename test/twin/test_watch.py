# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The twin beside the independent antenna, in simulated time."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

from antenna_drive.parameters.loading import load
from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.sheet import parse_sheet
from antenna_drive.twin import watch
from antenna_drive.twin.baseline import Baseline
from antenna_drive.twin.tuned import tuned
from antenna_drive.twin.watch import Twin, TwinSettings
from lab.antenna.effects import CATALOGUE
from lab.campaign.twin_proving import played
from lab.trials import onset
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: nobody to report to')

from antenna_drive.nodes.twin_node import told  # noqa: E402, I100
from diagnostic_msgs.msg import DiagnosticStatus  # noqa: E402

pytestmark = pytest.mark.slow
# A shorter quiet record than usual, to save the machine's time.
BRIEF = TwinSettings(quiet_s=40.0)
ONSET_S, END_S = 75.0, 92.0


@cache
def case(effect: str = '', size: float = 0.6, onset_s: float = ONSET_S,
         ) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return recording and sheet of a triangle test; an effect is switched on in the middle."""
    number = 0
    while True:
        number += 1
        truth = onset.draw_truths(number, 41, 0.02)[-1]
        if truth['sheets'][0]['waveform']['type'] == 'triangle':
            break
    truth.update(onset_s=onset_s, duration_s=END_S, effects=[])
    if effect:
        random = np.random.default_rng(1)
        truth['effects'] = [{'id': effect, 'parameters': CATALOGUE[effect].draw(size, random)}]
    else:
        truth['onset_s'] = END_S
    return onset.make_recording(truth), truth['sheets'][0]


def states(twin: Twin, columns: dict[str, Any]) -> list[tuple[float, str]]:
    """Play a recording; return when the twin began to say what."""
    found: list[tuple[float, str]] = []
    for time in played(twin, columns):
        if not found or found[-1][1] != twin.state:
            found.append((time, twin.state))
    return found


def new_twin(sheet: dict[str, Any], baseline: Baseline | None = None, tune: bool = True) -> Twin:
    return Twin(load(), parse_sheet(sheet), BRIEF, baseline, tuned if tune else None)


@pytest.fixture(scope='module')
def learned() -> Twin:
    """Return a twin that has watched a healthy drive."""
    columns, sheet = case()
    twin = new_twin(sheet)
    found = states(twin, columns)
    assert [word for _, word in found if word != watch.WAITING] == [
        watch.SETTLING, watch.LEARNING, watch.OK]
    assert twin.tuned == 'tuned to the quiet record'
    return twin


def test_twin_of_a_healthy_antenna_is_near_its_noise(learned: Twin) -> None:
    # the sheet's noise is 0.01 A, the recorder's up to 2.5 times that; the tolerances alone put
    # the configuration of the drawing 0.15 A away
    assert learned.judge.baseline is not None
    for motor in ('motor_1', 'motor_2'):
        assert learned.judge.baseline.signals[f'{motor}/ammeter'].sigma < 0.035


@pytest.mark.parametrize('effect', ['motor_2.viscous_friction', 'axis.wind_steady',
                                    'current_1.gain', 'encoder.offset'])
def test_effect_is_told_soon_and_dated(learned: Twin, effect: str) -> None:
    columns, sheet = case(effect)
    twin = Twin(learned.drive, parse_sheet(sheet), BRIEF, learned.judge.baseline)
    told = next(time for time in played(twin, columns) if twin.state == watch.GAP)
    assert ONSET_S < told < ONSET_S + 10.0
    gaps = twin.gaps()
    assert abs(min(gap.since_ns for gap in gaps) / 1e9 - ONSET_S) < 2.5
    assert all(gap.unit and abs(gap.sigma) > 1.0 for gap in gaps)
    if effect == 'current_1.gain':
        assert gaps[0].name == 'motor_1/ammeter'


@pytest.mark.parametrize(('effect', 'signal'), [
    ('gearbox_2.stiffness', 'motor_2/tach_rate'), ('current_1.gain', 'motor_1/ammeter')])
def test_a_fault_that_was_there_before_is_not_taken_for_health(effect: str, signal: str) -> None:
    """The twin learns it, and then says that no tolerance explains it."""
    columns, sheet = case(effect, onset_s=0.1)
    twin = new_twin(sheet)
    found = [word for _, word in states(twin, columns)]
    assert found[-1] == watch.OUTSIDE
    assert watch.OK not in found
    assert twin.outside is not None
    assert any(line.startswith(f'{signal}: ') and ' times its noise' in line
               for line in twin.outside)
    level, message, values = told(twin)
    assert level == DiagnosticStatus.WARN
    assert twin.outside[0] in message
    assert 'agree' not in message
    assert dict(values)['tolerances'] == '; '.join(twin.outside)


def test_nobody_agrees_beside_a_verdict_or_before_a_comparison(learned: Twin) -> None:
    columns, sheet = case()
    assert told(learned)[:2] == (DiagnosticStatus.OK, 'ok: the drive and its twin agree')
    level, message, _ = told(learned, 'gearbox_2.stiffness')
    assert level == DiagnosticStatus.WARN
    assert message == 'the drive is as in its quiet record, but the verdict is gearbox_2.stiffness'
    twin = new_twin(sheet, tune=False)
    assert states(twin, columns)[-1][1] == watch.OK
    assert 'was not compared with the configuration' in told(twin)[1]
    assert 'agree' not in told(twin)[1]
    kept = Twin(learned.drive, parse_sheet(sheet), BRIEF, learned.judge.baseline,
                outside=('motor_1/ammeter: 1 A rms, 9 times its noise',))
    assert states(kept, columns)[-1][1] == watch.OUTSIDE


def test_quiet_record_goes_through_a_file(learned: Twin) -> None:
    assert learned.judge.baseline is not None
    again = Baseline.of_plain(learned.judge.baseline.plain())
    assert again.plain() == learned.judge.baseline.plain()


def test_stretch_of_rubbish_is_named_and_forgotten(learned: Twin) -> None:
    columns, sheet = case()
    columns = {name: values.copy() for name, values in columns.items()}
    time = columns['time_s']
    columns['current_1_A'][(time > 30.0) & (time < 33.0)] = np.nan
    columns['encoder_rad'][(time > 40.0) & (time < 43.0)] = 1e30
    twin = Twin(learned.drive, parse_sheet(sheet), BRIEF, learned.judge.baseline)
    bad: dict[str, set[str]] = {}
    last = ''
    for now in played(twin, columns):
        if twin.state == watch.BAD_INPUT:
            for name, what in twin.bad_signals().items():
                bad.setdefault(name, set()).add(what.partition(' samples ')[2] or what)
        last = twin.state
        assert now > 0.0
    assert 'not a number' in bad['motor_1/ammeter']
    assert 'out of range' in bad['plant/encoder']
    assert set(bad) == {'motor_1/ammeter', 'plant/encoder'}
    assert last == watch.OK


def test_jump_of_time_begins_anew_and_goes_on(learned: Twin) -> None:
    columns, sheet = case()
    time = columns['time_s']
    moved = np.where(time > 40.0, time - 300.0, time)
    twin = Twin(learned.drive, parse_sheet(sheet), BRIEF, learned.judge.baseline)
    names = [name for name in columns if name != 'time_s']
    found: list[str] = []
    for k, stamp in enumerate(moved.tolist()):
        for name in names:
            twin.put(FIELD_COLUMNS[name], int(stamp * 1e9), float(columns[name][k]))
        if k % 20 == 0:
            twin.advance()
            if not found or found[-1] != twin.state:
                found.append(twin.state)
    assert 'jumped back by 300 s' in twin.intake.jumps[0]
    assert found[-1] == watch.OK
    assert found.count(watch.SETTLING) == 2
    assert watch.GAP not in found


def test_drive_that_stops_is_stale_and_comes_back(learned: Twin) -> None:
    columns, sheet = case()
    twin = Twin(learned.drive, parse_sheet(sheet), BRIEF, learned.judge.baseline)
    assert twin.state == watch.WAITING
    pieces = played(twin, columns)
    while next(pieces) < 20.0:
        pass
    twin.advance(now_s=100.0)
    assert twin.state == watch.OK
    twin.advance(now_s=103.0)
    assert twin.state == watch.STALE
    next(pieces)
    twin.advance(now_s=104.0)
    assert twin.state == watch.OK


def test_motion_beyond_the_quiet_record_is_not_judged(learned: Twin) -> None:
    columns, sheet = case('axis.wind_steady')
    assert learned.judge.baseline is not None
    narrow = replace(learned.judge.baseline, envelope=(1e-6, 1e-6))
    twin = Twin(learned.drive, parse_sheet(sheet), BRIEF, narrow)
    assert watch.GAP not in [word for _, word in states(twin, columns)]
    assert twin.judge.unjudged == twin.judge.blocks > 60
