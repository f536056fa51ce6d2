# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A two-motor antenna drive with torque bias, as a living system of ROS 2 nodes."""

from importlib.util import find_spec
from pathlib import Path
import sys

if find_spec('simgap') is None:
    # a wheel carries the engine; the line that says where counts only in site-packages
    sys.path.append(str(Path(__file__).parent / 'carried'))

import antenna_drive.remedies  # noqa: E402,F401  (every program of the package says them)

__version__ = '0.1.0'
