# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Bags as tables: rosbag2 with MCAP or sqlite3 storage, or MCAP with JSON or Protobuf.

A row is a message, and a column a topic with a path of `fields`, such as
`/joint_states.position[name=elbow]`. Cells of other topics are empty. Each topic has its own
clock: the time that its messages tell, where it is set, else the time at which they were logged.
Libraries do the reading; types are those that the bag defines, else the standard ones of ROS 2.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from simgap.errors import one_line
from simgap.inputs.plain import from_json
from simgap.inputs.schema import nearest
from simgap.logs.channel import RecordingError
from simgap.logs.fields import fields_of, numbers_of, Stamp
from simgap.logs.table import AUTO, cell_of, Seen, Table, Text

_SQLITE3 = b'SQLite format 3\0'
REMEDY = '`simgap inspect FILE > map.yaml` tells what there is, as a map for --map'
LOG_TIME = 'log_time'
# where messages tell the time at which they hold
_STAMPS = ('header.stamp', 'stamp', 'timestamp')
_PACKED = b'\x28\xb5\x2f\xfd'  # how data begin that zstd packed


class _Message(NamedTuple):
    """A message as it lies in a bag, and what reads it."""

    topic: str
    kind: str  # its type
    logged: int  # when it was logged [ns]
    data: bytes
    decode: Callable[[bytes], Any] | None

    def read(self) -> Any:
        """Return what stands in it; RecordingError if it cannot be read."""
        if self.decode is None:
            raise RecordingError(f'{one_line(self.topic)}: its messages are not in json or '
                                 'protobuf, nor are all topics of ROS 2')
        try:
            return self.decode(self.data)
        except (RecordingError, ImportError):
            raise
        except Exception as error:  # noqa: B902 (a damaged message can raise anything in there)
            raise RecordingError(f'{one_line(self.topic)}: no message of {one_line(self.kind)}, '
                                 f'{type(error).__name__} {one_line(error)}') from None


def _messages(path: Path, wanted: Callable[[str], bool]) -> Iterator[_Message]:
    """Yield messages by log time; RecordingError if it is no bag or damaged, or ImportError."""
    if path.is_dir() and not (path / 'metadata.yaml').is_file():
        raise RecordingError('a folder without metadata.yaml is no bag; `ros2 bag reindex` writes '
                             'it for one')
    try:
        yield from (_rosbag2 if path.is_dir() or _is_ros(path) else _mcap)(path, wanted)
    except (OSError, RecordingError, ImportError):
        raise
    except Exception as error:  # noqa: B902 (a damaged file can raise anything in there)
        raise RecordingError(f'cut off or damaged, {type(error).__name__} {one_line(error)}; '
                             '`mcap recover` or `ros2 bag reindex` saves what is whole') from None


def _is_ros(path: Path) -> bool:
    from mcap.reader import make_reader
    with path.open('rb') as stream:
        if stream.read(len(_SQLITE3)) == _SQLITE3:
            return True
        stream.seek(0)
        reader = make_reader(stream)
        summary = reader.get_summary()
        return (all(channel.message_encoding == 'cdr' for channel in summary.channels.values())
                if summary else bool(reader.get_header().profile == 'ros2'))


def _rosbag2(path: Path, wanted: Callable[[str], bool]) -> Iterator[_Message]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import get_typestore, Stores
    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
        chosen = [connection for connection in bag.connections if wanted(connection.topic)]
        for one, logged, data in bag.messages(chosen) if chosen else ():
            yield _Message(one.topic, one.msgtype, logged, data,
                           partial(_cdr, bag.typestore, one.msgtype))


def _cdr(types: Any, kind: str, data: bytes) -> Any:
    if kind not in types.fielddefs:
        raise RecordingError(
            f'the bag has no definition of {one_line(kind)}; `ros2 bag convert` to mcap, where '
            'that type is installed, writes it into the bag')
    if bytes(data[:4]) == _PACKED:
        import zstandard
        data = zstandard.ZstdDecompressor().decompress(data)
    known = types.get_msgdef(kind)
    read = {b'\0\1': known.deserialize_cdr_le, b'\0\0': known.deserialize_cdr_be}
    # what follows a message is left: rclpy's serialize_message adds some bytes
    return read[bytes(data[:2])](memoryview(data)[4:], 0, known.cls, types)[0]


