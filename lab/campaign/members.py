# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Members of a drive beside its nodes, each a process: a recorder and an observer.

  python -m lab.campaign.members recorder FOLDER --ros-args -r __node:=NAME
  python -m lab.campaign.members observer [SECONDS] --ros-args -r __node:=NAME

The recorder writes to a new folder in FOLDER at each start, as a supervisor would restart it. The
observer takes SECONDS for each step.
"""

import os
from pathlib import Path
import re
import signal
import sys
import time
from types import FrameType

from antenna_drive.programs import end_with_starter


def main(arguments: list[str]) -> int:
    """Be a member until SIGINT or SIGTERM."""
    end_with_starter()
    kind, *own = arguments[:arguments.index('--ros-args')]
    ros = arguments[arguments.index('--ros-args'):]
    if kind == 'recorder':
        folder = Path(own[0])
        folder.mkdir(parents=True, exist_ok=True)
        bag = folder / f'start_{time.time_ns()}'
        os.execv(sys.executable, [sys.executable, '-m', 'antenna_drive.nodes.recorder', *ros,
                                  '-p', f'out:={bag}'])
    return _observe(own, ' '.join(ros))


def _observe(own: list[str], ros: str) -> int:
    from antenna_drive.lockstep.observer import Observer
    nap_s = sum(map(float, own))
    ended = False

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal ended
        ended = True

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    name, namespace = (re.search(rf'__{key}:=(\S+)', ros) for key in ('node', 'ns'))
    assert name is not None
    with Observer(name[1], lambda step, time_s, samples: time.sleep(nap_s),
                  namespace=namespace[1] if namespace else '') as observer:
        observer.spin(lambda: ended)
        if observer.lost:
            print(f'lost {observer.lost}', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
