# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The loop of test, verdict and better test: its order, its end, and how it goes on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from antenna_drive.cli import main
from antenna_drive.diagnosis import investigation
from antenna_drive.diagnosis.drive_limits import DriveLimits
from antenna_drive.diagnosis.investigation import DriveBench, sensed
from antenna_drive.diagnosis.planned_tests import BUILT_IN
from antenna_drive.diagnosis.sensors import SensorModel
from antenna_drive.parameters.loading import load
from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import load_sheet, Sensors
import numpy as np
import pytest
from simgap.errors import UserError
from simgap.next_test import investigation as loop
from simgap.next_test.candidate import Candidate, Proposal
from simgap.next_test.investigation import Investigation, InvestigationPlan, lines
from simgap.next_test.rivals import Findings
from simgap.next_test.space import TestSpace
from simgap.report.render import render
from simgap.search.rival import Rival

DRIVE = load()
LIMITS = DriveLimits.of_drive(DRIVE)
# What the drive of these tests makes probable after each test.
ANSWERS = ({'motor_1.torque_constant': 0.5, 'motors.torque_constant': 0.4, 'unknown': 0.1},
           {'motor_1.torque_constant': 0.7, 'motors.torque_constant': 0.2, 'unknown': 0.1},
           {'motor_1.torque_constant': 0.94, 'unknown': 0.06})


class Laboratory:
    """Stands for the drive, the diagnosis and the design, and counts what they are asked for."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, helps: bool = True,
                 answers: Sequence[Mapping[str, float]] = ANSWERS) -> None:
        self.done: list[str] = []
        self.helps, self.answers = helps, answers
        monkeypatch.setattr(investigation, 'diagnose_recordings', self.diagnose)
        monkeypatch.setattr(loop, 'TestDesign', self.design)

    def note(self, what: str) -> None:
        self.done.append(what)

    def run_test(self, number: int, sheet: Path, duration: float, out: Path) -> None:
        out.write_text('time_s,rate_command_rad_s,encoder_rad\n0.0,0.0,0.0\n0.01,0.0,0.0\n')
        self.note(f'test {number} for {duration:g} s')

    def diagnose(self, recordings: Mapping[str, Any], *rest: Any,
                 earlier: Sequence[Rival]) -> Any:
        self.note(f'diagnosis of {len(recordings)}')
        # what the test before has left open begins where it had ended
        before = self.answers[len(recordings) - 2] if len(recordings) > 1 else {}
        assert [rival.named for rival in earlier] == [
            (name,) for name in before if name != 'unknown']
        # each recording comes with the sheet that was played
        assert all(item.sheet.waveform is not None for item in recordings.values())
        answers = self.answers[len(recordings) - 1]
        rivals = [Rival((name,), (name,), ('',), p, (), np.zeros(0), np.zeros((0, 0))).as_data()
                  for name, p in answers.items() if name != 'unknown']
        return SimpleNamespace(as_data=lambda: {
            'verdict': 'explained', 'confusable': [], 'how_far': {'explained_fraction': {}},
            'which': [{'effects': [name], 'probability': p} for name, p in answers.items()],
            'planning': {'inflation': 1.5, 'rivals': rivals}})

    def design(self, space: TestSpace, findings: Findings, objective: str, **rest: Any) -> Any:
        def search(progress: Any) -> Proposal:
            self.note(f'{objective} {len(findings.rivals)} at {findings.inflated:g}')
            tests = [Candidate('triangle', BUILT_IN['triangle'], {'rate_deg_s': 0.5})]
            return Proposal(objective, 'by hand', (), tests if self.helps else [], {})
        return SimpleNamespace(run=search)


def investigate(folder: Path, lab: Laboratory, **changes: Any) -> dict[str, Any]:
    plan = InvestigationPlan(**{'most': 4, 'until': 0.9, 'duration': 20.0, **changes})
    bench = DriveBench(DRIVE, LIMITS, BUILT_IN['square'], lab.run_test, plan)
    return Investigation(folder, bench, plan).run()


WHOLE = ['detect 0 at 1', 'test 1 for 20 s', 'diagnosis of 1', 'separate 2 at 1.5',
         'test 2 for 20 s', 'diagnosis of 2', 'separate 2 at 1.5', 'test 3 for 20 s',
         'diagnosis of 3']


def test_it_tests_until_an_answer_is_sure(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Laboratory(monkeypatch)
    story = investigate(tmp_path / 'found', lab)
    assert lab.done == WHOLE
    assert story['ended'] == 'decided' and story['seconds_of_testing'] == 60.0
    assert [item['obtained'] for item in story['tests']] == [0.5, 0.7, 0.94]
    assert load_sheet(tmp_path / 'found/test_2.yaml').waveform == BUILT_IN['triangle'].waveform
    assert lines(story)[-1] == 'decided after 3 tests, 60 s of testing'


@pytest.mark.parametrize('named, tests', [
    # sure at once: a second test has to leave it so
    (['a', 'a'], 2),
    # the second test contradicts the first, and is confirmed by a third
    (['a', 'b', 'b'], 3),
    # each test contradicts the one before
    (['a', 'b', 'a', 'b'], 4)])
def test_an_answer_that_a_single_test_made_sure_is_not_decided(
        named: list[str], tests: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = [{name: 0.95, 'unknown': 0.05} for name in named]
    story = investigate(tmp_path, Laboratory(monkeypatch, answers=answers))
    assert len(story['tests']) == tests
    assert story['ended'] == ('decided' if named[-1] == named[-2] else 'no more tests')


def test_it_ends_where_nothing_known_explains_the_gap_twice(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No verdict gives 'unknown' more than 0.8."""
    answers = [{'unknown': 0.64, 'a': 0.36}, {'unknown': 0.79, 'a': 0.21},
               {'unknown': 0.78, 'a': 0.22}]
    story = investigate(tmp_path, Laboratory(monkeypatch, answers=answers))
    assert (story['ended'], len(story['tests'])) == ('nothing known explains it', 2)
    assert 'no effect of the catalogue explains the gap' in lines(story)[-1]
    page = render('story.html', title='a', lead='b', story=story, until=0.9)
    assert 'No effect of the catalogue explains the gap' in page


