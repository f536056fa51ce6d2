# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a plain installation may lack, and how to get it."""

from __future__ import annotations

ROS_REMEDY = ("source a ROS 2 installation, or on x86-64 Linux: pip install 'ros-rclpy[fastrtps]' "
              'ros-std-msgs ros-std-srvs ros-rosgraph-msgs ros-diagnostic-msgs '
              'ros-sensor-msgs')
REMEDIES = {
    'rclpy': ROS_REMEDY,
    'rcl_interfaces': ROS_REMEDY,
    'std_msgs': ROS_REMEDY,
    'std_srvs': ROS_REMEDY,
    'rosgraph_msgs': ROS_REMEDY,
    'diagnostic_msgs': ROS_REMEDY,
    'sensor_msgs': ROS_REMEDY,
    'jinja2': 'pip install Jinja2',
    'matplotlib': 'pip install matplotlib',
    'mcap': 'pip install mcap',
    'cma': 'pip install cma',
    'distributed': "pip install 'dask[distributed]'",
    'shtab': 'pip install shtab',
    'tornado': 'pip install tornado',
    'foxglove': 'pip install foxglove-sdk',
    'mujoco': 'pip install mujoco',
    'fmpy': 'pip install fmpy',
}


def remedy(error: ModuleNotFoundError) -> str | None:
    """Return in one line what is missing and how to get it; None if the program is at fault."""
    missing = (error.name or '').partition('.')[0]
    return f'needs {missing}: {REMEDIES[missing]}' if missing in REMEDIES else None
