# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark: every figure a ratio of two things measured in turn, in one run."""
