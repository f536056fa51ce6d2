# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The search for effects: from the numbers known within a tolerance to pairs of effects."""
