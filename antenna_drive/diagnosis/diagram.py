# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of the drive: from the rate command on the left to the encoder on the right."""

from antenna_drive.readings import NAMED
from simgap.machine.diagram import Diagram, DiagramBlock

DIAGRAM = Diagram(
    blocks=(
        DiagramBlock('loop', 'rate command', 10, 95, 120),
        DiagramBlock('current_1', NAMED['current_1'].label, 170, 2, 175),
        DiagramBlock('motor_1', 'motor 1, amplifiers', 170, 30, 175),
        DiagramBlock('torque_share', 'torque share, Filter 1', 170, 95, 175),
        DiagramBlock('motor_2', 'motor 2, amplifiers', 170, 160, 175),
        DiagramBlock('current_2', NAMED['current_2'].label, 170, 188, 175),
        DiagramBlock('tach_1', NAMED['tach_1'].label, 380, 2, 100),
        DiagramBlock('gearbox_1', 'gearbox 1', 380, 30, 100),
        DiagramBlock('bias_voltage', NAMED['bias_voltage'].label, 380, 95, 100),
        DiagramBlock('gearbox_2', 'gearbox 2', 380, 160, 100),
        DiagramBlock('tach_2', NAMED['tach_2'].label, 380, 188, 100),
        DiagramBlock('axis', 'axis and dish', 530, 95, 130),
        DiagramBlock('encoder', NAMED['encoder'].label, 700, 95, 100),
    ),
    lines=(
        (130, 104, 170, 44), (130, 112, 170, 172), (345, 43, 380, 43), (345, 173, 380, 173),
        (480, 43, 530, 102), (480, 173, 530, 114), (660, 108, 700, 108), (255, 95, 255, 56),
        (255, 121, 255, 160), (345, 108, 380, 108),
    ),
    several={'motors': ('motor_1', 'motor_2')},
)
