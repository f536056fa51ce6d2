# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Limits on what a bag, a frame and a message of other programs may hold, see simgap's limits."""

from simgap.inputs.limits import Limit, LIMITS as INPUT_LIMITS

BAG_RECORD = Limit('ANTENNA_DRIVE_MAX_BAG_RECORD', 64 * 2**20, 'bytes in one record of a bag')
BAG = Limit('ANTENNA_DRIVE_MAX_BAG', 16 * 2**30, 'bytes in a bag once it is unpacked')
FRAME = Limit('ANTENNA_DRIVE_MAX_FRAME', 65_536, 'bytes in a frame')
CHANGE = Limit('ANTENNA_DRIVE_MAX_CHANGE', 1_000_000, 'characters in what is said of changes')
LIMITS = (*INPUT_LIMITS, BAG_RECORD, BAG, FRAME, CHANGE)
