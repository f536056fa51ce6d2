# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The torque-share circuit of Fig. 14, with Filter 1, as a ROS 2 node."""

from __future__ import annotations

from collections.abc import Sequence
import sys

from antenna_drive.lockstep.entry import run_drive_unit


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run_drive_unit('torque_share', ('torque_share',), args, description=__doc__)


if __name__ == '__main__':
    sys.exit(main())
