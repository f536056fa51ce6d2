# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The position loop as a ROS 2 node."""

import sys

from antenna_drive.lockstep.entry import run_drive_unit


def main() -> int:
    """Run the node; return its exit code."""
    return run_drive_unit('position_loop', ('position_loop',), description=__doc__,
                          wiring='own_position_loop.wiring:POINTED')


if __name__ == '__main__':
    sys.exit(main())
