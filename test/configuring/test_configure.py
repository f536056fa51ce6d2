# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""From a sheet to a configuration: numbers against formulas, the drive against the sheet."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path
import re
import sys
from typing import Any

from antenna_drive.cli import main
from antenna_drive.configuring.derived import derived, kappa, locked_rotor_frequency, mode_scale
from antenna_drive.configuring.proof import checks
from antenna_drive.configuring.sheet import ask, FIGURES, read_sheet, Sheet, written
from antenna_drive.configuring.written import configuration
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import Drive, values
import numpy as np
import pytest
from simgap.inputs.schema import ParameterError

EXAMPLE = Path(__file__).resolve().parents[2] / 'examples' / 'data_sheet.yaml'
REFERENCE = """
motor: {torque_constant: 1.148681, resistance: 0.46, inductance: 12.5 mH,
        rotor_inertia: 748 kg cm^2}
amplifier: {greatest_current: 30.294 A, greatest_voltage: 260 V, current_loop: 35.7779 Hz,
            rate_loop: 1.53329, integral_time: 21.8 ms, lag: 0.0098 s, tachometer: 4.03551 V/krpm}
gear: {ratio: 14868, stiffness: 23.6 N m/rad at the motor, backlash: 0.296 rad at the motor}
axis: {inertia: 1.41e7, first_resonance: RESONANCE}
friction: {slow_rate: 0.01, slow_current: 12.0, fast_rate: 0.5 deg/s, fast_current: 12 A}
bias: {share: 22, circuit: old}
"""


def read(text: str, folder: Path) -> Sheet:
    path = folder / 'sheet.yaml'
    path.write_text(text)
    return read_sheet(path)


def configured(sheet: Sheet, folder: Path) -> Drive:
    path = folder / 'drive.yaml'
    path.write_text(configuration(sheet))
    return load(path)


def secular(hub: float, inertias: Any, frequencies: Any, stiffness: float, omega: float) -> float:
    """Return zero at a resonance of a hub on a spring that carries one-mass oscillators."""
    ratios = (omega / (2.0 * math.pi * np.asarray(frequencies))) ** 2
    return float(stiffness - omega**2 * (hub + (np.asarray(inertias) / (1.0 - ratios)).sum()))


def test_the_lowest_resonance_is_a_root_of_the_secular_equation() -> None:
    hub, inertias, frequencies = 5.0, np.array([2.0, 1.0, 0.5]), np.array([2.2, 3.7, 5.6])
    for stiffness in (10.0, 500.0, 1e5):
        found = 2.0 * math.pi * locked_rotor_frequency(hub, inertias, frequencies, stiffness)
        assert 0.0 < found < 2.0 * math.pi * frequencies[0]
        signs = [np.sign(secular(hub, inertias, frequencies, stiffness, factor * found))
                 for factor in (0.5, 1.0 - 1e-6, 1.0 + 1e-6)]
        assert signs == [1.0, 1.0, -1.0]
        scale = mode_scale(hub, inertias, frequencies, stiffness, 0.4 * found / math.tau)
        assert secular(hub, inertias, scale * frequencies, stiffness,
                       0.4 * found) == pytest.approx(0.0, abs=1e-5 * stiffness)


def test_the_reference_drive_comes_back_from_its_own_figures(tmp_path: Path) -> None:
    wanted = load('old_circuit')
    axis, motor, gearbox = wanted.plant.axis, wanted.motor_1.motor, wanted.motor_1.gearbox
    resonance = locked_rotor_frequency(
        axis.inertia_hub, np.array(axis.mode_inertias), np.array(axis.mode_frequencies),
        2.0 * gearbox.stiffness * axis.gear_ratio**2)
    # a rigid rotor with half of the axis behind the gear, under a proportional rate loop
    inertia = motor.rotor_inertia + 0.5 * 1.41e7 / axis.gear_ratio**2
    amplifier = wanted.motor_1.amplifier
    crossing = (amplifier.rate_gain * amplifier.tach_gain * motor.torque_constant / inertia)
    assert crossing / math.tau == pytest.approx(1.53329, rel=1e-4)
    got = configured(read(REFERENCE.replace('RESONANCE', repr(resonance)), tmp_path), tmp_path)
    for (name, _, value), (_, _, want) in zip(values(got), values(wanted), strict=True):
        if name in ('plant.axis.coulomb_torque', 'motor_1.motor.coulomb_torque',
                    'motor_2.motor.coulomb_torque'):
            # friction of 12 real amperes in place of 11.9997 and so on
            assert value == pytest.approx(want, rel=2e-3), name
        elif not isinstance(want, str):
            assert value == pytest.approx(want, rel=2e-4, abs=1e-12), name


