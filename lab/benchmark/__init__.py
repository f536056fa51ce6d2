# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Cases from another's program, for any method that reads a folder; README.md is the task."""
