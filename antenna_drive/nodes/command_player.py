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
from antenna_drive.programs import run_program


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run_program('command_player', __doc__, args, _run)


def _run(arguments: list[str]) -> int:
    if not arguments or arguments[0].startswith('-'):
        raise UserError('which recording? command_player RECORDING [--ros-args ...]')
    from antenna_drive.lockstep.entry import run_unit
    from antenna_drive.recording.files import read_recording
    from antenna_drive.recording.replay import CommandUnit
    return run_unit(CommandUnit(read_recording(arguments[0])), arguments[1:])


if __name__ == '__main__':
    sys.exit(main())
