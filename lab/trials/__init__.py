# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Trials: sealed cases, the arms that answer them, and their scores."""
