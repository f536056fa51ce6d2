# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Plays the rate command of a recording to a drive, in the place of test_signal.

  ros2 run antenna_drive command_player RECORDING [--ros-args -p run.pace:=1.0]

RECORDING is a bag (folder or .mcap) or a .csv. The node owns the run as test_signal does and has
its run.* parameters; after the last sample the command stands still.
"""

from __future__ import annotations

from collections.abc import Sequence
import sys

from antenna_drive.errors import UserError

OK, BAD_INPUT = 0, 2


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    arguments = list(sys.argv[1:] if args is None else args)
    if '-h' in arguments or '--help' in arguments:
        print(__doc__.strip())
        return OK
    try:
        if not arguments or arguments[0].startswith('-'):
            raise UserError('which recording? command_player RECORDING [--ros-args ...]')
        from antenna_drive.recording.files import read_recording
        from antenna_drive.recording.replay import CommandUnit
        unit = CommandUnit(read_recording(arguments[0]))
    except UserError as error:
        print(f'command_player: {" ".join(str(error).split())}', file=sys.stderr)
        return BAD_INPUT
    from antenna_drive.lockstep.entry import run_unit
    return run_unit(unit, arguments[1:])


if __name__ == '__main__':
    sys.exit(main())
