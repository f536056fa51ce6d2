# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The machines of a trial that are no antenna: a robot joint and a linear axis.

As the antenna's, this program shares no code with the models that diagnose it: another integrator,
another friction, other forms of every effect. Those models are in the folder `models`, which
nothing here imports.
"""