def test_the_example_gives_its_sheet_back(tmp_path: Path) -> None:
    sheet = read_sheet(EXAMPLE)
    drive = configured(sheet, tmp_path)
    found = checks(sheet, drive)
    assert [check.wanted for check in found] == [6.0, 7.5, pytest.approx(20.0), None, None]
    assert all(check.holds for check in found), found
    motor, axis = drive.motor_2, drive.plant.axis
    assert kappa(sheet) == pytest.approx(20.0 / 5.049)
    torque = 8.0 * 0.0254 * 4.4482216  # of one real ampere: pounds times inches
    assert motor.motor.torque_constant == pytest.approx(torque * 20.0 / 5.049, rel=1e-5)
    assert motor.motor.rotor_inertia == pytest.approx(0.006)
    assert motor.gearbox.stiffness == pytest.approx(1e8 / 12000**2, rel=1e-5)
    assert motor.gearbox.half_gap == pytest.approx(math.radians(15 / 3600) * 12000, rel=1e-5)
    assert motor.amplifier.tach_gain == pytest.approx(20.0 / (1000 * math.tau / 60), rel=1e-5)
    assert axis.inertia_hub + sum(axis.mode_inertias) == pytest.approx(9e5, rel=1e-5)
    # a deg/s more needs 2 A more, each of which is a torque at the axis
    assert axis.viscous_friction == pytest.approx(
        2.0 / math.radians(1.0) * torque * 12000, rel=1e-4)


def test_a_proof_finds_a_drive_that_is_not_of_the_sheet(tmp_path: Path) -> None:
    sheet = read_sheet(EXAMPLE)
    drive = configured(sheet, tmp_path)
    other = replace(drive, plant=replace(drive.plant, axis=replace(
        drive.plant.axis, coulomb_torque=1.2 * drive.plant.axis.coulomb_torque)))
    assert [check.holds for check in checks(sheet, other)] == [False, False, True, True, True]


def test_each_number_has_its_source(tmp_path: Path) -> None:
    sheet = read_sheet(EXAMPLE)
    text = configuration(sheet)
    entries = re.findall(r'^  \w+: \{value: ', text, re.MULTILINE)
    sources = re.findall(r'source: "(\w+)', text)
    assert len(entries) == len(sources) > 45
    assert set(sources) == {'sheet', 'derived', 'assumed', 'kept', 'by'}
    assert 'One article A of this drive is 3.96118 real amperes' in text
    for number in derived(sheet):
        assert f'\n  {number.name}: ' in text
    assert max(map(len, text.splitlines())) < 100


def test_the_shaft_makes_no_difference(tmp_path: Path) -> None:
    text = EXAMPLE.read_text()
    other = text.replace('1.0e+8 N m/rad', f'{1e8 / 12000**2!r} N m/rad at the motor').replace(
        '30 arcsec', f'{30 * 12000 / 3600!r} deg at the motor')
    assert other != text
    one, two = read_sheet(EXAMPLE), read(other, tmp_path)
    for first, second in zip(derived(one), derived(two), strict=True):
        assert first.value == pytest.approx(second.value, rel=1e-9), first


