# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A long bag in several storage files: read by us, by another library, and after a kill."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import BagWriter
from antenna_drive.recording.files import read_recording
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer as RosbagsWriter
from rosbags.typesys import get_typestore, Stores
from simgap.logs.channel import RecordingError, RecordingWarning
import yaml
import zstandard

STEP_NS = 1_000_000
SIGNALS = {'motor_1/current': 'A', 'plant/encoder': 'rad'}
# Two seconds a file, and a chunk more: 13 files, so that file 10 sorts before file 2 by name.
SPLIT_S, SECONDS = 2.0, 30


def write_all(bag: BagWriter, seconds: float = SECONDS) -> None:
    for k in range(round(1000 * seconds)):
        bag.write(k, k * STEP_NS, [float(k), math.nan if k % 2 else 0.1 * k])


def info_of(path: Path) -> dict[str, Any]:
    info: dict[str, Any] = yaml.safe_load((path / 'metadata.yaml').read_text())[
        'rosbag2_bagfile_information']
    return info


def test_another_library_reads_every_file(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'run', SIGNALS, split_s=SPLIT_S) as bag:
        write_all(bag)
    with AnyReader([tmp_path / 'run']) as reader:
        currents = []
        for connection, stamp, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.topic == '/motor_1/current':
                currents.append((stamp, message.data))
        assert reader.message_count == 1.5 * 1000 * SECONDS
    assert currents == [(k * STEP_NS, float(k)) for k in range(1000 * SECONDS)]


def test_the_files_are_described_one_by_one_and_together(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'run', SIGNALS, split_s=SPLIT_S) as bag:
        write_all(bag)
    info = info_of(tmp_path / 'run')
    names = [f'run_{k}.mcap' for k in range(13)]
    assert info['relative_file_paths'] == names == [file['path'] for file in info['files']]
    assert sorted(names) == sorted(path.name for path in (tmp_path / 'run').glob('*.mcap'))
    ends = [file['starting_time']['nanoseconds_since_epoch'] + file['duration']['nanoseconds']
            for file in info['files']]
    starts = [file['starting_time']['nanoseconds_since_epoch'] for file in info['files']]
    assert starts[1:] == [end + STEP_NS for end in ends[:-1]]
    assert all(file['duration']['nanoseconds'] >= SPLIT_S * 1e9 for file in info['files'][:-1])
    assert info['duration']['nanoseconds'] == ends[-1] - starts[0]
    assert info['message_count'] == sum(file['message_count'] for file in info['files'])
    assert {topic['topic_metadata']['name']: topic['message_count']
            for topic in info['topics_with_message_count']} == {
                '/motor_1/current': 1000 * SECONDS, '/plant/encoder': 500 * SECONDS}


def test_it_is_read_as_one_recording(tmp_path: Path) -> None:
    notes, configuration = {'why': 'long'}, {'axis': {'gear_ratio': 14868.0}}
    for name, split_s in (('one', math.inf), ('many', SPLIT_S)):
        with BagWriter(tmp_path / name, SIGNALS, notes=notes, configuration=configuration,
                       split_s=split_s) as bag:
            write_all(bag, 5.0)
            bag.change(5000, 'torque_share', {'bias_pot': 0.5})
            bag.know({'axis': {'gear_ratio': 14869.0}})
    assert len(list((tmp_path / 'many').glob('*.mcap'))) == 3
    assert read_bag(tmp_path / 'many') == read_bag(tmp_path / 'one')


def test_a_slow_drive_fills_a_file_by_the_clock(tmp_path: Path) -> None:
    now = 0.0
    with BagWriter(tmp_path / 'run', SIGNALS, split_s=10.0, clock=lambda: now) as bag:
        for k in range(41):  # a millisecond of the drive a second
            bag.write(k, k * STEP_NS, [1.0, 2.0])
            now += 1.0
    assert len(info_of(tmp_path / 'run')['files']) == 4
    assert len(read_bag(tmp_path / 'run')['plant/encoder']) == 41


def test_a_file_begins_with_a_sample(tmp_path: Path) -> None:
    """A bag that ends when its file is full has no empty one behind it."""
    with BagWriter(tmp_path / 'run', SIGNALS, split_s=SPLIT_S) as bag:
        for k in range(2001):
            bag.write(k, k * STEP_NS, [1.0, 2.0])
    assert info_of(tmp_path / 'run')['relative_file_paths'] == ['run_0.mcap']


