# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a plain installation of the drive may lack, and how to get it."""

from antenna_drive.ros_releases import wheels
from simgap.command.remedies import REMEDIES

ROS_REMEDY = ('source a ROS 2 installation, or on x86-64 Linux: pip install '
              + ' '.join(f"'{wheel}'" for wheel in wheels()))
REMEDIES.update(dict.fromkeys((
    'rclpy', 'rcl_interfaces', 'std_msgs', 'std_srvs', 'rosgraph_msgs', 'diagnostic_msgs',
    'sensor_msgs'), ROS_REMEDY))
REMEDIES.update({
    'matplotlib': 'pip install matplotlib',
    'distributed': "pip install 'dask[distributed]'",
    'shtab': 'pip install shtab',
    'tornado': 'pip install tornado',
    'pyarrow': 'pip install pyarrow',
    'pythonfmu': 'pip install pythonfmu',
    'pythonfmu3': 'pip install pythonfmu3',
})
