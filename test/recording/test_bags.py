# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Bags: read by other libraries, safe up to the last chunk, refused when they are not whole."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from pathlib import Path
import signal
import struct
import subprocess
import sys
from typing import Any

from antenna_drive.emulator.wiring import DRIVE
from antenna_drive.recording import bag_writer
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import BagWriter, write_bag
from antenna_drive.recording.recording import Change, Recording, unit_of
from antenna_drive.recording.sheet import FILE_NAME, parse_sheet
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader, NonSeekingReader
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer as RosbagsWriter
from rosbags.typesys import get_typestore, Stores
from simgap.logs.channel import Channel, RecordingError, RecordingWarning
import yaml

UNITS = {name: unit_of(name) for name in DRIVE.signals}
STEP_NS = 1_000_000


def some_recording(steps: int = 2500) -> Recording:
    rng = np.random.default_rng(4)
    time = np.arange(steps) * 1e-3
    return Recording.from_arrays(
        time, {name: rng.standard_normal(steps) * 10.0 ** rng.integers(-308, 300, steps)
               for name in UNITS},
        configuration={'axis': {'gear_ratio': 14868.0, 'modes': [2.2, 3.7]}},
        changes=(Change(100, 'torque_share', {'bias_pot': 0.892}),),
        sheet=parse_sheet({'circuit': 'new', 'elevation_deg': 45.0}), notes={'source': 'a test'})


@pytest.fixture
def recording() -> Recording:
    return some_recording()


def rosbags_samples(path: Path) -> dict[str, list[tuple[int, float]]]:
    """Read a bag with the rosbags library."""
    samples: dict[str, list[tuple[int, float]]] = {}
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            assert connection.msgtype == 'std_msgs/msg/Float64'
            samples.setdefault(connection.topic, []).append((stamp, message.data))
    return samples


def test_another_library_finds_every_sample_once_and_in_order(recording: Recording,
                                                              tmp_path: Path) -> None:
    write_bag(recording, tmp_path / 'run')
    samples = rosbags_samples(tmp_path / 'run')
    assert set(samples) == {f'/{name}' for name in recording}
    for name, channel in recording.channels.items():
        stamps, values = zip(*samples[f'/{name}'], strict=True)
        assert list(stamps) == list(range(0, 2500 * STEP_NS, STEP_NS))
        assert struct.pack('<2500d', *values) == channel.values.tobytes()


def test_metadata_is_what_rosbag2_writes(recording: Recording, tmp_path: Path) -> None:
    write_bag(recording, tmp_path / 'run')
    info = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())[
        'rosbag2_bagfile_information']
    assert info['storage_identifier'] == 'mcap'
    assert info['relative_file_paths'] == ['run_0.mcap']
    assert info['message_count'] == 2500 * len(UNITS)
    assert info['duration']['nanoseconds'] == 2499 * STEP_NS
    assert info['files'][0]['message_count'] == info['message_count']
    with AnyReader([tmp_path / 'run']) as reader:
        assert reader.message_count == info['message_count']
        assert {c.digest for c in reader.connections} == {
            get_typestore(Stores.ROS2_JAZZY).hash_rihs01('std_msgs/msg/Float64')}


def test_configuration_sheet_and_changes_lie_inside(recording: Recording, tmp_path: Path) -> None:
    write_bag(recording, tmp_path / 'run')
    with (tmp_path / 'run' / 'run_0.mcap').open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        attachments = {a.name: a.data for a in reader.iter_attachments()}
        metadata = [(m.name, m.metadata) for m in reader.iter_metadata()]
        summary = reader.get_summary()
    assert json.loads(attachments['configuration.json']) == {
        'axis': {'gear_ratio': 14868.0, 'modes': [2.2, 3.7]}}
    assert yaml.safe_load(attachments[FILE_NAME]) == {'circuit': 'new', 'elevation_deg': 45.0}
    assert ('antenna_drive/change', {'step': '100', 'unit': 'torque_share',
                                     'values': '{\n "bias_pot": 0.892\n}'}) in metadata
    assert summary is not None
    assert {c.topic.lstrip('/'): c.metadata['unit'] for c in summary.channels.values()} == UNITS


def test_a_bag_is_read_back_as_it_was(recording: Recording, tmp_path: Path) -> None:
    write_bag(recording, tmp_path / 'run')
    assert read_bag(tmp_path / 'run') == recording
    assert read_bag(tmp_path / 'run' / 'run_0.mcap') == recording


def test_uneven_channels_and_empty_ones_are_read_back(tmp_path: Path) -> None:
    recording = Recording({
        'motor_1/current': Channel('A', np.array([0, 1, 10**15]), np.array([-0.0, 5e-324, 1e308])),
        'wind/speed': Channel('m/s', np.array([7], dtype=np.int64), np.array([3.0])),
        'plant/encoder': Channel('rad', np.array([], dtype=np.int64), np.array([]))})
    write_bag(recording, tmp_path / 'run')
    assert read_bag(tmp_path / 'run') == recording


