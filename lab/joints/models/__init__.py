# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The models that diagnose the joint and the axis, as users write them by docs/own-machine.md.

They are data of the trial: each diagnosis is given the path of one.
"""
