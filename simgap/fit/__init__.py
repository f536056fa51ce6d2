# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The fit of numbers to recordings: least squares, noise and residuals."""
