# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings made by other people's writers: read to the right numbers, or refused in a line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import csv
import json
from pathlib import Path
from typing import Any

from antenna_drive.cli import main
from mcap.writer import Writer as McapWriter
import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from scipy.io import savemat
import simgap.cli
from simgap.errors import UserError
from simgap.logs.column_map import parse_map
from simgap.logs.log import Log, LogError, read_log
from simgap.logs.mapped import read_file

STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg('float64 angle\nfloat32[3] current\nuint16 mode\n',
                                  'servo_msgs/msg/Motor'))
STORE.register(get_types_from_msg('builtin_interfaces/Time stamp\nservo_msgs/Motor[] motors\n'
                                  'servo_msgs/Motor state\n', 'servo_msgs/msg/Servo'))
EPOCH = 1_700_000_000_000_000_000  # [ns]
COUNT = 40
# the truth: stamps of 100 Hz that jitter, and logged a little later
STAMPS = EPOCH + 10_000_000 * np.arange(COUNT) + 1_001 * (np.arange(COUNT) % 3)
LOGGED = STAMPS + 2_345_678
TIME = (STAMPS - STAMPS[0]) / 1e9
ELBOW, WRIST = np.sin(7.0 * TIME), 0.1 * np.cos(5.0 * TIME)
RATE, EFFORT = 7.0 * np.cos(7.0 * TIME), 2.5 - TIME


def message(kind: str, **fields: Any) -> Any:
    return STORE.types[kind](**fields)


