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
One motor with its amplifiers and gearbox, G_o of Fig. 6, as a ROS 2 node.

It is motor_1 unless it is named motor_2: --ros-args -r __node:=motor_2
"""

from __future__ import annotations

from collections.abc import Sequence
import sys

from antenna_drive.lockstep.entry import run_drive_unit


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run_drive_unit('motor_1', ('motor_1', 'motor_2'), args, description=__doc__)


if __name__ == '__main__':
    sys.exit(main())
