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
Limits on the size of input: files, and messages of other programs.

A file of a few kilobytes can unpack into gigabytes, and a message can have any length. Each limit
is far above what a drive needs. An environment variable sets another limit.
"""

from __future__ import annotations

import os
from typing import NamedTuple

from antenna_drive.errors import one_line, UserError


class Limit(NamedTuple):
    """
    One limit.

    Attributes
    ----------
    variable : the environment variable that sets another limit
    default : the limit if it is not set
    what : the things that are counted, for the error message

    """

    variable: str
    default: int
    what: str

    def value(self) -> int:
        """
        Return the limit in force.

        Raises
        ------
        UserError : the variable is no whole number above zero

        """
        text = os.environ.get(self.variable, '')
        if not text:
            return self.default
        if not (text.isascii() and text.isdigit() and 0 < int(text[:18]) and len(text) <= 18):
            raise UserError(f'{self.variable}: {one_line(repr(text), 40)} given, allowed is a '
                            'whole number above 0')
        return int(text)

    def exceeded(self) -> str:
        """Return the message for input that exceeds the limit."""
        return (f'more than {self.value()} {self.what}; if that is meant, set '
                f'{self.variable} to a greater number')


SAMPLES = Limit('ANTENNA_DRIVE_MAX_SAMPLES', 200_000_000, 'samples in one recording')
SIGNALS = Limit('ANTENNA_DRIVE_MAX_SIGNALS', 10_000, 'signals in one recording')
CSV_LINE = Limit('ANTENNA_DRIVE_MAX_CSV_LINE', 1_000_000, 'characters in one line')
TEXT = Limit('ANTENNA_DRIVE_MAX_TEXT', 64 * 2**20, 'bytes of text')
BAG_RECORD = Limit('ANTENNA_DRIVE_MAX_BAG_RECORD', 64 * 2**20, 'bytes in one record of a bag')
BAG = Limit('ANTENNA_DRIVE_MAX_BAG', 16 * 2**30, 'bytes in a bag once it is unpacked')
FRAME = Limit('ANTENNA_DRIVE_MAX_FRAME', 65_536, 'bytes in a frame')
CHANGE = Limit('ANTENNA_DRIVE_MAX_CHANGE', 1_000_000, 'characters in what is said of changes')
LIMITS = (SAMPLES, SIGNALS, CSV_LINE, TEXT, BAG_RECORD, BAG, FRAME, CHANGE)
