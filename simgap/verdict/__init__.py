# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The verdict: where the gap lies, which effect causes it, and how far it shrinks without it."""
