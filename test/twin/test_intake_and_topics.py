# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What comes in: samples, their stamps, and the map from topics to signals."""

import math
from pathlib import Path

from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.sheet import TestSheet as Sheet
from antenna_drive.twin.intake import Intake
from antenna_drive.twin.topics import load_topics, own_topics
import pytest
from simgap.errors import UserError

TACH = 'motor_1/tach_rate'


def test_rubbish_is_counted_by_name_and_left_out() -> None:
    intake = Intake()
    for value in (math.nan, math.inf, -math.inf, 1e9):
        assert not intake.put(TACH, 0, value)
    assert intake.put(TACH, 10, 1.0)
    assert not intake.put(TACH, 10, 1.0)
    assert not intake.put(TACH, 9, 1.0)
    assert intake.rubbish == {(TACH, 'not a number'): 1, (TACH, 'infinite'): 2,
                              (TACH, 'out of range'): 1, (TACH, 'late or repeated'): 2}
    stamps, values = intake.new(TACH)
    assert list(stamps) == [10]
    assert list(values) == [1.0]
    assert not intake.new(TACH)[0].size


def test_jump_of_time_and_a_hole_begin_another_stretch() -> None:
    intake = Intake()
    intake.put(RATE_COMMAND, 10 * 10**9, 0.0)
    intake.put(TACH, 10 * 10**9, 0.0)
    intake.put(RATE_COMMAND, 2 * 10**9, 0.0)
    assert intake.stretch == 1
    assert intake.jumps == ['the time jumped back by 8 s']
    intake.put(RATE_COMMAND, 3 * 10**9, 0.0)
    assert intake.stretch == 2
    assert 'no test_signal/rate_command for 1 s' in intake.jumps[1]
    # a reading that is missing for a while is told, but nothing begins anew
    intake.put(TACH, 3 * 10**9, 0.0)
    intake.put(TACH, 9 * 10**9, 0.0)
    assert intake.stretch == 2


def test_last_minutes_are_kept_and_make_a_recording() -> None:
    intake = Intake(keep_s=10.0)
    for k in range(3000):
        intake.put(RATE_COMMAND, k * 10**7, 1e-4)
        intake.put(TACH, k * 10**7 + 1000, float(k))
        if k % 100 == 99:
            intake.new(RATE_COMMAND)
            intake.new(TACH)
            intake.forget()
    recording = intake.recording(Sheet())
    assert 10.0 <= (recording[TACH].time_ns[-1] - recording[TACH].time_ns[0]) / 1e9 <= 20.0
    assert recording[TACH].values[-1] == 2999.0
    assert recording[RATE_COMMAND].time_ns[0] == 0


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / 'map.yaml'
    path.write_text(text, encoding='utf-8')
    return path


def test_map_of_topics_has_units_signs_and_vectors(tmp_path: Path) -> None:
    topics = load_topics(write(tmp_path, """
time: {column: /acu/row, index: 0, unit: ms, offset_s: 1.0}
signals:
  rate_command_rad_s: {column: /acu/row, index: 1, unit: mdeg/s, sign: -1}
  motor_1/ammeter: {column: /acu/row, index: 2, unit: mA, scale: 0.5, offset: 10}
  motor_2/ammeter: {expression: "column('/acu/row')[2] + column('/acu/row')[3]", unit: A}
"""))
    topic, = topics.topics
    assert (topic.name, topic.vector) == ('/acu/row', True)
    samples = topics.read(topic, (2500.0, 180.0, 200.0, 1.0), 7, 8)
    assert {stamp for _, stamp, _ in samples} == {3_500_000_000}
    assert {name: value for name, _, value in samples} == pytest.approx({
        RATE_COMMAND: -math.pi * 1e-3, 'motor_1/ammeter': 0.11, 'motor_2/ammeter': 201.0})
    short = topics.read(topic, (2500.0, 180.0), 7, 8)
    assert [name for name, _, value in short if math.isnan(value)] == [
        'motor_1/ammeter', 'motor_2/ammeter']
    assert not topics.read(topic, (math.nan, 1.0, 1.0, 1.0), 7, 8)


def test_own_topics_are_those_of_a_drive_in_a_namespace() -> None:
    topics = own_topics('/elevation')
    assert {topic.name for topic in topics.topics} > {
        '/elevation/test_signal/rate_command', '/elevation/plant/encoder'}
    topic = topics.topics[0]
    assert topics.read(topic, (0.5,), 7, 8) == [(RATE_COMMAND, 7, 0.5)]
    assert {item.name for item in own_topics().topics} > {RATE_COMMAND}


@pytest.mark.parametrize(('text', 'said'), [
    ('signals: {motor_1/ammeter: {column: /i}}', 'rate_command is missing'),
    ('signals: {rate_command_rad_s: {column: /c}}', 'nothing to compare'),
    ('signals: {rate_command_rad_s: {column: /c}, plant/axis_angle: {column: /a}}',
     'plant/axis_angle: a twin compares'),
    ('signals: {rate_command_rad_s: {column: /c}, plant/encoder: {column: /c, index: 1}}',
     'index says which'),
    ('time: {column: /t, index: 0}\n'
     'signals: {rate_command_rad_s: {column: /c}, plant/encoder: {column: /e}}',
     'every signal has to come from there'),
    ('time: {column: /t, index: -1}\nsignals: {}', 'time.index'),
    ('time: {column: source, unit: iso8601}\n'
     'signals: {rate_command_rad_s: {column: /c}, plant/encoder: {column: /e}}', 'time.unit'),
    ('signals: {rate_command_rad_s: {column: /c, unit: furlong}}', 'rate_command_rad_s.unit'),
    ('- 1', 'map.yaml'),
])
def test_wrong_map_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(UserError, match='map.yaml') as refused:
        load_topics(write(tmp_path, text))
    assert said in str(refused.value)
    assert '\n' not in str(refused.value)
