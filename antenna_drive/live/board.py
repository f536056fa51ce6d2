# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What every open page is to know: the last word on each subject, from any thread."""

from collections.abc import Iterator
import json
from threading import Lock
from typing import Any


class Board:
    """
    Notices by subject; a new one takes the place of the one before.

    Each reader keeps the numbers of the notices that it has read. A slow one misses those that
    were replaced meanwhile; nothing is kept for it, so memory does not grow.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._count = 0
        self._notices: dict[str, tuple[int, str]] = {}

    def post(self, subject: str, content: dict[str, Any]) -> None:
        """Put up a notice: `content` with its kind, the first word of the subject."""
        text = json.dumps({'kind': subject.partition(' ')[0], **content}, allow_nan=False)
        with self._lock:
            before = self._notices.get(subject)
            if before is None or before[1] != text:
                self._count += 1
                self._notices[subject] = (self._count, text)

    def news(self, read: dict[str, int]) -> Iterator[str]:
        """Yield the notices that were not read; note in `read`, by subject, that they are."""
        with self._lock:
            fresh = [(number, subject, text) for subject, (number, text) in self._notices.items()
                     if read.get(subject) != number]
        for number, subject, text in sorted(fresh):
            read[subject] = number
            yield text
