# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What `simgap inspect` says of a recording, and the map that it writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recording.test_others_recordings import (
    close, EFFORT, ELBOW, JOINTS, STAMPS, TIME, torques, write_json_mcap, write_protobuf_mcap,
    write_rosbag2,
)
from rosbags.rosbag2 import StoragePlugin
from scipy.io import savemat
from simgap.cli import main
from simgap.inputs.plain_yaml import parse_yaml
from simgap.logs.channel import Channel
from simgap.logs.log import Log, read_logs
from simgap.logs.suspicions import suspicions

RANDOM = np.random.default_rng(7)


def inspected(path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[Log, str]:
    """Return the log that the first map reads, unchanged, and the text of that map."""
    capsys.readouterr()
    assert main(['inspect', str(path)]) == 0
    target = path.parent / 'map.yaml'
    target.write_text(capsys.readouterr().out)
    [log] = read_logs([path], target)
    return log, target.read_text()


@pytest.mark.parametrize('plugin', list(StoragePlugin))
def test_a_bag(plugin: StoragePlugin, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_rosbag2(tmp_path / 'run', plugin,
                  {**JOINTS, '/torques': ('std_msgs/msg/Float64MultiArray', torques)})
    log, told = inspected(tmp_path / 'run', capsys)
    close(log['joint_states_position_elbow'], ELBOW)
    close(log['joint_states_effort_elbow'], EFFORT)
    close(log.time, TIME)
    assert '# /joint_states (sensor_msgs/msg/JointState): 40 samples at 99.99 Hz for 0.39' in told
    tree = parse_yaml(told)
    assert tree['time'] == {
        'column': 'header.stamp', 'origin': 'first', 'duplicates': 'first',
        'onto': 'joint_states_position_wrist'}
    for field, unit in (('position', 'rad'), ('velocity', 'rad/s'), ('effort', 'N m')):
        assert tree['signals'][f'joint_states_{field}_elbow'] == {
            'column': f'/joint_states.{field}[name=elbow]', 'unit': unit}
    assert tree['signals']['torques_data_top'] == {
        'column': '/torques.data[top]', 'unit': 'N m', 'time_column': 'log_time', 'join': 'linear'}
    assert '"unit": "rad"}  # 0 to 0.999526\n' in told
    assert '  # joint_states_velocity_wrist: ' in told and 'stands at 0 all the time' in told


def test_columns_without_a_number_or_motion_do_not_spoil_the_map(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def still(k: int) -> Any:
        found = JOINTS['/joint_states'][1](k)
        found.effort[:], found.velocity[:] = np.nan, 0.0
        found.position[0] = 1.0
        return found

    topics = {'/still': ('sensor_msgs/msg/JointState', still), **JOINTS}
    write_rosbag2(tmp_path / 'run', StoragePlugin.MCAP, topics)
    log, told = inspected(tmp_path / 'run', capsys)
    close(log['still_position_elbow'], ELBOW)
    assert '# still_effort_elbow: {' in told and '}  # no number' in told
    write_rosbag2(tmp_path / 'none', StoragePlugin.MCAP, {'/torques': (
        'std_msgs/msg/Float64MultiArray', lambda k: torques(0))})
    assert set(inspected(tmp_path / 'none', capsys)[0]['torques_data_top']) == {9.0}


def test_mcap_of_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_json_mcap(tmp_path / 'a.mcap')
    close(inspected(tmp_path / 'a.mcap', capsys)[0]['servo_state_angle'], ELBOW)
    write_protobuf_mcap(tmp_path / 'b.mcap')
    log, _ = inspected(tmp_path / 'b.mcap', capsys)
    close(log['arm_position_elbow'], ELBOW)
    close(log.time, (STAMPS - STAMPS[0]) / 1e9)


TABLE = np.column_stack([np.round(1e3 * TIME, 6), ELBOW, EFFORT])


@pytest.mark.parametrize(('head', 'delimiter', 'decimal', 'tail'), [
    ('Time (ms),angle [rad],I_A\n', ',', '.', ''),
    ('t_ms\tangle_rad\tI_A\nms\trad\tA\n', '\t', '.', ''),
    ('# a logger of ours\nms;angle/deg;x\n', ';', ',', ''), ('time_ms,q,I_A\n', ',', '.', 'NaN')])
def test_text_as_people_write_it(head: str, delimiter: str, decimal: str, tail: str,
                                 tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [[repr(float(cell)).replace('.', decimal) for cell in row] for row in TABLE]
    rows += [[repr(1e3), tail, '1']] if tail else []
    (tmp_path / 'a.csv').write_text(head + ''.join(delimiter.join(row) + '\n' for row in rows))
    log, told = inspected(tmp_path / 'a.csv', capsys)
    assert log.time[:TIME.size] == pytest.approx(TIME, abs=1e-8)
    first, second = log.columns.values()
    assert first[:TIME.size] == pytest.approx(
        np.radians(ELBOW) if 'deg' in head else ELBOW, rel=1e-12)
    assert second[:TIME.size] == pytest.approx(EFFORT)
    assert {signal['unit'] for signal in parse_yaml(told)['signals'].values()} <= {
        'rad', 'deg', 'A', '1'}


def test_tables_that_lie_on_their_side_and_have_no_names(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ('time_s', 'angle_rad', 'I_A')
    (tmp_path / 'a.csv').write_text(''.join(
        ','.join([name, *map(repr, values.tolist())]) + '\n'
        for name, values in zip(names, (TIME, ELBOW, EFFORT))))
    close(inspected(tmp_path / 'a.csv', capsys)[0]['angle_rad'], ELBOW)
    np.save(tmp_path / 'b.npy', np.vstack([np.arange(100.0), np.sin(np.arange(100.0))]))
    log, _ = inspected(tmp_path / 'b.npy', capsys)
    close(log['column_1'], np.sin(np.arange(100.0)))
    savemat(tmp_path / 'c.mat', {'data': np.vstack([np.arange(100.0), np.cos(np.arange(100.0))])})
    close(inspected(tmp_path / 'c.mat', capsys)[0]['data_1'], np.cos(np.arange(100.0)))


def test_episodes_in_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pyarrow = pytest.importorskip('pyarrow')
    from pyarrow import parquet
    parquet.write_table(pyarrow.table({
        'action': [[float(k), 2.0] for k in range(60)], 'episode_index': np.repeat([0, 1, 2], 20),
        'timestamp': 0.1 * (np.arange(60) % 20)}), tmp_path / 'a.parquet')
    log, told = inspected(tmp_path / 'a.parquet', capsys)
    assert 'where: {"episode_index": 0.0}' in told
    close(log['action_0'], np.arange(20.0))


def channel_of(values: np.ndarray[Any, Any]) -> Channel:
    return Channel('1', 10_000_000 * np.arange(values.size), values)


def coded(word: str) -> tuple[np.ndarray[Any, Any], dict[str, float]]:
    """Return numbers with what a word stands for, and the entries of a map that mend it."""
    turn = np.linspace(-7.0, 9.0, 400) + 1e-3 * RANDOM.standard_normal(400)
    if word == 'sign bit':
        load = np.round(300 * np.sin(turn)).astype(int)
        return np.where(load < 0, 1024 - load, load).astype(float), {'sign_magnitude_bits': 11}
    if word == 'complement':
        return np.mod(np.round(300 * np.sin(turn)), 65536.0), {'unwrap': 65536.0}
    if word == 'radians':
        return np.mod(turn + np.pi, 2 * np.pi) - np.pi, {'unwrap': 2 * np.pi}
    if word == 'counts':
        return np.mod(np.round(4096 * turn / (2 * np.pi)), 4096.0), {'unwrap': 4096.0}
    return np.mod(np.degrees(turn), 360.0), {'unwrap': 360.0}


@pytest.mark.parametrize('word', ['sign bit', 'complement', 'radians', 'counts', 'degrees'])
def test_jumps_that_a_coding_makes(word: str) -> None:
    values, entries = coded(word)
    [found] = suspicions(channel_of(values))
    assert found.entries == entries


@pytest.mark.parametrize('word', ['stuck', 'saturated', 'constant'])
def test_channels_that_stand(word: str) -> None:
    time = 0.01 * np.arange(500)
    values = np.sin(3.0 * time) + 0.01 * RANDOM.standard_normal(500)
    if word == 'stuck':
        values[200:260] = values[200]
    values = np.minimum(values, 0.8) if word == 'saturated' else values
    values = np.full(500, 0.3) if word == 'constant' else values
    [found] = suspicions(channel_of(values))
    assert {'stuck': 'for 60 samples from 2 s on', 'saturated': 'at its upper limit 0.8 for 2',
            'constant': 'stands at 0.3 all the time'}[word] in found.text


@pytest.mark.parametrize('values', [
    np.sin(0.05 * np.arange(500)), RANDOM.standard_normal(500), np.arange(500) % 50 * 1.0 // 25,
    np.round(20 * np.sin(0.01 * np.arange(500))), np.repeat(RANDOM.standard_normal(5), 100)],
    ids=['sine', 'noise', 'square', 'coarse encoder', 'steps'])
def test_what_is_as_it_should_be_is_not_suspected(values: np.ndarray[Any, Any]) -> None:
    assert list(suspicions(channel_of(values))) == []


def test_gaps_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.delete(0.01 * np.arange(300), slice(100, 130))
    np.savetxt(tmp_path / 'a.csv', np.column_stack([time, np.sin(time)]), delimiter=',',
               header='time_s,x', comments='')
    _, told = inspected(tmp_path / 'a.csv', capsys)
    assert '# a gap from 0.99 to 1.3 s' in told


def test_what_was_found_is_plain_data_too(tmp_path: Path,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    time = np.delete(0.01 * np.arange(300), slice(100, 130))
    np.savetxt(tmp_path / 'a.csv', np.column_stack([time, np.sin(time), 0.0 * time + 0.3]),
               delimiter=',', header='time_s,angle_rad,I_A', comments='')
    _, told = inspected(tmp_path / 'a.csv', capsys)
    assert main(['inspect', str(tmp_path / 'a.csv'), '--json', '-']) == 0
    answer = capsys.readouterr()
    assert answer.err == told
    found = json.loads(answer.out)
    tree = parse_yaml(told)
    assert {**found['entries'], 'signals': {
        name: signal['entry'] for group in found['groups']
        for name, signal in group['signals'].items() if signal['moves']}} == tree
    [group] = found['groups']
    assert group['samples'] == 270 and group['length_s'] == pytest.approx(2.99)
    assert group['gaps_s'] == [pytest.approx([0.99, 1.3])]
    still = group['signals']['I_A']
    assert (still['least'], still['greatest'], still['moves']) == (0.3, 0.3, False)
    assert still['suspicions'] == ['stands at 0.3 all the time']


def test_nothing_to_say_is_no_success(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'a.csv').write_text('time_s,x\n')
    (tmp_path / 'b.csv').write_text('x,y\n1,2\n1,3\n0,1\n')
    (tmp_path / 'c.jsonl').write_text('')
    (tmp_path / 'd').mkdir()
    for name in ('a.csv', 'b.csv', 'c.jsonl', 'd', 'e.mcap'):
        assert main(['inspect', str(tmp_path / name)]) == 2
        told = capsys.readouterr()
        assert told.err.count('\n') == 1 and name in told.err and not told.out
