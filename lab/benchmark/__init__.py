# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Cases from another's program, for any method that reads a folder and writes a JSON.

README.md beside this file is the whole task. MuJoCo simulates the machines; sealing and score are
those of the trials.
"""
