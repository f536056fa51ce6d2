# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A trial of the diagnosis: an independent 'real antenna', sealed cases, and a scorecard.

The 'real antenna' is a second program for the same drive, with its own equations, integrator and
forms of effects. It may not import the emulator, its physics or its parameters; a test checks it.
"""
