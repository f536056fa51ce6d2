# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A two-motor antenna drive with torque bias, as a living system of ROS 2 nodes."""

__version__ = '0.1.0'
