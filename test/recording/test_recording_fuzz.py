# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Damaged and invented files: a clear error of one line, or exactly what was written.

Whatever happens to a file, a reader may say no, in one line that names the file; it may not
raise anything else, and it may not give a part for the whole. The quick suite tries some hundred
cases of each kind, the slow one thousands; the seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import random
from typing import Any
import warnings

from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import write_bag
from antenna_drive.recording.csv_format import read_csv, write_csv
from antenna_drive.recording.files import import_file, load_map
from antenna_drive.recording.sheet import load_sheet
from hypothesis import given, HealthCheck, settings, strategies as st
from lab.campaign.mutating import mutations, POISON
from lab.campaign.readers import MAP, one_recording, SHEET
import pytest
from simgap.errors import UserError
from simgap.logs.channel import RecordingError, RecordingWarning

FEW, MANY = 300, 5000
COUNTS = [pytest.param(FEW, id='few'), pytest.param(MANY, id='many', marks=pytest.mark.trial)]


def outcome(read: Callable[[], Any], path: Path) -> Any:
    """Return what was read, or None if it was refused as it has to be."""
    try:
        return read()
    except UserError as error:
        message = str(error)
        assert message.startswith(str(path)), message
        assert message.isprintable(), message
        assert len(message) < 1000, message
        return None


@pytest.mark.parametrize('count', COUNTS)
def test_damaged_storage_is_refused_or_harmless(count: int, tmp_path: Path) -> None:
    recording = one_recording(120)
    write_bag(recording, tmp_path / 'run')
    file = tmp_path / 'run' / 'run_0.mcap'
    refused = 0
    for data in mutations(file.read_bytes(), count, seed=1):
        file.write_bytes(data)
        got = outcome(lambda: read_bag(tmp_path / 'run'), tmp_path / 'run')
        refused += got is None
        assert got is None or got == recording
    assert refused > 0.9 * count


@pytest.mark.parametrize('count', COUNTS)
def test_a_part_of_damaged_storage_is_true_and_told(count: int, tmp_path: Path) -> None:
    recording = one_recording(120)
    write_bag(recording, tmp_path / 'run')
    file = tmp_path / 'run' / 'run_0.mcap'
    content = file.read_bytes()
    for size in random.Random(2).sample(range(len(content)), min(count, len(content))):
        file.write_bytes(content[:size])
        with pytest.warns(RecordingWarning, match='cut off or damaged.*; read up to'):
            got = read_bag(tmp_path / 'run', partial=True)
        for name, channel in got.channels.items():
            whole = recording[name]
            assert len(channel) in (0, len(whole))  # so few samples are one chunk
            assert channel.values.tobytes() == whole.values[:len(channel)].tobytes()


@pytest.mark.parametrize('count', COUNTS)
def test_a_part_of_mutated_storage_never_breaks_the_reader(count: int, tmp_path: Path) -> None:
    recording = one_recording(120)
    write_bag(recording, tmp_path / 'run')
    file = tmp_path / 'run' / 'run_0.mcap'
    for data in mutations(file.read_bytes(), count, seed=3):
        file.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', RecordingWarning)
            got = outcome(lambda: read_bag(tmp_path / 'run', partial=True), tmp_path / 'run')
        for name, channel in (got.channels if got else {}).items():
            if len(channel):  # a chunk has a checksum: what is in it is true
                assert channel.values.tobytes() in {
                    whole.values.tobytes() for whole in recording.channels.values()}, name


@pytest.mark.parametrize('count', COUNTS)
def test_damaged_metadata_is_refused_or_harmless(count: int, tmp_path: Path) -> None:
    recording = one_recording(120)
    write_bag(recording, tmp_path / 'run')
    file = tmp_path / 'run' / 'metadata.yaml'
    for data in mutations(file.read_bytes(), count, seed=4):
        file.write_bytes(data)
        got = outcome(lambda: read_bag(tmp_path / 'run'), tmp_path / 'run')
        assert got is None or got == recording


@pytest.mark.parametrize('count', COUNTS)
def test_cut_csv_is_refused(count: int, tmp_path: Path) -> None:
    recording = one_recording(120)
    path = tmp_path / 'run.csv'
    write_csv(recording, path)
    content = path.read_bytes()
    for size in random.Random(5).sample(range(len(content) - 1), min(count, len(content) - 1)):
        path.write_bytes(content[:size])
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', RecordingWarning)
            told = outcome(lambda: read_csv(path), path) is None
        if not told:  # all rows are there: the cut went through the very last number
            with pytest.warns(RecordingWarning, match='not ended'):
                read_csv(path)


@pytest.mark.parametrize('count', COUNTS)
def test_mutated_csv_is_refused_or_read_as_it_stands(count: int, tmp_path: Path) -> None:
    recording = one_recording(120)
    path = tmp_path / 'run.csv'
    write_csv(recording, path)
    content = path.read_bytes()
    rows = content.count(b'\n') - 1
    for data in mutations(content, count, seed=6):
        path.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', RecordingWarning)
            got = outcome(lambda: read_csv(path), path)
        assert got is None or len({
            int(t) for c in got.channels.values() for t in c.time_ns}) <= rows


@pytest.mark.parametrize('count', COUNTS)
def test_mutated_sheets_are_refused_or_sheets(count: int, tmp_path: Path) -> None:
    path = tmp_path / 'sheet.yaml'
    for data in mutations(SHEET.encode(), count, seed=8):
        path.write_bytes(data)
        sheet = outcome(lambda: load_sheet(path), path)
        if sheet is not None:
            assert sheet.circuit in (None, 'old', 'new')
            assert sheet.elevation_deg is None or -90 <= sheet.elevation_deg <= 180


@pytest.mark.parametrize('count', COUNTS)
def test_mutated_maps_are_refused_or_maps(count: int, tmp_path: Path) -> None:
    path, table = tmp_path / 'map.yaml', tmp_path / 'field.csv'
    table.write_text('junk\nt,r,e\n0,1,2\n1,3,4\n')
    for data in mutations(MAP.encode(), count, seed=9):
        path.write_bytes(data)
        import_map = outcome(lambda: load_map(path), path)
        if import_map is not None:
            got = outcome(lambda: import_file(table, import_map), table)
            assert got is None or len(got.channels) == len(import_map.signals)


@settings(max_examples=FEW, suppress_health_check=[HealthCheck.function_scoped_fixture],
          deadline=None)
@given(st.one_of(st.binary(max_size=200), st.text(max_size=200).map(
    lambda text: text.encode(errors='replace')), st.lists(
        st.sampled_from([*POISON, b'time_s', b'rate_command_rad_s', b'1', b'0.5', b'\n', b',']),
        max_size=40).map(b''.join)))
@pytest.mark.slow
def test_invented_files_are_refused_or_read(tmp_path: Path, data: bytes) -> None:
    for name, read in (('a.csv', read_csv), ('a.yaml', load_sheet), ('a.mcap', read_bag),
                       ('b.yaml', load_map)):
        path = tmp_path / name
        path.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', RecordingWarning)
            outcome(lambda: read(path), path)  # noqa: B023
        path.unlink()


def test_an_error_names_its_kind() -> None:
    assert issubclass(RecordingError, UserError)