def test_a_killed_recorder_leaves_files_that_are_read_in_their_order(tmp_path: Path) -> None:
    bag = BagWriter(tmp_path / 'run', SIGNALS, split_s=SPLIT_S)
    write_all(bag)  # and never closed
    with pytest.warns(RecordingWarning, match='read up to 29'):
        recording = read_bag(tmp_path / 'run', partial=True)
    values = recording['motor_1/current'].values.tolist()
    assert values == [float(k) for k in range(len(values))]
    assert len(values) > 1000 * SECONDS - 600


def test_topics_have_numbers_of_their_own_in_each_file(tmp_path: Path) -> None:
    """rosbag2 numbers topics anew in each file, in the order in which they come."""
    store = get_typestore(Stores.ROS2_JAZZY)
    number = store.types['std_msgs/msg/Float64']
    for name, topics, at in (('run', ('/a', '/b'), 0), ('more', ('/b', '/a'), 1)):
        with RosbagsWriter(tmp_path / name, version=9,
                           storage_plugin=StoragePlugin.MCAP) as writer:
            for topic in topics:
                writer.write(writer.add_connection(topic, number.__msgtype__, typestore=store),
                             at, store.serialize_cdr(
                                 number({'/a': 1.0, '/b': 2.0}[topic]), number.__msgtype__))
    (tmp_path / 'more' / 'more.mcap').rename(tmp_path / 'run' / 'run_1.mcap')
    text = (tmp_path / 'run' / 'metadata.yaml').read_text()
    tree = yaml.safe_load(text)
    info = tree['rosbag2_bagfile_information']
    info['relative_file_paths'].append('run_1.mcap')
    for topic in info['topics_with_message_count']:
        topic['message_count'] = 2
    (tmp_path / 'run' / 'metadata.yaml').write_text(yaml.safe_dump(tree))
    recording = read_bag(tmp_path / 'run')
    assert recording['a'].values.tolist() == [1.0, 1.0]
    assert recording['b'].values.tolist() == [2.0, 2.0]


def packed_bag(path: Path) -> Path:
    """Write a bag in three files, each packed as a whole, as `ros2 bag record` does on demand."""
    with BagWriter(path, SIGNALS, split_s=SPLIT_S) as bag:
        write_all(bag, 6.0)
    tree = yaml.safe_load((path / 'metadata.yaml').read_text())
    info = tree['rosbag2_bagfile_information']
    for name in info['relative_file_paths']:
        (path / f'{name}.zstd').write_bytes(zstandard.compress((path / name).read_bytes()))
        (path / name).unlink()
    info.update(compression_mode='FILE', compression_format='zstd',
                relative_file_paths=[f'{name}.zstd' for name in info['relative_file_paths']])
    (path / 'metadata.yaml').write_text(yaml.safe_dump(tree))
    return path


def test_a_bag_whose_files_are_packed_is_read(tmp_path: Path) -> None:
    path = packed_bag(tmp_path / 'run')
    current = read_bag(path)['motor_1/current']
    assert current.values.tolist() == [float(k) for k in range(6000)]
    alone = read_recording(path / 'run_1.mcap.zstd')['motor_1/current']
    assert set(alone.values) < set(current.values)


def test_a_packed_file_that_was_cut_off_is_read_up_to_there(tmp_path: Path) -> None:
    path = packed_bag(tmp_path / 'run')
    last = path / 'run_2.mcap.zstd'
    last.write_bytes(last.read_bytes()[:-40])
    with pytest.raises(RecordingError, match='--partial'):
        read_bag(path)
    with pytest.warns(RecordingWarning, match='cut off or damaged'):
        current = read_bag(path, partial=True)['motor_1/current']
    assert len(current.values) >= 4000


@pytest.mark.parametrize('gone', [0, 1, 2])
def test_what_is_there_is_read_where_a_part_is_missing(gone: int, tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'run', SIGNALS, split_s=SPLIT_S) as bag:
        write_all(bag, 6.0)
    whole = read_bag(tmp_path / 'run')['motor_1/current'].values
    (tmp_path / 'run' / f'run_{gone}.mcap').unlink()
    with pytest.raises(RecordingError, match=rf'run_{gone}\.mcap: No such file.*--partial'):
        read_bag(tmp_path / 'run')
    with pytest.warns(RecordingWarning, match=rf'run_{gone}\.mcap: No such file'):
        left = read_bag(tmp_path / 'run', partial=True)['motor_1/current'].values
    missing = set(whole) - set(left)
    assert set(left) < set(whole) and max(missing) - min(missing) == len(missing) - 1
