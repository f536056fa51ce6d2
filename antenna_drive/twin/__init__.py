# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The twin: the emulator beside a real drive, and what it says of the two."""
