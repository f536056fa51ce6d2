# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Says why a real machine and its simulation part: where, which effect, and how far it shrinks.

Give a model of the machine and logs of its tests. simgap/README.md leads from there to a verdict.
"""

from simgap import __version__
from simgap.command.program import Command, Program

COMMANDS = {
    'inspect': Command('inspect_', 'say what is in a recording, and write a first map of it'),
    'machine-from': Command('machine_from', 'make a model of a joint from MJCF or URDF'),
    'check': Command('check', 'say what is wrong with a model, before any fit'),
    'diagnose': Command('diagnose', 'say where machine and model part, and why'),
    'propose': Command('propose', 'design the next test: the one that settles a verdict'),
    'investigate': Command('investigate',
                           'test a machine until it is clear what is wrong with it')}
PROGRAM = Program('simgap', __name__, __version__, COMMANDS)
main, make_parser = PROGRAM.main, PROGRAM.parser
