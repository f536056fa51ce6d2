# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The contract between an engine and a machine: numbers, effects, tests and simulation."""
