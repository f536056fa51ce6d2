# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive as a model for other programs: an FMU of FMI 2 or 3 for co-simulation."""
