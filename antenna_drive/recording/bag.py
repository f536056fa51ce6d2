# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
