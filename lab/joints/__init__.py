# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The machines of a trial other than the antenna: a robot joint and a linear axis.

Like the antenna, this program shares no code with the models that diagnose it: it has another
integrator, another friction and other forms of every effect. Nothing here imports those `models`.
"""
