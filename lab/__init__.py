# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The laboratory: sealed trials, campaigns and benchmarks of simgap and antenna_drive."""

__version__ = '0.1.0'