def test_beside_a_sure_answer_the_next_test_looks_for_others(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Laboratory(monkeypatch, answers=[{'a': 0.93, 'b': 0.02, 'unknown': 0.05}] * 2)
    assert investigate(tmp_path, lab)['ended'] == 'decided'
    assert [what for what in lab.done if 'at' in what] == ['detect 0 at 1', 'detect 2 at 1.5']


@pytest.mark.parametrize('step', range(len(WHOLE)))
def test_interrupted_it_goes_on_where_it_was(
        step: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Laboratory(monkeypatch)
    # the first step of its kind that has not been done yet is the one that is interrupted
    number = WHOLE[:step].count(WHOLE[step])
    asked = [0]
    note = lab.note

    def interrupting(what: str) -> None:
        if what == WHOLE[step]:
            asked[0] += 1
            if asked[0] == number + 1:
                raise KeyboardInterrupt
        note(what)

    lab.note = interrupting  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        investigate(tmp_path, lab)
    assert not list(tmp_path.glob('.test_*'))
    story = investigate(tmp_path, lab)
    assert lab.done == WHOLE
    assert story == json.loads((tmp_path / 'story.json').read_text())


def test_it_ends_with_the_last_test_that_is_allowed_and_may_be_given_more(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Laboratory(monkeypatch)
    assert investigate(tmp_path, lab, most=2)['ended'] == 'no more tests'
    assert lab.done == WHOLE[:6]
    assert investigate(tmp_path, lab, most=3)['ended'] == 'decided'
    assert lab.done == WHOLE


def test_it_ends_where_no_test_helps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    story = investigate(tmp_path, Laboratory(monkeypatch, helps=False))
    assert story['ended'] == 'nothing helps' and not story['tests']


def test_a_folder_of_another_investigation_is_refused(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = Laboratory(monkeypatch)
    investigate(tmp_path, lab)
    with pytest.raises(UserError, match='other settings \\(duration_s\\)'):
        investigate(tmp_path, lab, duration=30.0)


def test_readings_of_an_emulated_drive_get_the_errors_of_sensors() -> None:
    time = np.arange(20000) * 1e-3
    clean = {name: 3.0 * np.sin(time) for name in SIGNALS}
    recording = Recording.from_arrays(time, {RATE_COMMAND: np.sin(time), **clean},
                                      sheet=BUILT_IN['square'])
    sensors = SensorModel.of(Sensors(
        current_noise_A=0.02, current_step_A=0.05, tach_noise_rad_s=0.01, tach_noise_relative=0.0,
        tach_step_rad_s=0.0, encoder_bits=np.log2(2.0 * np.pi / 1e-3), bias_noise_V=0.0))
    found = sensed(recording, sensors, [1, 2])
    assert found.sheet == BUILT_IN['square']
    assert found[RATE_COMMAND].values == pytest.approx(np.sin(time[::5]))
    off = {name: found[name].values - 3.0 * np.sin(time[::5]) for name in SIGNALS}
    # n = 4000 samples: their deviation is known to 1.2 percent
    assert off['motor_1/ammeter'].std() == pytest.approx(
        np.hypot(0.02, 0.05 / np.sqrt(12.0)), rel=0.05)
    assert off['motor_2/tach_rate'].std() == pytest.approx(0.01, rel=0.05)
    assert np.abs(off['plant/encoder']).max() <= 0.5001e-3
    counts = found['motor_1/ammeter'].values / 0.05
    assert counts == pytest.approx(np.round(counts), abs=1e-6)


def test_the_page_tells_the_story(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    story = investigate(tmp_path, Laboratory(monkeypatch))
    page = render('story.html', title='a', lead='b', story=story, until=0.9)
    assert '<b>motor_1.torque_constant</b>' in page and 'Test 3: triangle' in page
    assert '60 s of testing' in page


@pytest.mark.parametrize('words, refusal', [
    ('run {out}', '{sheet} is missing'),
    ('/no/such/program {sheet} {out}', 'No such file'),
    ("sh -c 'echo the brake is on >&2; exit 3' {sheet} {out}",
     'exit code 3, no recording; the brake is on')])
def test_a_command_that_fails_says_why(
        words: str, refusal: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    Laboratory(monkeypatch)
    assert main(['investigate', '--out', str(tmp_path / 'found'), '--by', words]) == 2
    assert refusal in capsys.readouterr().err


def test_a_command_runs_the_tests(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    Laboratory(monkeypatch)
    (tmp_path / 'recorded.csv').write_text(
        'time_s,rate_command_rad_s,encoder_rad\n0.0,0.0,0.0\n0.01,0.0,0.0\n')
    assert main(['investigate', '--out', str(tmp_path / 'found'), '--by',
                 f"sh -c 'test -s {{sheet}} && cp {tmp_path / 'recorded.csv'} {{out}} && "
                 f"echo {{number}} >> {tmp_path / 'numbers'}'"]) == 0
    assert (tmp_path / 'numbers').read_text().split() == ['1', '2', '3']
    assert 'decided after 3 tests, 90 s of testing' in capsys.readouterr().out
    assert (tmp_path / 'found/story.html').exists()
