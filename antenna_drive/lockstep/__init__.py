# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The exchange between nodes: frames, the barrier, pacing and faults."""
