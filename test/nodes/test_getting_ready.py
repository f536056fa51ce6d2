# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A node whose physics is not compiled yet says so, and how far it is."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from drive_watch import Watch  # noqa: E402

UNIT = 'torque_share'  # the quickest to compile


@pytest.mark.slow
def test_compiling_is_told_from_its_beginning(tmp_path: Path, node_domain: int) -> None:
    with Watch() as watch, DriveProcesses(
            order=[UNIT], environment={'NUMBA_CACHE_DIR': str(tmp_path)}) as processes:
        watch.until(lambda: 'compiling the physics' in processes.log(UNIT), 'the log')
        watch.until(lambda: watch.told().get(UNIT, '').startswith('compiling the physics'),
                    'a report of compiling')
        watch.until(lambda: int(watch.value(UNIT, 'compiled functions') or 0) > 0, 'progress')
        watch.until(lambda: 'waiting for' in watch.told()[UNIT], 'the end of it')
        assert 'compiled ' in processes.log(UNIT)
    # what was compiled is kept, and nothing is said of it again
    with Watch() as watch, DriveProcesses(
            order=[UNIT], environment={'NUMBA_CACHE_DIR': str(tmp_path)}) as processes:
        watch.until(lambda: 'waiting for' in watch.told().get(UNIT, ''), 'the node')
        assert 'compil' not in processes.log(UNIT)
