# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
One motor with its amplifiers and gearbox, G_o of Fig. 6, as a ROS 2 node.

It is motor_1 unless it is named motor_2: --ros-args -r __node:=motor_2
"""

from functools import partial
import sys

from antenna_drive.lockstep.entry import run_drive_unit

main = partial(run_drive_unit, 'motor_1', ('motor_1', 'motor_2'), description=__doc__)

if __name__ == '__main__':
    sys.exit(main())
