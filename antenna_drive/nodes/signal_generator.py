# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The test signals, and the owner of the run: its macro-step, pace and end, as a ROS 2 node.

With sheet:=next.yaml it plays the waveform of a test sheet, from the beginning of the run; a
parameter that is given beside it counts more.

With waveform:=external the command follows the Float64 topic test_signal/external [rad/s]. A rate
that the drive cannot reach is refused, unless run.external_limit [rad/s] allows it.
The services pause, resume, step, reset, play and state control the run, as in
  ros2 service call /test_signal/pause std_srvs/srv/Trigger
"""

from collections.abc import Mapping
from functools import partial
import math
from pathlib import Path
import sys
from typing import Any

from antenna_drive.lockstep.entry import run_drive_unit


def _greatest_rate(parameters: Any) -> float:
    """Return the rate that the drive can reach [rad/s]; another wiring may command an angle."""
    from antenna_drive.parameters.sets import Drive
    return parameters.greatest_rate if type(parameters) is Drive else math.inf


def _read_sheet(path: str) -> Mapping[str, Any]:
    """Return the settings that play the waveform of a test sheet."""
    from antenna_drive.recording.sheet_signal import settings_of
    return settings_of(Path(path))


main = partial(run_drive_unit, 'test_signal', ('test_signal',), description=__doc__,
               fed_by_topic={'external': _greatest_rate}, read_sheet=_read_sheet)

if __name__ == '__main__':
    sys.exit(main())
