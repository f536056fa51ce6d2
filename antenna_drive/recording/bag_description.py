# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The description of a bag, metadata.yaml: its storage files, topics, messages and times."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from antenna_drive.recording.bag import MESSAGE_HASH, MESSAGE_TYPE, ROSBAG2_VERSION
from antenna_drive.yaml_text import dump_yaml


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
