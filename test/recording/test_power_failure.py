# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a failure of the power leaves of a bag: what the disk was made to hold, and no less."""

from __future__ import annotations

from io import BytesIO
import os
from pathlib import Path
import stat

from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import BagWriter
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
import pytest
from simgap.logs.channel import RecordingWarning

SYNC_S = 2.0


class Disk:
    """Notes how much of a storage file the disk was made to hold, and when."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 0.0
        self.held: list[tuple[float, int]] = []  # time [s], bytes
        self.folders: set[str] = set()
        self._fsync = os.fsync
        monkeypatch.setattr(os, 'fsync', self._note)

    def _note(self, handle: int) -> None:
        self._fsync(handle)
        status, path = os.fstat(handle), os.readlink(f'/proc/self/fd/{handle}')
        if path.endswith('.mcap'):
            self.held.append((self.now, status.st_size))
        elif stat.S_ISDIR(status.st_mode):
            self.folders.add(path)


def steps_in(content: bytes) -> list[int]:
    """Return the steps that the mcap library finds in a file that ends early."""
    steps = []
    with pytest.raises(EndOfFile):
        for _, _, message in NonSeekingReader(BytesIO(content)).iter_messages(
                log_time_order=False):
            steps.append(message.sequence)
    return steps


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    """Return what the disk holds."""
    return Disk(monkeypatch)


def test_what_was_synchronised_is_there_after_a_power_failure(
        tmp_path: Path, disk: Disk) -> None:
    bag = BagWriter(tmp_path / 'run', {'plant/encoder': 'rad'}, sync_s=SYNC_S,
                    clock=lambda: disk.now)
    file = tmp_path / 'run' / 'run_0.mcap'
    claimed: list[int] = []
    for k in range(20_000):
        disk.now = 1e-3 * k
        bag.write(k, 1_000_000 * k, [float(k)])
        if len(disk.held) > len(claimed):
            claimed.append(bag.synced_ns)
    whole = file.read_bytes()
    assert len(claimed) > 5
    for (_, size), synced_ns in zip(disk.held, claimed, strict=True):
        steps = steps_in(whole[:size])
        assert steps == list(range(len(steps)))
        assert len(steps) - 1 == (synced_ns // 1_000_000 if synced_ns >= 0 else -1)
    times = [now for now, _ in disk.held]
    # as many seconds, and the rest of a chunk
    assert max(b - a for a, b in zip(times, times[1:])) <= SYNC_S + 0.5 + 1e-3
    assert {str(tmp_path), str(tmp_path / 'run')} <= disk.folders
    (tmp_path / 'cut.mcap').write_bytes(whole[:disk.held[-1][1] + 100])
    with pytest.warns(RecordingWarning, match='read up to'):
        assert len(read_bag(tmp_path / 'cut.mcap', partial=True)['plant/encoder']) > 17_000
    bag.close()


def test_without_the_option_the_disk_is_asked_at_the_end_only(
        tmp_path: Path, disk: Disk) -> None:
    with BagWriter(tmp_path / 'run', {'plant/encoder': 'rad'}, clock=lambda: disk.now) as bag:
        for k in range(5000):
            disk.now = 1e-3 * k
            bag.write(k, 1_000_000 * k, [float(k)])
        assert disk.held == []
    assert len(disk.held) == 1
    assert len(read_bag(tmp_path / 'run')['plant/encoder']) == 5000
    assert disk.held[0][1] == (tmp_path / 'run' / 'run_0.mcap').stat().st_size
    assert str(tmp_path / 'run') in disk.folders, 'metadata.yaml too'
