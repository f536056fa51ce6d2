# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The browser of the tests, which the benchmark uses too."""

from lab.bench.chromium import EXECUTABLE, Page

__all__ = ['EXECUTABLE', 'Page']
