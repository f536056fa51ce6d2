# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A node whose shared memory was given away says so: real processes, real Fast DDS."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import sys

from antenna_drive.lockstep.processes import DriveProcesses
from antenna_drive.lockstep.shared_memory import is_cut_off
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.report import CUT_OFF  # noqa: E402, I100
from drive_watch import Watch  # noqa: E402

pytestmark = pytest.mark.skipif(sys.platform != 'linux', reason='looks into /proc')
WAITS = 'waiting for test_signal to begin a run'


def ports(pid: int) -> list[Path]:
    """Return the files of the ports at which a process listens."""
    links = [str(link.readlink()) for link in Path(f'/proc/{pid}/fd').iterdir()]
    return [Path(link.removesuffix('_el')) for link in links if '_port' in link]


def number(port: Path) -> int:
    return int(port.name.rpartition('port')[2])


@pytest.fixture
def plant() -> Iterator[DriveProcesses]:
    with DriveProcesses(order=('plant',)) as processes:
        yield processes


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_a_node_whose_port_was_removed_says_that_it_hears_nobody(plant: DriveProcesses) -> None:
    with Watch() as watch:
        pid = plant.process('plant').pid
        watch.until(lambda: watch.told().get('plant') == WAITS, 'a plant that waits')
        own = sorted(ports(pid), key=number)
        assert len(own) == 2
        assert not is_cut_off(Path(f'/proc/{pid}'))
        # as another process does that takes this one for dead
        own[0].unlink()
        assert not is_cut_off(Path(f'/proc/{pid}')), 'frames do not come that way'
        own[1].unlink()
        assert is_cut_off(Path(f'/proc/{pid}'))
        assert not is_cut_off(), 'we only send to it'
        watch.until(lambda: watch.told()['plant'] == WAITS + CUT_OFF, 'what happened to it')


def test_nothing_is_known_of_a_process_that_has_gone() -> None:
    assert not is_cut_off(Path('/proc/no_such_process'))
