# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The five nodes of a drive in one line, for those who start everything with ros2 launch.

  ros2 launch examples/launch/drive_launch.py
  ros2 launch examples/launch/drive_launch.py namespace:=east config:=old_circuit

The nodes need no order and no launch file; five shells do the same (README, Running it by hand).
ros2 launch is on no package index. This file is therefore checked as Python only: a test runs
it with stand-ins for `launch` and compares the five nodes with the drive's own.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# executable by name of the node
NODES = {'test_signal': 'test_signal', 'torque_share': 'torque_share', 'motor_1': 'motor_drive',
         'motor_2': 'motor_drive', 'plant': 'rate_loop_plant'}
SIGNAL = {'waveform': 'saw_tooth', 'amplitude': 0.011956, 'period': 5.0}


def generate_launch_description() -> LaunchDescription:
    """Return the five nodes; if one of them ends, the others are ended as well."""
    config = LaunchConfiguration('config')
    return LaunchDescription([
        DeclareLaunchArgument('namespace', default_value='', description='of every node'),
        DeclareLaunchArgument('config', default_value='new_circuit',
                              description='configuration file, or the name of a set'),
        *(Node(package='antenna_drive', executable=executable, name=name,
               namespace=LaunchConfiguration('namespace'), output='screen',
               parameters=[{'config': [config], **(SIGNAL if name == 'test_signal' else {})}],
               on_exit=Shutdown())
          for name, executable in NODES.items()),
    ])
