# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Limits on the size of input files.

A file of a few kilobytes can unpack into gigabytes. Each limit is far above what a machine needs.
An environment variable sets another limit.
"""

import os
from typing import NamedTuple

from simgap.errors import one_line, UserError


class Limit(NamedTuple):
    variable: str  # of the environment, sets another limit
    default: int  # if it is not set
    what: str  # the things that are counted, for the error message

    def value(self) -> int:
        """Return the limit in force; UserError if the variable is no whole number above zero."""
        text = os.environ.get(self.variable, '')
        if not text:
            return self.default
        if not (text.isascii() and text.isdigit() and 0 < int(text[:18]) and len(text) <= 18):
            raise UserError(f'{self.variable}: {one_line(repr(text), 40)} given, allowed is a '
                            'whole number above 0')
        return int(text)

    def exceeded(self) -> str:
        return (f'more than {self.value()} {self.what}; if that is meant, set '
                f'{self.variable} to a greater number')


SAMPLES = Limit('SIMGAP_MAX_SAMPLES', 200_000_000, 'samples in one recording')
SIGNALS = Limit('SIMGAP_MAX_SIGNALS', 10_000, 'signals in one recording')
CSV_LINE = Limit('SIMGAP_MAX_CSV_LINE', 1_000_000, 'characters in one line')
TEXT = Limit('SIMGAP_MAX_TEXT', 64 * 2**20, 'bytes of text')
LIMITS = (SAMPLES, SIGNALS, CSV_LINE, TEXT)
