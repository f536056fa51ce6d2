# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A campaign that looks for faults of the drive by itself, with a seed for each trial."""
