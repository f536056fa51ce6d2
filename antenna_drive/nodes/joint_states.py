# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Publishes axis and motors as joints (sensor_msgs/JointState), for robotics tools.

It may come and go while the drive runs, and the drive does not wait for it.

  ros2 run antenna_drive joint_states
  ros2 run antenna_drive joint_states --ros-args -p publish_rate:=20.0 -r __ns:=/east
  ros2 run antenna_drive joint_states --ros-args -p joints:="['elevation', 'drive_1', 'drive_2']"

topic         joint             position       velocity         effort
joint_states  axis              plant/encoder  plant/axis_rate  torque of the gearboxes on the axis
motor_states  motor_1, motor_2  none           MOTOR/tach_rate  MOTOR/gear_torque, at the shaft

Units are rad, rad/s and N m. The drive has no signal for the angle of a motor, so the position of
the motors is empty. They have a topic of their own because sensor_msgs allows an empty field only
for all joints of a message, and because robot_state_publisher warns of each message without
positions.

The stamp is the simulated time of the step, that of the topic clock: start other tools with
use_sim_time:=true. A new run begins at 0 again.

publish_rate  messages for each simulated second and topic, 50 if not given; at most every step
joints        names of axis and motors, [axis, motor_1, motor_2] if not given
"""

from functools import partial
import sys

from antenna_drive.programs import run_program

main = partial(run_program, 'joint_states', __doc__, 'antenna_drive.nodes.joint_states_node')

if __name__ == '__main__':
    sys.exit(main())
