# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Fitting parameters to published or measured figures, and how well these determine them."""
