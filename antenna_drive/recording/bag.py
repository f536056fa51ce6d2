# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How a recording lies in a bag: a rosbag2 folder with MCAP storage, which ROS 2 tools open.

One std_msgs/Float64 topic per signal, '/unit/signal'; the log time is simulated time, the
sequence number is the step. Attachments hold the configuration and the notes (JSON) and the test
sheet (YAML); a metadata record holds each live change. The mcap library writes and reads the
storage; nothing here needs ROS 2.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from antenna_drive.yaml_text import dump_yaml

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


@dataclass
class StorageFile:
    """A file of a bag: when it was begun [s], its messages by topic, its time stamps [ns]."""

    name: str
    began_at: float
    counts: list[int]
    first_ns: int = 2**63 - 1
    last_ns: int = -1

    def reaches(self, time_ns: int) -> None:
        """Note the time stamp of a sample."""
        self.first_ns = min(time_ns, self.first_ns)
        self.last_ns = max(time_ns, self.last_ns)

    def span(self) -> dict[str, Any]:
        """Return what rosbag2 says of it."""
        count = sum(self.counts)
        return {
            'starting_time': {'nanoseconds_since_epoch': self.first_ns if count else 0},
            'duration': {'nanoseconds': self.last_ns - self.first_ns if count else 0},
            'message_count': count}


def description(signals: Iterable[str], files: Sequence[StorageFile]) -> str:
    """Return the text of metadata.yaml for the signals of a bag, in order, and its files."""
    whole = StorageFile(
        '', 0.0, [sum(own) for own in zip(*(f.counts for f in files), strict=True)],
        min(f.first_ns for f in files), max(f.last_ns for f in files))
    topics = [
        {'topic_metadata': {
            'name': f'/{name}', 'type': MESSAGE_TYPE, 'serialization_format': 'cdr',
            'offered_qos_profiles': '', 'type_description_hash': MESSAGE_HASH},
         'message_count': number}
        for name, number in zip(signals, whole.counts, strict=True)]
    return dump_yaml({'rosbag2_bagfile_information': {
        'version': ROSBAG2_VERSION, 'storage_identifier': 'mcap',
        **whole.span(),
        'topics_with_message_count': topics,
        'compression_format': '', 'compression_mode': '',
        'relative_file_paths': [file.name for file in files],
        'files': [{'path': file.name, **file.span()} for file in files],
        'custom_data': {}, 'ros_distro': 'unknown'}})
