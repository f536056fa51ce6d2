# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The rate-loop plant of Fig. 4 (hub, flexible modes, axis friction, encoder) as a ROS 2 node."""

from functools import partial
import sys

from antenna_drive.lockstep.entry import run_drive_unit

main = partial(run_drive_unit, 'plant', ('plant',), description=__doc__)

if __name__ == '__main__':
    sys.exit(main())
