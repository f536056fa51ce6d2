# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The sim-to-real gap: where it lies, which effect causes it, how far it shrinks."""