def write_with_rosbags(path: Path, topics: dict[str, list[tuple[int, float]]]) -> None:
    """Write a bag as another program would: with other types among ours, and no notes."""
    store = get_typestore(Stores.ROS2_JAZZY)
    number, text = store.types['std_msgs/msg/Float64'], store.types['std_msgs/msg/String']
    with RosbagsWriter(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        log = writer.add_connection('/chatter', text.__msgtype__, typestore=store)
        writer.write(log, 0, store.serialize_cdr(text('hello'), text.__msgtype__))
        for topic, samples in topics.items():
            connection = writer.add_connection(topic, number.__msgtype__, typestore=store)
            for stamp, value in samples:
                writer.write(connection, stamp,
                             store.serialize_cdr(number(value), number.__msgtype__))


def test_bags_of_others_are_read(tmp_path: Path) -> None:
    samples = [(0, 1.5), (STEP_NS, -2.5)]
    write_with_rosbags(tmp_path / 'run', {'/motor_1/current': samples, '/lonely': samples})
    recording = read_bag(tmp_path / 'run')
    assert recording.names == ('motor_1/current', 'lonely')
    assert recording['motor_1/current'].values.tolist() == [1.5, -2.5]
    assert recording['motor_1/current'].unit == 'article A'
    assert recording['lonely'].unit == ''
    assert recording.notes['skipped_topics'] == ('/chatter',)


def test_a_namespace_is_taken_off(tmp_path: Path) -> None:
    samples = [(0, 1.5)]
    write_with_rosbags(tmp_path / 'one', {'/dss26/el/plant/encoder': samples,
                                          '/dss26/el/motor_1/current': samples, '/other': samples})
    recording = read_bag(tmp_path / 'one')
    assert recording.names == ('plant/encoder', 'motor_1/current', 'other')
    assert recording.notes['namespace'] == '/dss26/el'
    write_with_rosbags(tmp_path / 'two', {'/a/plant/encoder': samples,
                                          '/b/plant/encoder': samples})
    assert read_bag(tmp_path / 'two').names == ('a/plant/encoder', 'b/plant/encoder')


# -- writing while the drive runs -------------------------------------------------------------


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def readable(path: Path) -> Recording:
    with pytest.warns(RecordingWarning, match='cut off or damaged'):
        return read_bag(path, partial=True)


def test_a_chunk_is_complete_every_half_second_of_either_time(tmp_path: Path) -> None:
    clock = Clock()
    bag = BagWriter(tmp_path / 'run', {'motor_1/current': 'A'}, clock=clock)
    for k in range(400):  # 0.4 s of simulated time within no time at all
        bag.write(k, k * STEP_NS, [1.0])
    assert bag.written_ns == -1
    for k in range(400, 600):
        bag.write(k, k * STEP_NS, [1.0])
    assert bag.written_ns == 500 * STEP_NS
    clock.now = 0.5  # a slow drive: half a second of the clock within one step
    bag.write(600, 600 * STEP_NS, [1.0])
    assert bag.written_ns == 600 * STEP_NS
    assert len(readable(tmp_path / 'run')['motor_1/current']) == 601


def test_samples_that_are_not_there_yet_are_left_out(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'run', {'motor_1/current': 'A', 'plant/encoder': 'rad'}) as bag:
        bag.write(0, 0, [math.nan, 1.0])
        bag.write(1, STEP_NS, [2.0, math.nan])
    recording = read_bag(tmp_path / 'run')
    assert recording['motor_1/current'].time_ns.tolist() == [STEP_NS]
    assert recording['plant/encoder'].time_ns.tolist() == [0]


def test_what_cannot_be_recorded_is_refused_and_the_rest_kept(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'run', {'motor_1/current': 'A'}) as bag:
        bag.write(0, 0, [1.0])
        with pytest.raises(RecordingError, match='motor_1/current: inf at 1000000 ns'):
            bag.write(1, STEP_NS, [math.inf])
        with pytest.raises(RecordingError, match='not negative'):
            bag.write(1, -1, [1.0])
    assert len(read_bag(tmp_path / 'run')['motor_1/current']) == 1
    with pytest.raises(RecordingError, match='the bag is closed'):
        bag.write(2, 2 * STEP_NS, [1.0])


def test_an_existing_target_is_left_alone(recording: Recording, tmp_path: Path) -> None:
    (tmp_path / 'run').mkdir()
    (tmp_path / 'file').write_text('mine')
    for name in ('run', 'file'):
        with pytest.raises(RecordingError, match=f'{name}: exists already'):
            BagWriter(tmp_path / name, UNITS)
        with pytest.raises(RecordingError, match=f'{name}: exists already'):
            write_bag(recording, tmp_path / name)
    assert (tmp_path / 'file').read_text() == 'mine'
    assert list((tmp_path / 'run').iterdir()) == []
    with pytest.raises(RecordingError, match='file/run: cannot be written, Not a directory'):
        BagWriter(tmp_path / 'file' / 'run', UNITS)


def test_an_error_of_the_caller_leaves_a_bag_that_is_safe_so_far(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        with BagWriter(tmp_path / 'run', {'motor_1/current': 'A'}) as bag:
            bag.write(0, 0, [1.0])
            bag.flush()
            raise ZeroDivisionError
    assert len(readable(tmp_path / 'run')['motor_1/current']) == 1


WRITE_FOREVER = """
import itertools, json, resource, signal, sys
from antenna_drive.recording.bag_writer import BagWriter
from antenna_drive.recording.recording import RecordingError
path, limit = sys.argv[1], int(sys.argv[2])
if limit:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
bag = BagWriter(path, {'motor_1/current': 'A', 'plant/encoder': 'rad'})
try:
    for k in itertools.count():
        bag.write(k, k * 1_000_000, [float(k), 0.1 * k])
        if k % 100 == 0:
            print(k, flush=True)
except RecordingError as error:
    print(json.dumps([str(error), bag.written_ns]), flush=True)
"""


def check_steps(path: Path, at_least: int) -> None:
    """Find every step once, in order, up to the last complete chunk, with the mcap reader."""
    steps: dict[str, list[int]] = {'/motor_1/current': [], '/plant/encoder': []}
    with path.open('rb') as file, pytest.raises(EndOfFile):
        for _, topic, message in NonSeekingReader(file).iter_messages(log_time_order=False):
            assert message.log_time == message.sequence * STEP_NS
            value = struct.unpack('<d', message.data[4:])[0]
            scale = 1.0 if topic.topic == '/motor_1/current' else 0.1
            assert value == scale * message.sequence
            steps[topic.topic].append(message.sequence)
    for found in steps.values():
        assert found == list(range(len(found)))
        assert len(found) >= at_least


def test_a_killed_process_leaves_all_but_the_last_second(tmp_path: Path) -> None:
    path = tmp_path / 'run'
    with subprocess.Popen([sys.executable, '-c', WRITE_FOREVER, path, '0'],
                          stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        written = 0
        for line in process.stdout:
            written = int(line)
            if written >= 3300:
                os.kill(process.pid, signal.SIGKILL)
                break
        process.stdout.read()
    assert process.returncode == -signal.SIGKILL
    check_steps(path / 'run_0.mcap', at_least=written - 1000)
    with pytest.raises(RecordingError, match=r'cut off or damaged.*--partial'):
        read_bag(path)
    recording = readable(path)
    found = recording['motor_1/current'].values
    assert found.tolist() == list(map(float, range(len(found))))
    assert len(found) > written - 1000


def test_a_full_disk_ends_in_one_line_and_a_readable_part(tmp_path: Path) -> None:
    path = tmp_path / 'run'
    result = subprocess.run([sys.executable, '-c', WRITE_FOREVER, path, '100000'],
                            capture_output=True, text=True, check=True)
    message, written_ns = json.loads(result.stdout.splitlines()[-1])
    assert result.stderr == ''
    assert message.startswith(f'{path}: cannot be written, File too large; recorded up to ')
    assert written_ns >= 500 * STEP_NS
    check_steps(path / 'run_0.mcap', at_least=written_ns // STEP_NS + 1)
    assert readable(path).end_ns == written_ns


# -- bags that are not whole ------------------------------------------------------------------


@pytest.mark.parametrize('part', [0, 5, 8, 100, 0.3, 0.7, -1, -8, -20])
def test_a_truncated_bag_is_opened_only_when_a_part_is_enough(part: float, recording: Recording,
                                                              tmp_path: Path) -> None:
    write_bag(recording, tmp_path / 'run')
    file = tmp_path / 'run' / 'run_0.mcap'
    content = file.read_bytes()
    file.write_bytes(content[:int(part * len(content)) if 0 < part < 1 else int(part)])
    with pytest.raises(RecordingError, match='cut off or damaged'):
        read_bag(tmp_path / 'run')
    got = readable(tmp_path / 'run')
    for name, channel in got.channels.items():
        whole = recording[name]
        assert channel.values.tobytes() == whole.values[:len(channel)].tobytes()
        assert channel.time_ns.tobytes() == whole.time_ns[:len(channel)].tobytes()


def test_the_warning_says_up_to_where(tmp_path: Path) -> None:
    bag = BagWriter(tmp_path / 'run', {'motor_1/current': 'A'})
    bag.write(0, 0, [1.0])
    bag.write(1, 1_234_567_890, [1.0])
    with pytest.warns(RecordingWarning, match=r'read up to 1\.234567890 s'):
        read_bag(tmp_path / 'run', partial=True)


@pytest.mark.parametrize('start', [2**63, 2**64 - 1])
def test_a_summary_behind_the_end_is_damage(start: int, tmp_path: Path) -> None:
    write_bag(some_recording(100), tmp_path / 'run')
    file = tmp_path / 'run' / 'run_0.mcap'
    content = bytearray(file.read_bytes())
    at = len(content) - 8 - 20  # the footer's three numbers, and the magic at the end
    content[at:at + 8] = start.to_bytes(8, 'little')
    file.write_bytes(content)
    with pytest.raises(RecordingError, match='behind the end'):
        read_bag(tmp_path / 'run')


def rewrite(path: Path, **changes: object) -> None:
    tree = yaml.safe_load(path.read_text())
    tree['rosbag2_bagfile_information'].update(changes)
    path.write_text(yaml.safe_dump(tree))


@pytest.mark.parametrize(('changes', 'words'), [
    ({'storage_identifier': 'sqlite3'}, "storage 'sqlite3'.*ros2 bag convert"),
    ({'compression_mode': 'file'}, "compressed by 'file'"),
    ({'relative_file_paths': 'x' * 100_000}, 'no description of a bag'),
    ({'relative_file_paths': [list(range(1000))]}, 'no description of a bag'),
    ({'relative_file_paths': ['run\0.mcap']}, 'lies outside the bag'),
    ({'relative_file_paths': ['\ud800']}, 'lies outside the bag'),
    ({'relative_file_paths': ['../other.mcap']}, 'lies outside the bag'),
    ({'relative_file_paths': ['x' * 100_000]}, r'x\.\.\. is no name of a file'),
    ({'relative_file_paths': ['run_0.' + '{"a":' * 5000]}, r'\.\.\. is no name of a file'),
    ({'relative_file_paths': ['gone.mcap']}, 'gone.mcap: No such file'),
    ({'relative_file_paths': 3}, 'no description of a bag'),
    ({'topics_with_message_count': []}, 'cut off or damaged'),
    ({'topics_with_message_count': [
        {'topic_metadata': {'name': '/motor_1/current'}, 'message_count': 7}]},
     'messages of /'),
])
def test_metadata_that_does_not_fit_is_refused(changes: dict[str, object], words: str,
                                               recording: Recording, tmp_path: Path) -> None:
    write_bag(recording.between(0, 0.01), tmp_path / 'run')
    rewrite(tmp_path / 'run' / 'metadata.yaml', **changes)
    with pytest.raises(RecordingError, match=words) as told:
        read_bag(tmp_path / 'run')
    assert str(told.value).isprintable() and len(str(told.value)) < 1000


def test_what_is_no_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='no such file or folder'):
        read_bag(tmp_path / 'none')
    with pytest.raises(RecordingError, match='no bag'):
        read_bag(tmp_path)
    (tmp_path / 'a.mcap').write_bytes(b'')
    with pytest.raises(RecordingError, match='cut off or damaged'):
        read_bag(tmp_path / 'a.mcap')
    (tmp_path / 'b.mcap').write_bytes(b'no bag at all, but some text')
    with pytest.raises(RecordingError, match='cut off or damaged.*magic'):
        read_bag(tmp_path / 'b.mcap')


def test_negative_time_stamps_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='-0.5 s is negative'):
        write_bag(some_recording(10).shift_ns(-500_000_000), tmp_path / 'run')
    assert list(tmp_path.iterdir()) == []


def test_a_newer_format_is_not_guessed_at(recording: Recording, tmp_path: Path,
                                          monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_writer, 'FORMAT_VERSION', '2')
    write_bag(recording.between(0, 0.01), tmp_path / 'run')
    monkeypatch.undo()
    with pytest.raises(RecordingError, match='newer version'):
        read_bag(tmp_path / 'run')


def test_a_bag_that_starts_again_is_refused(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'run', {'motor_1/current': 'A'}) as bag:
        for k in (0, 1, 0):
            bag.write(k, k * STEP_NS, [1.0])
    with pytest.raises(RecordingError, match='motor_1/current: sample 2 at 0.0.*not later'):
        read_bag(tmp_path / 'run')


def test_dataclass_copies_are_written_too(recording: Recording, tmp_path: Path) -> None:
    other = dataclasses.replace(recording.between(0, 0.1), notes={'of': 'a part'})
    write_bag(other, tmp_path / 'run')
    assert read_bag(tmp_path / 'run').notes == {'of': 'a part'}
