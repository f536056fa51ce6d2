# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Plays the rate command of a recording to a drive, in the place of test_signal.

  ros2 run antenna_drive command_player run/
  ros2 run antenna_drive command_player run.csv --ros-args -p run.pace:=0.5

The recording is a bag (folder or .mcap) or a .csv. The node owns the run as test_signal does and
has its run.* parameters; after the last sample the command stands still.
"""

from functools import partial
import sys

from antenna_drive.programs import run_program
from simgap.errors import UserError


def _run(arguments: list[str]) -> int:
    if not arguments or arguments[0].startswith('-'):
        raise UserError('which recording? command_player RECORDING [--ros-args ...]')
    from antenna_drive.lockstep.entry import run_unit
    from antenna_drive.recording.files import read_recording
    from antenna_drive.recording.replay import CommandUnit
    return run_unit(CommandUnit(read_recording(arguments[0])), arguments[1:])


main = partial(run_program, 'command_player', __doc__, _run)

if __name__ == '__main__':
    sys.exit(main())
