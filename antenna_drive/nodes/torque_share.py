# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The torque-share circuit of Fig. 14, with Filter 1, as a ROS 2 node."""

from functools import partial
import sys

from antenna_drive.lockstep.entry import run_drive_unit

main = partial(run_drive_unit, 'torque_share', ('torque_share',), description=__doc__)

if __name__ == '__main__':
    sys.exit(main())
