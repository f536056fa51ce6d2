# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One table of readings: a new reading is one row, and no other file lists them."""

from __future__ import annotations

import json
from pathlib import Path
import subprocess
import sys

from antenna_drive import readings
from antenna_drive.readings import FIELD_COLUMNS, READINGS, SIGNALS
from antenna_drive.recording.recording import unit_of
import pytest

TABLE = Path(readings.__file__)
HOUSE = TABLE.parent
# A gyroscope on the axis: what it does, and its row.
GYROSCOPE = """
    Reading('gyro', 'plant/axis_rate', 'axis_rate_rad_s', 'rad/s', 'gyroscope', Sensor(
        lambda true, noise: Errors(noise, 0.0, 2.0 * noise),
        (SheetNumber('gyro_noise_rad_s', Entry('rad/s', 0.0), 1.0),), 1e-7, 0.1)),
)

NAMED"""
SCRIPT = """
import json, sys, types

table = sys.modules['antenna_drive.readings'] = types.ModuleType('antenna_drive.readings')
exec(sys.stdin.read(), table.__dict__)

from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.diagnosis.planned_tests import BUILT_IN, planned
from antenna_drive.parameters import load
from antenna_drive.recording.csv_format import read_csv, write_csv
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import parse_sheet, sheet_tree
from antenna_drive.twin.topics import own_topics

sheet = parse_sheet({**sheet_tree(BUILT_IN['square']), 'sensors': {'gyro_noise_rad_s': 1e-6}})
test = planned(sheet, 4.0, 70.0)
values = AntennaMachine({'plan': test}, load()).predict({}, 0)
values[:, table.AT['gyro']] += 3e-6
command = test[table.RATE_COMMAND]
write_csv(Recording.from_arrays(command.time_s, {
    table.RATE_COMMAND: command.values, **dict(zip(table.SIGNALS, values.T))}, sheet=sheet),
    sys.argv[1], field=True)
machine = AntennaMachine({'rec': read_csv(sys.argv[1])}, load())
experiment, column = machine.experiments[0], table.AT['gyro']
residual = (experiment.measured - machine.predict({}, 0))[:, column]
print(json.dumps({
    'channel': experiment.channels[column], 'unit': experiment.units[column],
    'residual': residual.tolist(), 'noise': experiment.noise[:, column].tolist(),
    'zero': [item.high for item in machine.nuisances if item.name == 'zero:gyro:rec'],
    'topics': [topic.name for topic in own_topics().topics]}))
"""


@pytest.mark.slow
def test_a_new_reading_is_one_row(tmp_path: Path) -> None:
    """It comes from its column, with the sheet's noise, into the residual and the twin."""
    table = TABLE.read_text(encoding='utf-8')
    assert table.count('\n)\n\nNAMED') == 1
    found = subprocess.run(
        [sys.executable, '-c', SCRIPT, str(tmp_path / 'rec.csv')], check=True, text=True,
        input=table.replace('\n)\n\nNAMED', GYROSCOPE), stdout=subprocess.PIPE).stdout
    said = json.loads(found)
    assert (said['channel'], said['unit']) == ('gyro', 'rad/s')
    heading = (tmp_path / 'rec.csv').read_text(encoding='utf-8').partition('\n')[0]
    assert heading == ','.join(['time_s', *FIELD_COLUMNS, 'axis_rate_rad_s'])
    assert 'gyro_noise_rad_s: 1.0e-06' in (tmp_path / 'rec.yaml').read_text(encoding='utf-8')
    assert said['residual'] == pytest.approx([3e-6] * len(said['residual']), abs=1e-9)
    # twice the noise, as its sensor says, and what the jitter of the time stamps adds
    assert min(said['noise']) == pytest.approx(2e-6, rel=0.1)
    assert said['zero'] == [2e-6]
    assert said['topics'][-1] == 'plant/axis_rate'


def test_units_are_those_of_the_signals() -> None:
    """The table and the drive agree."""
    assert {reading.signal: reading.unit for reading in READINGS} == {
        signal: unit_of(signal) for signal in SIGNALS}


def test_no_other_file_lists_the_readings() -> None:
    """Columns of a CSV stand in the table alone; pages and figures alone choose signals."""
    for path in HOUSE.rglob('*'):
        if path.suffix not in ('.py', '.js', '.html', '.yaml') or path == TABLE:
            continue
        text = path.read_text(encoding='utf-8')
        assert [name for name in FIELD_COLUMNS if name in text] == [], path
        if path.relative_to(HOUSE).parts[0] not in ('article', 'cli', 'live', 'pages'):
            assert [name for name in SIGNALS if f"'{name}'" in text] == [], path
