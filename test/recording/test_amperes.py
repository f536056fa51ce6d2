# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Article amperes are never a plain A, and real ones can be had beside them."""

from __future__ import annotations

from pathlib import Path
import re

from antenna_drive.cli import main
from antenna_drive.diagnosis.catalogue import catalogue
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import values
from antenna_drive.readings import READINGS
from antenna_drive.recording.csv_format import read_csv, write_csv
from antenna_drive.recording.panels import with_real_amperes
from antenna_drive.recording.recording import Recording
import numpy as np
import pytest
from simgap.logs.channel import Channel, RecordingError

ROOT = Path(__file__).resolve().parents[2]
# An A that stands alone or in a quotient, and no word says whose it is.
PLAIN = re.compile(r'(?<!article )(?<!real )\bA\b')
CONFIGURATION = {'motor_1': {'armature.physical_amperes_per_article_ampere': 6.0}}


def recording(**configuration: object) -> Recording:
    time = np.linspace(0.0, 1.0, 11)
    return Recording.from_arrays(time, {'motor_1/current': time - 0.5, 'plant/encoder': time},
                                 configuration=configuration)


def test_no_unit_is_a_plain_ampere() -> None:
    units = [signal.unit for signals in OUTPUTS.values() for signal in signals]
    units += [entry.unit for _, entry, _ in values(load())]
    units += [reading.unit for reading in READINGS]
    units += [number.unit for effect in catalogue().values() for form in effect.forms
              for number in form.parameters]
    assert len([unit for unit in units if 'article A' in unit]) > 20
    assert [unit for unit in units if PLAIN.search(unit)] == []


@pytest.mark.parametrize('path', sorted(
    [*ROOT.glob('config/*.*'), *ROOT.glob('docs/*.md')]), ids=lambda path: path.name)
def test_no_file_that_people_read_has_a_current_in_plain_amperes(path: Path) -> None:
    text = path.read_text(encoding='utf-8')
    # the unit of a column of somebody else's file is a real ampere, and a scale stands beside it
    text = re.sub(r'\{column: [^}]*\}', '', text)
    units = re.findall(r'(?:unit: |\[)([^],\[\n]*)|\| ([^|\n]*) \|', text)
    assert [unit for pair in units for unit in pair if re.fullmatch(
        r'(?:(?:V|N m)/)?A(?:/V)?', unit.strip())] == []


def test_what_was_written_in_plain_amperes_is_read_as_article_amperes(tmp_path: Path) -> None:
    (tmp_path / 'old.csv').write_text('time_s,motor_1/current [A],wind/current [A]\n0,1,2\n')
    found = read_csv(tmp_path / 'old.csv')
    assert (found['motor_1/current'].unit, found['wind/current'].unit) == ('article A', 'A')
    (tmp_path / 'old.yaml').write_text('motor: {current_limit: {value: 4.0, unit: A}}\n'
                                       'amplifier: {rate_gain: {value: 3.0, unit: A/V}}\n')
    assert load(tmp_path / 'old.yaml').motor_1.motor.current_limit == 4.0


def test_real_amperes_stand_beside_article_amperes(tmp_path: Path) -> None:
    shown = with_real_amperes(recording(**CONFIGURATION), ['motor_1/current', 'plant/encoder'])
    assert shown.names == ('motor_1/current', 'motor_1/real_current', 'plant/encoder')
    assert shown['motor_1/real_current'].unit == 'real A'
    assert shown['motor_1/real_current'].values == pytest.approx(
        6.0 * shown['motor_1/current'].values)
    with pytest.raises(RecordingError, match='no configuration'):
        with_real_amperes(recording(), ['motor_1/current'])
    with pytest.raises(RecordingError, match='no current among the signals'):
        with_real_amperes(recording(**CONFIGURATION), ['plant/encoder'])


def test_a_column_of_real_amperes_is_written_and_read_back(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_csv(recording(**CONFIGURATION), tmp_path / 'run.csv')
    arguments = ['export', str(tmp_path / 'run.csv'), str(tmp_path / 'out.csv'), '--real-amperes']
    assert main(arguments) == 0
    header, first = (tmp_path / 'out.csv').read_text().splitlines()[:2]
    assert header == ('time_s,motor_1/current [article A],motor_1/real_current [real A],'
                      'plant/encoder [rad]')
    assert first == '0.0,-0.5,-3.0,0.0'
    assert read_csv(tmp_path / 'out.csv')['motor_1/real_current'] == Channel(
        'real A', read_csv(tmp_path / 'run.csv')['motor_1/current'].time_ns,
        6.0 * (np.linspace(0.0, 1.0, 11) - 0.5))
    assert main([*arguments, '--field']) == 2
    assert 'does not go with --field' in capsys.readouterr().err
