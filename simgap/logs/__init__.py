# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Logs of tests: tables of any kind, maps of their columns, clocks and gaps."""
