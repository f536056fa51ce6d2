# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Writes bags, step by step while the drive runs, or whole.

A chunk is complete at least every half second, and a reader needs nothing behind it: whatever
happens to the process that records, at most the last half second is lost. Should the power fail,
what was synchronised is safe, see `sync_s`. The index of the chunks is held in memory until its
file ends, so a long bag has several storage files, see `split_s`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import io
from itertools import chain
import math
import os
from pathlib import Path
import secrets
import shutil
import struct
import time
from typing import Any

from antenna_drive.recording.atomic import refuse_existing, refuse_io, sync_folder
from antenna_drive.recording.bag import (
    CDR_HEADER, CHANGE, CONFIGURATION, description, FORMAT, FORMAT_VERSION, MESSAGE_DEFINITION,
    MESSAGE_HASH, MESSAGE_TYPE, METADATA, NOTES, StorageFile,
)
from antenna_drive.recording.plain import freeze, to_json
from antenna_drive.recording.recording import in_rows, Recording
from antenna_drive.recording.sheet import dump_sheet, FILE_NAME, TestSheet
from mcap.writer import Writer
from simgap.drafts import drafted
from simgap.inputs.plain import PlainDataError
from simgap.logs.channel import NANOSECONDS, RecordingError

FLUSH_S = 0.5
SPLIT_S = 600.0

_CDR_FLOAT64 = struct.Struct('<4sd')


class BagWriter:
    """
    Writes a rosbag2 folder while the drive runs.

    Use it as a context manager, or call `close`; without that the samples are safe up to the
    last `flush`, but metadata.yaml is missing and `read_bag` wants to be told that a part is
    enough.

    path : the folder
    written_ns : time stamp of the last sample that is safe in the file [ns], -1 if none is
    synced_ns : time stamp of the last sample that a failure of the power leaves [ns], -1 if none
    """

    def __init__(self, path: str | Path, signals: Mapping[str, str], *,
                 configuration: Mapping[str, Any] | None = None, sheet: TestSheet | None = None,
                 notes: Mapping[str, Any] | None = None, stem: str | None = None,
                 flush_s: float = FLUSH_S, sync_s: float | None = None,
                 split_s: float = SPLIT_S, clock: Callable[[], float] = time.monotonic) -> None:
        """
        Create the folder and write everything that is known before the first sample.

        path : folder that is not there yet
        signals : name -> unit of each signal that will come
        configuration, sheet, notes : see Recording
        stem : first part of the storage file's name; the folder's name if not given
        flush_s : longest time between chunks, by `clock` and by the time stamps [s]
        sync_s : after how long by `clock` the disk is made to hold what was written [s], at the
            end of a chunk; None for at the end of each storage file only
        split_s : how long a storage file becomes, by `clock` or by the time stamps [s]
        clock : a steady clock [s]

        Raises RecordingError: the folder exists already or cannot be written, or an argument is no
        plain data.
        """
        self.path = Path(path)
        self.written_ns = self.synced_ns = -1
        self._signals = dict(signals)
        self._flush_s, self._sync_s, self._split_s = flush_s, sync_s, split_s
        self._flush_ns = flush_s * NANOSECONDS
        self._clock = clock
        self._flushed_at = self._synced_at = clock()
        self._flushed_ns = 0
        self._files: list[StorageFile] = []
        self._stem = stem or self.path.name
        self._writer: Writer | None = None
        attachments = {
            CONFIGURATION: _as_json(configuration or {}), NOTES: _as_json(notes or {}),
            FILE_NAME: dump_sheet(sheet or TestSheet())}
        refuse_existing(self.path)
        try:
            self.path.mkdir(parents=True)
            self._raw, self._writer = self._opened()
        except FileExistsError:
            raise RecordingError(f'{self.path}: exists already; choose another name') from None
        except OSError as error:
            raise refuse_io(self.path, error) from error
        with self._guarded() as writer:
            self._topics = self._begin(writer, attachments)
            if sync_s is not None:
                self._sync()

    def _opened(self) -> tuple[io.FileIO, Writer]:
        """Return the next storage file and what writes it."""
        name = f'{self._stem}_{len(self._files)}.mcap'
        # not buffered: after a full disk nothing may be written that was held back; the writer
        # buffers a raw stream itself
        raw = (self.path / name).open('xb', buffering=0)
        self._files.append(StorageFile(name, self._clock(), [0] * len(self._signals)))
        return raw, Writer(raw, enable_data_crcs=True)

    def _begin(self, writer: Writer, attachments: Mapping[str, str]) -> list[int]:
        writer.start('ros2')
        writer.add_metadata(FORMAT, {'format': FORMAT_VERSION})
        for name, text in attachments.items():
            kind = 'application/yaml' if name.endswith('.yaml') else 'application/json'
            writer.add_attachment(0, 0, name, kind, text.encode())
        schema = writer.register_schema(MESSAGE_TYPE, 'ros2msg', MESSAGE_DEFINITION)
        topics = [
            writer.register_channel(f'/{name}', 'cdr', schema, {
                'offered_qos_profiles': '', 'unit': unit, 'topic_type_hash': MESSAGE_HASH})
            for name, unit in self._signals.items()]
        writer.flush()
        return topics

    def __enter__(self) -> 'BagWriter':
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        """Close the bag; after an error leave it as it is, safe up to the last chunk."""
        if kind is None:
            self.close()
        else:
            self._abandon()

    @property
    def closed(self) -> bool:
        """Tell whether the bag was closed or given up after an error."""
        return self._writer is None

    def write(self, step: int, time_ns: int, values: Sequence[float]) -> None:
        """
        Write one sample of every signal.

        step : number of the macro-step
        time_ns : simulated time [ns], not negative
        values : one for each signal, in their order; NaN where there is no sample

        Raises RecordingError: the disk is full or the file cannot be written, a value is infinite,
        or the time is negative; what was written before stays readable.
        """
        if not 0 <= time_ns < 2**63 or any(map(math.isinf, values)):
            name, value = next((item for item in zip(self._signals, values, strict=True)
                                if math.isinf(item[1])), ('a sample', values))
            raise RecordingError(f'{name}: {value} at {time_ns} ns cannot be recorded; allowed '
                                 'are finite numbers and times that are not negative')
        if self._full:
            self._split()
        pack, sequence, file = _CDR_FLOAT64.pack, step & 0xFFFFFFFF, self._files[-1]
        with self._guarded() as writer:
            for i, value in enumerate(values):
                if value == value:
                    writer.add_message(self._topics[i], time_ns, pack(CDR_HEADER, value),
                                       time_ns, sequence)
                    file.counts[i] += 1
        file.reaches(time_ns)
        if (time_ns - self._flushed_ns >= self._flush_ns
                or self._clock() - self._flushed_at >= self._flush_s):
            self.flush()

    def know(self, configuration: Mapping[str, Any]) -> None:
        """Write down the configuration instead of what was known; errors as of `change`."""
        text = _as_json(configuration)
        with self._guarded() as writer:
            writer.add_attachment(0, 0, CONFIGURATION, 'application/json', text.encode())

    def change(self, step: int, unit: str, values: Mapping[str, Any]) -> None:
        """
        Write down that tuning parameters changed and act from `step` on.

        Raises RecordingError: the file cannot be written, or a value is no plain data.
        """
        text = _as_json(values, f'{unit}: ')
        with self._guarded() as writer:
            writer.add_metadata(CHANGE, {'step': str(step), 'unit': unit, 'values': text})
        self.flush()

    def flush(self) -> None:
        """Complete the chunk, so that it survives this process; errors as of `write`."""
        with self._guarded() as writer:
            writer.flush()
        self.written_ns = self._last_ns
        self._flushed_ns = max(self.written_ns, 0)
        self._flushed_at = self._clock()
        if self._sync_s is not None and self._flushed_at - self._synced_at >= self._sync_s:
            with self._guarded():
                self._sync()

    @property
    def _last_ns(self) -> int:
        return max(file.last_ns for file in self._files)

    @property
    def _full(self) -> bool:
        """Tell whether the storage file is long enough; looked at when a chunk is complete."""
        file = self._files[-1]
        return file.last_ns >= 0 and self.written_ns == file.last_ns and (
            self._flushed_at - file.began_at >= self._split_s
            or file.last_ns - file.first_ns >= self._split_s * NANOSECONDS)

    def _split(self) -> None:
        """Complete the storage file, and begin the next one."""
        with self._guarded() as writer:
            self._complete(writer)
            self._raw.close()
            self._raw, self._writer = self._opened()
        with self._guarded() as writer:
            self._topics = self._begin(writer, {})

    def _complete(self, writer: Writer) -> None:
        writer.finish()
        writer.flush()
        self.written_ns = self._last_ns
        self._sync()

    def _sync(self) -> None:
        os.fsync(self._raw.fileno())
        sync_folder(self.path)
        self.synced_ns = self.written_ns
        self._synced_at = self._clock()

    def close(self) -> None:
        """Complete the bag: index, and metadata.yaml for ROS 2 tools; errors as of `write`."""
        if self._writer is None:
            return
        with self._guarded() as writer:
            self._complete(writer)
            with drafted(self.path / METADATA) as stream:
                stream.write(description(self._signals, self._files).encode())
            sync_folder(self.path)
        self._abandon()

    @contextmanager
    def _guarded(self) -> Iterator[Writer]:
        """Turn a full disk into one line that says how much is safe, and end the writing."""
        if self._writer is None:
            raise RecordingError(f'{self.path}: the bag is closed')
        try:
            yield self._writer
        except OSError as error:
            self._abandon()
            safe = self.written_ns
            so_far = (f'recorded up to {safe / NANOSECONDS:.3f} s' if safe >= 0
                      else 'nothing recorded')
            raise RecordingError(
                f'{self.path}: cannot be written, {error.strerror or error}; {so_far}') from error

    def _abandon(self) -> None:
        self._writer = None
        self._raw.close()