def header(stamp: int) -> Any:
    return message('std_msgs/msg/Header', frame_id='base', stamp=message(
        'builtin_interfaces/msg/Time', sec=int(stamp) // 10**9, nanosec=int(stamp) % 10**9))


def joint_states(k: int) -> Any:
    return message('sensor_msgs/msg/JointState', header=header(STAMPS[k]),
                   name=['wrist', 'elbow'], position=np.array([WRIST[k], ELBOW[k]]),
                   velocity=np.array([0.0, RATE[k]]), effort=np.array([0.0, EFFORT[k]]))


def torques(k: int) -> Any:
    dims = [message('std_msgs/msg/MultiArrayDimension', label=label, size=1, stride=1)
            for label in ('top', 'middle', 'bottom')]
    layout = message('std_msgs/msg/MultiArrayLayout', dim=dims, data_offset=0)
    return message('std_msgs/msg/Float64MultiArray', layout=layout,
                   data=np.array([9.0 + TIME[k], TIME[k], WRIST[k]]))


def servo(k: int) -> Any:
    motors = [message('servo_msgs/msg/Motor', angle=angle, mode=mode, current=np.array(
        [0.0, angle / 2, 1.0], np.float32)) for angle, mode in ((WRIST[k], 7), (ELBOW[k], 3))]
    return message('servo_msgs/msg/Servo', stamp=header(STAMPS[k]).stamp, motors=motors,
                   state=motors[1])


Topics = Mapping[str, tuple[str, Callable[[int], Any]]]
JOINTS: Topics = {'/joint_states': ('sensor_msgs/msg/JointState', joint_states)}


def write_rosbag2(path: Path, plugin: StoragePlugin, topics: Topics,
                  packed: CompressionMode = CompressionMode.NONE) -> None:
    writer = Writer(path, version=9, storage_plugin=plugin)
    writer.set_compression(packed, CompressionFormat.ZSTD)
    with writer:
        opened = {name: writer.add_connection(name, kind, typestore=STORE)
                  for name, (kind, _) in topics.items()}
        for k in range(COUNT):
            for name, (kind, make) in topics.items():
                writer.write(opened[name], int(LOGGED[k]), STORE.serialize_cdr(make(k), kind))


def read(path: Path, signals: Mapping[str, Mapping[str, Any]], **entries: Any) -> Log:
    return read_log(path, parse_map({**entries, 'signals': {
        name: {'unit': '1', **body} for name, body in signals.items()}}))


def close(found: Any, true: Any) -> None:
    assert found == pytest.approx(np.asarray(true), rel=1e-12, abs=1e-15)


JOINT_SIGNALS = {'angle': {'column': '/joint_states.position[name=elbow]', 'unit': 'rad'},
                 'rate': {'column': '/joint_states.velocity[elbow]', 'unit': 'rad/s'},
                 'wrist': {'column': '/joint_states.position[0]', 'unit': 'deg'},
                 'torque': {'expression': '2 * column("/joint_states.effort[name=elbow]")',
                            'unit': 'N m'}}


@pytest.mark.parametrize('packed', [CompressionMode.NONE, CompressionMode.FILE,
                                    CompressionMode.MESSAGE])
@pytest.mark.parametrize('plugin', list(StoragePlugin))
@pytest.mark.parametrize('single', [False, True])
def test_joint_states_of_a_rosbag2(plugin: StoragePlugin, packed: CompressionMode, single: bool,
                                   tmp_path: Path) -> None:
    write_rosbag2(tmp_path / 'run', plugin, JOINTS, packed)
    path = tmp_path / 'run'
    if single:
        [path] = (file for file in path.iterdir() if file.name != 'metadata.yaml')
        if packed == CompressionMode.FILE:
            with pytest.raises(UserError, match='packed as a whole; `zstd -d FILE` unpacks it'):
                read(path, JOINT_SIGNALS)
            return
    log = read(path, JOINT_SIGNALS, time={'column': 'auto', 'origin': 'first'})
    close(log.time, TIME)
    close(log['angle'], ELBOW)
    close(log['rate'], RATE)
    close(log['wrist'], np.radians(WRIST))
    close(log['torque'], 2.0 * EFFORT)


@pytest.mark.parametrize(('column', 'stamps'), [
    ('auto', STAMPS), ('header.stamp', STAMPS), ('log_time', LOGGED),
    ('/joint_states.header.stamp', STAMPS)])
def test_the_time_of_a_bag_is_found_or_chosen(column: str, stamps: Any, tmp_path: Path) -> None:
    write_rosbag2(tmp_path / 'run', StoragePlugin.MCAP, JOINTS)
    found = read_file(tmp_path / 'run', parse_map({
        'time': {'column': column, 'unit': 'ms'}, 'signals': {'a': JOINT_SIGNALS['angle']}}))
    assert found.channels['a'].time_ns.tolist() == stamps.tolist()


def test_what_ros_2_itself_has_packed(tmp_path: Path) -> None:
    serialization = pytest.importorskip('rclpy.serialization')
    from sensor_msgs.msg import JointState
    text, _ = STORE.generate_msgdef('sensor_msgs/msg/JointState', ros_version=2)
    with (tmp_path / 'a.mcap').open('wb') as stream:
        writer = McapWriter(stream)
        writer.start('ros2', 'somebody')
        schema = writer.register_schema('sensor_msgs/msg/JointState', 'ros2msg', text.encode())
        channel = writer.register_channel('/joint_states', 'cdr', schema)
        for k in range(COUNT):
            state = JointState(name=['elbow'], position=[float(ELBOW[k])])
            writer.add_message(channel, int(LOGGED[k]), serialization.serialize_message(state),
                               int(LOGGED[k]))
        writer.finish()
    log = read(tmp_path / 'a.mcap', {'angle': {'column': '/joint_states.position[name=elbow]'}})
    close(log['angle'], ELBOW)
    close(log.time, LOGGED / 1e9)  # the stamp in the header was not set


def test_a_standard_type_needs_no_definition_in_the_bag(tmp_path: Path) -> None:
    import sqlite3
    write_rosbag2(tmp_path / 'run', StoragePlugin.SQLITE3, JOINTS)
    [path] = (tmp_path / 'run').glob('*.db3')
    with sqlite3.connect(path) as base:  # as rosbag2 of Humble and before has it
        base.executescript('DROP TABLE message_definitions; UPDATE schema SET schema_version = 3')
    close(read(path, JOINT_SIGNALS)['angle'], ELBOW)
    write_rosbag2(tmp_path / 'own', StoragePlugin.SQLITE3,
                  {'/servo': ('servo_msgs/msg/Servo', servo)})
    [path] = (tmp_path / 'own').glob('*.db3')
    with sqlite3.connect(path) as base:
        base.executescript('DROP TABLE message_definitions; UPDATE schema SET schema_version = 3')
    with pytest.raises(UserError, match='no definition of servo_msgs/msg/Servo; `ros2 bag conv'):
        read(path, {'angle': {'column': '/servo.state.angle'}})


def test_a_multi_array_by_index_and_by_label(tmp_path: Path) -> None:
    write_rosbag2(tmp_path / 'run', StoragePlugin.MCAP,
                  {'/torques': ('std_msgs/msg/Float64MultiArray', torques)})
    log = read(tmp_path / 'run', {'first': {'column': '/torques.data[0]'},
                                  'vector': {'column': '/torques.data', 'index': 1},
                                  'labelled': {'column': '/torques.data[bottom]'}})
    close(log['first'], 9.0 + TIME)
    close(log['vector'], TIME)
    close(log['labelled'], WRIST)


def test_messages_of_an_own_type(tmp_path: Path) -> None:
    write_rosbag2(tmp_path / 'run', StoragePlugin.MCAP,
                  {'/servo': ('servo_msgs/msg/Servo', servo)})
    log = read(tmp_path / 'run', {'state': {'column': '/servo.state.angle'},
                                  'by_mode': {'column': '/servo.motors[mode=7].angle'},
                                  'current': {'column': '/servo.motors[1].current[1]'}})
    close(log['state'], ELBOW)
    close(log['by_mode'], WRIST)
    close(log['current'], (ELBOW / 2).astype(np.float32))
    close(log.time, STAMPS / 1e9)


def write_json_mcap(path: Path) -> None:
    with path.open('wb') as stream:
        writer = McapWriter(stream)
        writer.start('', 'somebody')
        schema = writer.register_schema('Servo', 'jsonschema', b'{"type": "object"}')
        channel = writer.register_channel('servo', 'json', schema)
        for k in range(COUNT):
            text = json.dumps({'t_ms': 1e3 * TIME[k], 'state': {'angle': ELBOW[k]},
                               'names': ['a', 'b'], 'load': [1, None if k else 2],
                               'none': None, 'note': 'x'})
            writer.add_message(channel, int(LOGGED[k]), text.encode(), int(LOGGED[k]))
        writer.finish()


def test_mcap_with_a_json_schema(tmp_path: Path) -> None:
    write_json_mcap(tmp_path / 'a.mcap')
    log = read(tmp_path / 'a.mcap', {'angle': {'column': 'servo.state.angle'},
                                     'load': {'column': 'servo.load[a]'}},
               time={'column': 't_ms', 'unit': 'ms'})
    assert log.time == pytest.approx(TIME, abs=1e-9)
    close(log['angle'], ELBOW)
    assert set(log['load']) == {1.0}


def write_protobuf_mcap(path: Path) -> None:
    mcap_protobuf = pytest.importorskip('mcap_protobuf.writer')
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
    from google.protobuf.timestamp_pb2 import DESCRIPTOR as TIMESTAMP
    file = descriptor_pb2.FileDescriptorProto(name='arm.proto', package='arm', syntax='proto3',
                                              dependency=[TIMESTAMP.name])
    kind = descriptor_pb2.FieldDescriptorProto
    state = file.message_type.add(name='State')
    for number, (name, type_, label, named) in enumerate((
            ('stamp', kind.TYPE_MESSAGE, kind.LABEL_OPTIONAL, '.google.protobuf.Timestamp'),
            ('names', kind.TYPE_STRING, kind.LABEL_REPEATED, ''),
            ('position', kind.TYPE_DOUBLE, kind.LABEL_REPEATED, ''),
            ('current', kind.TYPE_DOUBLE, kind.LABEL_OPTIONAL, '')), 1):
        state.field.add(name=name, number=number, type=type_, label=label,
                        **({'type_name': named} if named else {}))
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(TIMESTAMP.serialized_pb)
    pool.AddSerializedFile(file.SerializeToString())
    make = message_factory.GetMessageClass(pool.FindMessageTypeByName('arm.State'))
    with path.open('wb') as stream, mcap_protobuf.Writer(stream) as writer:
        for k in range(COUNT):
            found = make(names=['wrist', 'elbow'], position=[WRIST[k], ELBOW[k]],
                         current=EFFORT[k])
            found.stamp.FromNanoseconds(int(STAMPS[k]))
            writer.write_message('/arm', found, int(LOGGED[k]), int(LOGGED[k]))


def test_mcap_with_protobuf(tmp_path: Path) -> None:
    write_protobuf_mcap(tmp_path / 'a.mcap')
    log = read(tmp_path / 'a.mcap', {'angle': {'column': '/arm.position[names=elbow]'},
                                     'current': {'column': '/arm.current'}})
    close(log.time, STAMPS / 1e9)
    close(log['angle'], ELBOW)
    close(log['current'], EFFORT)


def test_topics_with_clocks_of_their_own_are_joined(tmp_path: Path) -> None:
    """A slow sensor between the stamps of a fast one, and a command that is held."""
    fast, slow = np.arange(0, 400) * 1_000_000, np.arange(0, 40) * 10_000_000 + 300_000
    with (tmp_path / 'a.mcap').open('wb') as stream:
        writer = McapWriter(stream)
        writer.start('', 'somebody')
        for name, stamps, slope in (('fast', fast, 1.0), ('slow', slow, 3.0), ('cmd', slow, 2.0)):
            channel = writer.register_channel(name, 'json', 0)
            for stamp in stamps.tolist():
                writer.add_message(channel, EPOCH + stamp,
                                   json.dumps({'x': slope * stamp / 1e9}).encode(), 0)
        writer.finish()
    log = read(tmp_path / 'a.mcap', {'fast': {'column': 'fast.x'},
                                     'slow': {'column': 'slow.x', 'join': 'linear'},
                                     'held': {'column': 'cmd.x'}},
               time={'column': 'log_time', 'origin': 'first'})
    slow_log = read(tmp_path / 'a.mcap', {'fast': {'column': 'fast.x', 'join': 'linear'},
                                          'slow': {'column': 'slow.x'}},
                    time={'column': 'log_time', 'onto': 'slow'})
    close(slow_log.time, (EPOCH + slow) / 1e9)
    close(slow_log['slow'], 3.0 * slow / 1e9)
    close(slow_log['fast'], slow / 1e9)
    with pytest.raises(LogError, match='time.onto: the map has no signal slo, did you mean slow'):
        read(tmp_path / 'a.mcap', {'slow': {'column': 'slow.x'}},
             time={'column': 'log_time', 'onto': 'slo'})
    close(log.time, fast / 1e9)
    there = np.isfinite(log.columns['slow'])
    # each sample counts once, at the nearest stamp within, with the value that holds there
    assert log.time[there] == pytest.approx(0.01 * np.arange(1, 40))
    close(log.columns['slow'][there], 3.0 * log.time[there])
    past = np.floor((log.time - 0.0003 + 1e-12) / 0.01)
    close(log['held'][1:391], 2.0 * (0.0003 + 0.01 * past[1:391]))
    there = np.isfinite(log.columns['held'])
    assert log.time[there] == pytest.approx(0.001 + 0.01 * np.arange(40))


def test_a_data_set_of_lerobot(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip('pyarrow')
    from pyarrow import parquet
    (tmp_path / 'meta').mkdir()
    (tmp_path / 'data' / 'chunk-000').mkdir(parents=True)
    (tmp_path / 'meta' / 'info.json').write_text(json.dumps({'features': {
        'action': {'dtype': 'float32', 'names': ['shoulder.pos', 'elbow.pos']},
        'observation.state': {'names': {'motors': ['shoulder', 'elbow']}},
        'timestamp': {'names': None}}}))
    path = tmp_path / 'data' / 'chunk-000' / 'file-000.parquet'
    vector, episode = pyarrow.list_(pyarrow.float32(), 2), np.repeat([0, 1], COUNT // 2)
    start = np.where(episode == 1, TIME[COUNT // 2], 0.0)
    parquet.write_table(pyarrow.table({
        'observation.state': pyarrow.array([[w, e] for w, e in zip(WRIST, ELBOW)], vector),
        'action': pyarrow.array([[e, r] for e, r in zip(EFFORT, RATE)], vector),
        'timestamp': pyarrow.array(TIME - start, pyarrow.float32()), 'episode_index': episode,
        'task': ['pick'] * COUNT}), path)
    signals = {'angle': {'column': 'observation.state[elbow]', 'unit': 'deg'},
               'goal': {'column': 'action[elbow.pos]'}, 'first': {'column': 'action[0]'}}
    log = read(path, signals, where={'episode_index': 1, 'task': 'pick'})
    second = episode == 1
    assert log.time == pytest.approx((TIME - start)[second], rel=1e-6, abs=1e-7)
    assert log['angle'] == pytest.approx(np.radians(ELBOW[second]), rel=1e-6)
    assert log['goal'] == pytest.approx(RATE[second], rel=1e-6)
    assert log['first'] == pytest.approx(EFFORT[second], rel=1e-6)
    with pytest.raises(UserError, match='row 21, column timestamp: the time is not later'):
        read(path, signals)
    with pytest.raises(UserError, match='allowed are numbers from 0, shoulder, elbow'):
        read(path, {'angle': {'column': 'observation.state[elbw]'}})


def test_a_table_that_lies_on_its_side(tmp_path: Path) -> None:
    rows = [('Time', 'ms', 1e3 * TIME), ('Angle', 'rad', ELBOW), ('Effort', 'Nm', EFFORT)]
    with (tmp_path / 'a.csv').open('w', newline='') as stream:
        csv.writer(stream).writerows([name, unit, *map(repr, values.tolist())]
                                     for name, unit, values in rows)
    log = read(tmp_path / 'a.csv', {'angle': {'column': 'Angle'}, 'effort': {'column': 'Effort'}},
               transposed=True, units_row=True, time={'column': 'Time', 'unit': 'ms'})
    assert log.time == pytest.approx(TIME, abs=1e-9)
    close(log['angle'], ELBOW)
    close(log['effort'], EFFORT)
    with pytest.raises(UserError, match='place 1, column Time'):
        read(tmp_path / 'a.csv', {'angle': {'column': 'Angle'}}, transposed=True,
             time={'column': 'Time', 'unit': 'ms'})


def test_the_time_inside_a_matrix(tmp_path: Path) -> None:
    table = np.vstack([TIME, ELBOW, EFFORT])  # a Simulink 'To File': rows are signals
    savemat(tmp_path / 'a.mat', {'data': table, 'upright': table.T, 'd': [[2.0]]})
    signals: dict[str, dict[str, Any]] = {'angle': {'column': 'data[1]'},
                                          'effort': {'column': 'data', 'index': 2}}
    log = read(tmp_path / 'a.mat', signals, transposed=True, time={'column': 'data', 'index': 0})
    close(log.time, np.round(TIME, 9))
    close(log['angle'], ELBOW)
    close(log['effort'], EFFORT)
    log = read(tmp_path / 'a.mat', {'angle': {'column': 'upright[1]'}},
               time={'column': 'upright[0]'})
    close(log['angle'], ELBOW)
    with pytest.raises(UserError, match='upright has 40 values and data has 3 values;.*transpos'):
        read(tmp_path / 'a.mat', signals, time={'column': 'upright[0]'})


def test_json_with_constants_above_and_records_under_a_key(tmp_path: Path) -> None:
    records = [{'time': t, 'joint': {'q': q, 'tau': tau}}
               for t, q, tau in zip(TIME.tolist(), ELBOW.tolist(), EFFORT.tolist())]
    tree = {'arm': 'left', 'kt': 0.5, 'log': {'rate': 100, 'entries': records}, 'notes': []}
    (tmp_path / 'a.json').write_text(json.dumps(tree))
    (tmp_path / 'a.yaml').write_text('constants: {gear: 3}\n')
    log = read(tmp_path / 'a.json', {
        'angle': {'column': 'joint.q'},
        'torque': {'expression': 'column("joint.tau") * kt * gear', 'unit': 'N m'}},
        records='log.entries')
    close(log.time, np.round(TIME, 9))
    close(log['angle'], ELBOW)
    close(log['torque'], 1.5 * EFFORT)
    assert log.constants == {'kt': 0.5, 'rate': 100.0, 'gear': 3.0}
    del tree['notes']
    (tmp_path / 'a.json').write_text(json.dumps(tree))  # only one table is in it: it is found
    close(read_log(tmp_path / 'a.json').columns['joint.q'], ELBOW)
    with pytest.raises(UserError, match='no table logs, did you mean log'):
        read(tmp_path / 'a.json', {'angle': {'column': 'joint.q'}}, records='logs')


@pytest.mark.parametrize(('period', 'unit'), [(360.0, 'deg'), (4096.0, 'counts')])
def test_an_angle_that_wraps_around(period: float, unit: str, tmp_path: Path) -> None:
    turns = np.linspace(-1.3, 2.4, 50)
    np.savetxt(tmp_path / 'a.csv', np.column_stack([np.arange(50), turns * period % period]),
               delimiter=',', header='t,x', comments='')
    signal = {'column': 'x', 'unit': unit, 'unwrap': period, **(
        {'counts_per_revolution': 4096} if unit == 'counts' else {})}
    found = read(tmp_path / 'a.csv', {'angle': signal}, time={'column': 't'})['angle']
    assert found - found[0] == pytest.approx(2 * np.pi * (turns - turns[0]))


def test_command_and_state_in_two_files(tmp_path: Path) -> None:
    write_rosbag2(tmp_path / 'run1_state', StoragePlugin.MCAP, JOINTS)
    stamps = STAMPS[0] // 1_000_000 + 40 * np.arange(10)
    (tmp_path / 'run1_cmd.csv').write_text('ms;goal\n' + ''.join(
        f'{stamp};{k % 3}\n' for k, stamp in enumerate(stamps.tolist())))
    entries: dict[str, Any] = {'also': {'{test}_cmd.csv': {
        'delimiter': ';', 'time': {'column': 'ms', 'unit': 'ms'},
        'signals': {'goal': {'column': 'goal', 'unit': 'deg'}}}}}
    log = read(tmp_path / 'run1_state', JOINT_SIGNALS, **entries)
    close(log['angle'], ELBOW)
    past = np.searchsorted(1_000_000 * stamps, STAMPS, side='right') - 1
    inside = STAMPS <= 1_000_000 * stamps[-1]
    close(log['goal'][inside][1:], np.radians(past % 3)[inside][1:])
    entries['also']['{test}_cmd.csv']['time']['offset_s'] = -100.0
    with pytest.raises(LogError, match='goal: its time has no part in common'):
        read(tmp_path / 'run1_state', JOINT_SIGNALS, **entries)
    (tmp_path / 'run1_cmd.csv').unlink()
    with pytest.raises(UserError, match='run1_cmd.csv: No such file'):
        read(tmp_path / 'run1_state', JOINT_SIGNALS, **entries)


REFUSED: Sequence[tuple[str, str]] = (
    ('/joint_state.position[0]', 'no topic of this bag, did you mean /joint_states.; there are'),
    ('/joint_states.position[name=elbw]',
     r'no message has a value there, did you mean .*name=elbow\]'),
    ('/joint_states.name', 'a vector of 2 numbers; index says which'),
    ('/joint_states.header.frame_id', "'base' is no number"),
    ('/joint_states.position[7]', 'no message has a value there'),
    ('/joint_states.position[', 'no message has a value there'))


@pytest.mark.parametrize(('column', 'words'), REFUSED)
def test_what_a_bag_does_not_have_is_refused(column: str, words: str, tmp_path: Path) -> None:
    write_rosbag2(tmp_path / 'run', StoragePlugin.SQLITE3, JOINTS)
    with pytest.raises(UserError, match=words) as refusal:
        read(tmp_path / 'run', {'angle': {'column': column}})
    assert str(refusal.value).startswith(str(tmp_path)) and '\n' not in str(refusal.value)


def test_no_command_ends_well_without_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    write_rosbag2(tmp_path / 'run', StoragePlugin.MCAP, JOINTS)
    write_rosbag2(tmp_path / 'run3', StoragePlugin.SQLITE3, JOINTS)
    write_json_mcap(tmp_path / 'a.mcap')
    (tmp_path / 'm.py').write_text('from own.swing import swing\nmachine = swing()\n')
    (tmp_path / 'none.mcap').write_bytes((tmp_path / 'a.mcap').read_bytes()[:-200])
    for name in ('run', 'run3', 'a.mcap', 'none.mcap'):
        for program, words in ((main, ['export', name, 'out.csv']),
                               (main, ['import', name, 'out']),
                               (main, ['check-model', 'm.py', name]),
                               (simgap.cli.main, ['diagnose', 'm.py', name])):
            assert program(words) == 2, (name, words)
            told = capsys.readouterr().err
            assert told.count('\n') == 1 and name in told, told
            assert name == 'none.mcap' or 'simgap inspect' in told and '--map' in told, told
    assert not (tmp_path / 'out').exists() and not (tmp_path / 'out.csv').exists()


def test_every_command_reads_a_bag_through_a_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    write_rosbag2(tmp_path / 'run', StoragePlugin.SQLITE3, JOINTS)
    (tmp_path / 'm.yaml').write_text(json.dumps({'signals': {
        'arm/angle': JOINT_SIGNALS['angle']}}))
    assert main(['import', 'run', 'bag', '--map', 'm.yaml']) == 0
    assert main(['export', 'bag', 'bag.csv']) == 0
    assert main(['export', 'run', 'run.csv', '--map', 'm.yaml']) == 0
    capsys.readouterr()
    for name in ('bag.csv', 'run.csv'):
        table = np.genfromtxt(tmp_path / name, delimiter=',', skip_header=1)
        close(table[:, 1], ELBOW)
        close(table[:, 0], STAMPS / 1e9)
