# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Reads bags: our own and those of `ros2 bag`, whole or up to where they were cut off."""

from collections.abc import Sequence
from pathlib import Path
import warnings

from antenna_drive.emulator.wiring import DRIVE
from antenna_drive.recording.bag import CONFIGURATION, MESSAGE_TYPE, METADATA, NOTES
from antenna_drive.recording.bag_storage import DamageError, PACKED, read_storage, Storage
from antenna_drive.recording.csv_format import parse_known
from antenna_drive.recording.recording import Recording, unit_of
from antenna_drive.recording.sheet import FILE_NAME, parse_sheet
import numpy as np
from simgap.errors import one_line
from simgap.inputs.plain import from_json, PlainDataError
from simgap.inputs.plain_yaml import parse_yaml, read_yaml
from simgap.inputs.schema import ParameterError
from simgap.logs.bags import REMEDY
from simgap.logs.channel import make_channel, NANOSECONDS, RecordingError, RecordingWarning

LONGEST_NAME = 255  # characters of a file's name; no file system of today takes more


def read_bag(path: str | Path, *, partial: bool = False) -> Recording:
    """
    Read a rosbag2 folder with MCAP storage, or one storage file.

    Topics of other types than std_msgs/Float64 are left out and named in the notes, under
    'skipped_topics'. A namespace that the whole drive ran in is taken off the names and kept in
    the notes, under 'namespace'.

    path : the folder, or a file NAME.mcap or NAME.mcap.zstd
    partial : read what can be read of a bag that was cut off or damaged, and warn how far

    Raises RecordingError: the bag is not there, is none, or was cut off or damaged and `partial`
    is not set; one line says where and why.
    Warns RecordingWarning: `partial` was needed; the message says up to where the bag was read.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f'{path}: no such file or folder')
    storage = Storage()
    damage: str | None = None
    try:
        files, counts = _files(path)
        for file in files:
            # a part that is missing or damaged does not keep others from being read
            try:
                read_storage(file, storage)
            except DamageError as error:
                damage = damage or str(error)
        if damage is None:
            _check_counts(storage, counts)
    except DamageError as error:
        damage = str(error)
    except RecordingError as error:
        raise error if str(error).startswith(str(path)) else RecordingError(
            f'{path}: {error}') from None
    if damage is not None:
        last = storage.last_ns()
        until = f'up to {last / NANOSECONDS:.9f} s' if last >= 0 else 'up to no sample at all'
        if not partial:
            raise RecordingError(f'{path}: cut off or damaged, {damage}; it can be read {until} '
                                 'if a part is enough (--partial)')
        warnings.warn(f'{path}: cut off or damaged, {damage}; read {until}', RecordingWarning,
                      stacklevel=2)
    try:
        return _recording(storage)
    except (RecordingError, PlainDataError, ParameterError) as error:
        raise RecordingError(f'{path}: {error}') from None


def message_counts(path: Path) -> dict[str, int]:
    """Return a bag's messages by topic as it tells; RecordingError if it does not."""
    counts = _files(path)[1]
    if not counts:
        raise RecordingError(f'{path}: holds no description of its messages')
    return counts


