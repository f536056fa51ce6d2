# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The search for effects: hypotheses, the moves between them, and the evidence that ranks them."""
