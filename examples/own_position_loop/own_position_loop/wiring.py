# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive with a position loop: six units, the motors fed by the loop's rate command."""

from pathlib import Path

from antenna_drive.emulator.wiring import DRIVE, Wired
from own_position_loop.physics import BLOCK

POINTED = DRIVE.plus(
    Path(__file__).with_name('position_loop.yaml'),
    position_loop=Wired(BLOCK, 'own_position_loop.node').fed(encoder='plant/encoder'),
    motor_1=DRIVE.units['motor_1'].fed(rate_command='position_loop/rate_command'),
    motor_2=DRIVE.units['motor_2'].fed(rate_command='position_loop/rate_command'))
