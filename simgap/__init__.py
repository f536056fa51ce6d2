# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Says why a real machine and its simulation part: where, which effect, and how far it shrinks."""

__version__ = '0.1.0'
