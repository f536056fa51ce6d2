# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The physics of the drive: pure compiled functions, one block of the article a file."""