def _mcap(path: Path, wanted: Callable[[str], bool]) -> Iterator[_Message]:
    from mcap.reader import make_reader
    with path.open('rb') as stream:
        decoders: dict[int, Callable[[bytes], Any] | None] = {}
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            if wanted(channel.topic):
                if channel.id not in decoders:
                    decoders[channel.id] = _other(channel.message_encoding, schema)
                yield _Message(channel.topic, schema.name if schema else '', message.log_time,
                               message.data, decoders[channel.id])


def _other(encoding: str, schema: Any) -> Callable[[bytes], Any] | None:
    """Return what decodes messages that are not of ROS 2, None if nothing does."""
    if encoding == 'json':
        return from_json
    from mcap_protobuf.decoder import DecoderFactory
    return DecoderFactory().decoder_for(encoding, schema)


class BagTable(Table):
    """The messages of a bag, of which columns are found by `place` before the rows are read."""

    def __init__(self, path: Path) -> None:
        """Look which topics there are; RecordingError if it is no bag or damaged."""
        super().__init__([], self._rows(), counted='message')
        self._path, self._clocks = path, set[int]()
        self._topics: dict[str, None] = {}
        for _ in _messages(path, lambda name: bool(self._topics.setdefault(name))):
            pass

    def place(self, column: str | int) -> tuple[int, int | None]:
        """Return where a column stands in the rows; RecordingError if its topic is not there."""
        self._topic_of(column)
        if column not in self.names:
            self.names.append(str(column))
        return self.names.index(str(column)), None

    def clock(self, column: str | int, chosen: str | int) -> str:
        """Return the clock of a column: its topic's own, or what is chosen of the same topic."""
        topic = self._topic_of(column)
        clock = str(chosen) if str(chosen).startswith(f'{topic}.') else f'{topic}.{chosen}'
        self._clocks.add(self.place(clock)[0])
        return clock

    def topics(self) -> Iterator[Seen]:
        """Yield what the first message of each topic shows."""
        left = set(self._topics)
        for message in _messages(self._path, left.__contains__):
            if message.topic in left:
                left.remove(message.topic)
                columns, clock, remark = list[str](), LOG_TIME, ''
                try:
                    content = message.read()
                    clock = _stamp_of(fields_of(content))
                    columns = [f'{message.topic}.{path}' for path in numbers_of(content)
                               if not path.startswith('layout.')]
                except RecordingError as error:
                    remark = f'not read: {error}'
                yield Seen(message.topic, message.kind, clock, columns, remark)
            if not left:
                return

    def _topic_of(self, column: str | int) -> str:
        found = [topic for topic in self._topics if str(column).startswith(f'{topic}.')]
        if not found:
            topic = str(column).partition('.')[0]
            raise RecordingError(
                f'{one_line(column)}: no topic of this bag{nearest(topic, self._topics)}; there '
                f'are {one_line(", ".join(self._topics), 400)}. {REMEDY}')
        return max(found, key=len)

    def _rows(self) -> Iterator[tuple[int, Sequence[Text]]]:
        paths: dict[str, dict[int, str]] = {}
        for place, column in enumerate(self.names):
            name = self._topic_of(column)
            paths.setdefault(name, {})[place] = column[len(name) + 1:]
        missing, last = set(range(len(self.names))), dict[str, Any]()
        stamps: dict[str, str] = {}  # of each topic, settled by its first message
        for count, message in enumerate(_messages(self._path, paths.__contains__), 1):
            own = paths[message.topic]
            last[message.topic] = content = message.read()
            fields = {**fields_of(content), LOG_TIME: Stamp.of(message.logged)}
            fields[AUTO] = fields.get(stamps.setdefault(message.topic, _stamp_of(fields)))
            row: list[Text] = [''] * len(self.names)
            for place, path in own.items():
                if fields.get(path) is not None:
                    row[place] = cell_of(fields[path])
                    missing.discard(place)
            if any(row[place] for place in own.keys() - self._clocks):
                yield count, row
        for column in (self.names[place] for place in sorted(missing)):
            name = self._topic_of(column)
            known = [f'{name}.{path}' for path in numbers_of(last.get(name, {}))]
            raise RecordingError(f'{one_line(column)}: no message has a value there'
                                 f'{nearest(column, known)}; there are '
                                 f'{one_line(", ".join(known) or "no messages", 400)}')


def _stamp_of(fields: Mapping[str, Any]) -> str:
    """Return the path of the time that a message tells, log_time if it tells none."""
    return next((path for path in _STAMPS if isinstance(stamp := fields.get(path), Stamp)
                 and float(stamp)), LOG_TIME)