def _as_json(content: Mapping[str, Any], prefix: str = '') -> str:
    try:
        return to_json(freeze(dict(content)))
    except PlainDataError as error:
        raise RecordingError(f'{prefix}{error}') from None


def write_bag(recording: Recording, path: str | Path) -> None:
    """
    Write a recording as a rosbag2 folder, whole or not at all.

    Raises RecordingError: the folder exists already or cannot be written, or a time stamp is
    negative, which ROS 2 does not know (`Recording.shift` moves it).
    """
    path = Path(path)
    if recording.start_ns < 0:
        raise RecordingError(f'{path}: a time stamp of {recording.start_ns / NANOSECONDS:g} s is '
                             'negative; a bag has none')
    refuse_existing(path)
    channels = list(recording.channels.values())
    draft = path.with_name(f'.{path.name}.{secrets.token_hex(4)}')
    try:
        with BagWriter(draft, {n: recording[n].unit for n in recording},
                       configuration=recording.configuration, sheet=recording.sheet,
                       notes=recording.notes, stem=path.name, flush_s=math.inf) as bag:
            for change in recording.changes:
                bag.change(change.step, change.unit, change.values)
            rows = chain.from_iterable(zip(stamps.tolist(), table.tolist(), strict=True)
                                       for stamps, table in in_rows(channels))
            for number, (stamp, values) in enumerate(rows):
                bag.write(number, stamp, values)
        refuse_existing(path)
        draft.rename(path)
    except OSError as error:
        raise refuse_io(path, error) from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)