@pytest.mark.parametrize(('old', 'new', 'reason'), [
    ('resistance: 0.8 ohm', 'resistence: 0.8', 'did you mean resistance'),
    ('resistance: 0.8 ohm', '', r'motor.resistance: is missing: armature resistance, hot \[ohm\]'),
    ('8.0 lb in/A', '8,0 lb in/A', 'with a decimal point and a unit, such as 1.5 N m/A'),
    ('8.0 lb in/A', '8.0 lb ft/A', 'allowed units are N m/A, lb in/A, oz in/A'),
    ('8.0 lb in/A', '[8.0]', 'motor.torque_constant'),
    ('1.0e+8 N m/rad', '-5 N m/rad at the motor', 'gear.stiffness: .* allowed is from 1e-09'),
    ('20 A', '20000 A', 'amplifier.greatest_current: .* allowed is from 0.51 to 504 A'),
    ('2.0 Hz', '2.9 Hz', 'resonate at 2.37 Hz with the rotors held, even if the structure is'),
    ('7.5 A', '5.5 A', 'friction that falls with the rate is that of creep'),
    ('0.8 deg/s', '0.01 deg/s', 'allowed is a rate above friction.slow_rate'),
    ('120 Hz', '20 Hz', 'the armature alone has 21.2 Hz: give at least that'),
    ('rate_loop: 1.5 Hz', 'rate_loop: 0.06 Hz', 'it is derived|it is assumed'),
    ('circuit: new', 'circuit: newer', 'allowed are old, new'),
    ('motor:', 'motors:', 'did you mean motor'),
])
def test_what_is_wrong_is_said_in_one_line(
        old: str, new: str, reason: str, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    text = EXAMPLE.read_text()
    assert old in text
    path, out = tmp_path / 'sheet.yaml', tmp_path / 'drive.yaml'
    path.write_text(text.replace(old, new, 1))
    assert main(['configure', str(path), '--out', str(out)]) == 2
    said = capsys.readouterr().err
    assert re.search(reason, said), said
    assert said.count('\n') == 1 and str(path) in said
    assert not out.exists()


def test_questions_are_asked_until_the_answer_is_allowed(tmp_path: Path) -> None:
    sheet = read_sheet(EXAMPLE)
    said: list[str] = []
    wrong = {'gear.ratio', 'bias.circuit'}

    def answer(question: str) -> str:
        key = question.partition(':')[0]
        if key in wrong:
            wrong.remove(key)
            return 'much'
        if key == 'bias.circuit':
            return ''
        given = sheet.figures.get(key)
        return '' if given is None else given.written

    found = ask(answer, said.append)
    assert len(said) == 2 and 'gear.ratio' in said[0]
    assert (found.figures, found.circuit) == (sheet.figures, 'new')
    assert read(written(found.figures, found.circuit), tmp_path).figures == sheet.figures


def test_the_command_asks_writes_and_compares(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    sheet = read_sheet(EXAMPLE)
    answers = iter([*(sheet.figures[figure.key].written if figure.key in sheet.figures else ''
                      for figure in FIGURES), ''])
    monkeypatch.setattr('builtins.input', lambda question: next(answers))
    out = tmp_path / 'mine.yaml'
    assert main(['configure', '--out', str(out)]) == 0
    said = capsys.readouterr().out
    assert 'current at 0.05 deg/s, both motors' in said and 'DIFFERS' not in said
    again = tmp_path / 'again.yaml'
    assert main(['configure', str(tmp_path / 'mine.sheet.yaml'), '--out', str(again),
                 '--no-run']) == 0
    numbers = [re.sub('^#.*', '', path.read_text(), flags=re.MULTILINE) for path in (out, again)]
    assert numbers[0] == numbers[1]


def test_a_drive_that_cannot_reach_its_rate_differs(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'sheet.yaml'
    # 12000 times 0.8 deg/s with 0.9 V s/rad is 151 V
    path.write_text(EXAMPLE.read_text().replace('300 V', '100 V'))
    assert main(['configure', str(path), '--out', str(tmp_path / 'mine.yaml')]) == 1
    said = capsys.readouterr()
    assert [line for line in said.out.splitlines() if line.startswith('DIFFERS')] == [
        line for line in said.out.splitlines() if 'current at 0.8 deg/s' in line]
    assert 'the voltage too low' in said.err


def test_nobody_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, 'stdin', open('/dev/null'))
    assert main(['configure', '--out', str(tmp_path / 'mine.yaml')]) == 2
    assert 'motor.torque_constant: no answer' in capsys.readouterr().err


def test_a_template_names_every_figure(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['configure', '--template']) == 0
    text = capsys.readouterr().out
    for figure in FIGURES:
        assert f'  {figure.key.partition(".")[2]}:' in text and figure.what in text
    with pytest.raises(ParameterError, match='motor.torque_constant: is missing'):
        read(text, tmp_path)


def test_the_page_shows_what_the_command_says(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    page = (EXAMPLE.parents[1] / 'docs' / 'your-drive.md').read_text(encoding='utf-8')
    command, _, shown = page.partition('$ antenna-drive ')[2].partition('```')[0].partition('\n')
    (tmp_path / 'examples').mkdir()
    (tmp_path / 'examples' / EXAMPLE.name).write_bytes(EXAMPLE.read_bytes())
    monkeypatch.chdir(tmp_path)
    assert main(command.split()) == 0
    said = capsys.readouterr().out
    for line, wanted in zip(said.splitlines(), shown.splitlines(), strict=True):
        numbers = [[float(word) for word in text.split() if re.fullmatch(r'[\d.]+', word)]
                   for text in (line, wanted)]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-2), wanted
        words = [[word for word in text.split() if not re.fullmatch(r'[\d.]+', word)]
                 for text in (line, wanted)]
        assert words[0] == words[1]
    written_there = (tmp_path / 'my_drive.yaml').read_text()
    assert '  stiffness: {value: 0.694444, unit: N m/rad,' in page and (
        '  stiffness: {value: 0.694444, unit: N m/rad,' in written_there)
    scale = re.search(r'unit: A, scale: ([\d.]+)', page)
    assert scale is not None
    assert float(scale[1]) == pytest.approx(5.049 / 20.0, rel=1e-4)
