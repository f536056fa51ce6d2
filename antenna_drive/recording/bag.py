# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How a recording lies in a bag: a rosbag2 folder with MCAP storage, which ROS 2 tools open.

One std_msgs/Float64 topic per signal, '/unit/signal'; the log time is simulated time, the
sequence number is the step. Attachments hold the configuration and the notes (JSON) and the test
sheet (YAML); a metadata record holds each live change. The mcap library writes and reads the
storage; nothing here needs ROS 2.
"""

METADATA = 'metadata.yaml'
MESSAGE_TYPE = 'std_msgs/msg/Float64'
MESSAGE_DEFINITION = b'float64 data\n'
# REP-2011 hash of the type, as ROS 2 computes it
MESSAGE_HASH = 'RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a'
# encapsulation: little-endian CDR
CDR_HEADER = b'\x00\x01\x00\x00'
CONFIGURATION, NOTES = 'configuration.json', 'notes.json'
FORMAT, CHANGE = 'antenna_drive/recording', 'antenna_drive/change'
FORMAT_VERSION = '1'
# Version 8 is what every rosbag2 since Iron reads; in 9 the quality of service is a list, which
# older ones do not understand.
ROSBAG2_VERSION = 8