def _files(path: Path) -> tuple[list[Path], dict[str, int] | None]:
    """Return the storage files of a bag in their order, and its topics' message counts."""
    if path.is_file():
        return [path], None
    if not (path / METADATA).is_file():
        found = sorted((*path.glob('*.mcap'), *path.glob(f'*.mcap{PACKED}')),
                       key=lambda file: (len(file.name), file.name))
        if not found:
            raise RecordingError(f'{path}: no bag, there is neither {METADATA} nor a file .mcap')
        return found, {}
    try:
        tree = read_yaml(path / METADATA)
    except ParameterError as error:
        raise RecordingError(str(error)) from None
    try:
        info = tree['rosbag2_bagfile_information']
        storage, compression = info['storage_identifier'], info.get('compression_mode', '')
        packed = (str(compression).lower(), info.get('compression_format'))
        names = info['relative_file_paths']
        counts = {topic['topic_metadata']['name']: topic['message_count']
                  for topic in info['topics_with_message_count']}
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or (
                not all(isinstance(n, str) and isinstance(c, int) for n, c in counts.items())):
            raise TypeError
    except (KeyError, TypeError, AttributeError):
        raise RecordingError(f'{path / METADATA}: no description of a bag') from None
    if storage != 'mcap':
        raise RecordingError(f'{path}: storage {one_line(repr(storage), 30)}, but only mcap is '
                             f'read without a map. {REMEDY}; ros2 bag convert makes mcap of it')
    if compression not in ('', 'none', None) and packed != ('file', 'zstd'):
        raise RecordingError(f'{path}: compressed by {one_line(repr(compression), 30)}, which is '
                             'not read here; MCAP compresses its own chunks, and files as a whole '
                             'may be packed by zstd')
    for name in names:
        if len(name) > LONGEST_NAME:
            raise RecordingError(f'{path / METADATA}: {one_line(name, 60)} is no name of a file')
        if not _lies_in(path, name):
            raise RecordingError(f'{path / METADATA}: the file {one_line(name, 60)} lies outside '
                                 'the bag')
    return [path / name for name in names], counts


def _lies_in(folder: Path, name: str) -> bool:
    try:
        return bool(name) and (folder / name).resolve().is_relative_to(folder.resolve())
    except (ValueError, OSError):  # no name of a file: a null byte, half of a character, too long
        return False


def _check_counts(storage: Storage, counts: dict[str, int] | None) -> None:
    if counts is None:
        return
    if not counts:
        raise DamageError(f'there is no {METADATA}')
    found = {topic: sum(map(len, parts)) for topic, parts in storage.samples.items()}
    for topic in sorted({*found, *counts} - storage.skipped):
        if found.get(topic, 0) != counts.get(topic, 0):
            raise DamageError(f'{found.get(topic) or "no"} messages of {one_line(topic)}, but '
                              f'{METADATA} tells of {counts.get(topic, 0)}')


def _recording(storage: Storage) -> Recording:
    if storage.skipped and not storage.samples:
        raise RecordingError(f'no topic of {MESSAGE_TYPE} is there, and others are not read '
                             f'without a map. {REMEDY}')
    namespace = _namespace(list(storage.samples))
    channels = {}
    for topic, parts in storage.samples.items():
        name = topic.removeprefix(namespace).lstrip('/')
        stamps = np.concatenate([np.empty(0, np.uint64), *(p['log_time'] for p in parts)])
        values = np.concatenate([np.empty(0), *(p['value'] for p in parts)])
        if len(stamps) and stamps.max() >= 2**63:
            raise RecordingError(f'{one_line(name)}: a time stamp is beyond 292 years')
        channels[name] = make_channel(name, storage.units[topic] or unit_of(name),
                                      stamps.astype(np.int64), values)
    known = {}
    for key, file in (('configuration', CONFIGURATION), ('notes', NOTES)):
        if file in storage.attachments:
            known[key] = from_json(storage.attachments[file])
    known = parse_known({**known, 'changes': storage.changes})
    notes = dict(known.pop('notes'))
    if storage.skipped:
        notes['skipped_topics'] = sorted(storage.skipped)
    if namespace:
        notes['namespace'] = namespace
    sheet = parse_sheet(parse_yaml(storage.attachments.get(FILE_NAME, b'')) or {})
    return Recording(channels, sheet=sheet, notes=notes, **known)


def _namespace(topics: Sequence[str]) -> str:
    """Return the namespace that one drive ran in, '' for none or several."""
    own = DRIVE.signals
    found = {topic[:-len(name)].rstrip('/')
             for topic in topics for name in own if topic.endswith(f'/{name}')}
    return found.pop() if len(found) == 1 else ''
