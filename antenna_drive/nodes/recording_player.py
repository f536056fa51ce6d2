# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Plays a recording as topics, as a real drive would send them: to try the twin without a drive.

  ros2 run antenna_drive recording_player run/
  ros2 run antenna_drive recording_player run.csv --ros-args -p real:=/elevation -p pace:=1.0

The recording is a bag (folder or .mcap) or a .csv. Each signal goes to <real>/<signal> (Float64),
and each row to <real>/row (Float64MultiArray): the time in seconds, then the signals in the order
that the log names. It begins when somebody listens, and ends with the recording.

real   namespace of the topics, 'real' if not given
pace   as a multiple of real time, 1.0 if not given. A twin needs the row's time at any other pace
"""

from functools import partial
import sys

from antenna_drive.programs import run_program
from simgap.errors import UserError


def _run(arguments: list[str]) -> int:
    if not arguments or arguments[0].startswith('-'):
        raise UserError('which recording? recording_player RECORDING [--ros-args ...]')
    from antenna_drive.nodes.recording_player_node import run
    return run(arguments[0], arguments[1:])


main = partial(run_program, 'recording_player', __doc__, _run)

if __name__ == '__main__':
    sys.exit(main())
