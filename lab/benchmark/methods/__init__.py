# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Entries of the benchmark: ours, and what people would use instead, on the same base model."""
