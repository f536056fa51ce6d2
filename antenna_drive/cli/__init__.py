# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A 34-m antenna's elevation drive, two motors with torque bias, on your own machine.

Run the drive as five ROS 2 nodes or in one process, repeat the article's experiments,
record, compare with a real drive, and find out where the two part.
"""

from antenna_drive import __version__
from simgap.command.program import Command, Program

COMMANDS = {
    'doctor': Command('doctor', 'say what is installed, what works, and what to do'),
    'completion': Command('completion', 'print the completion of this command for a shell'),
    'demo': Command('demo', 'run the saw-tooth test on the old and the new circuit, in five '
                            'processes'),
    'lockstep-check': Command('lockstep_check', 'compare five processes with one, sample by '
                                                'sample'),
    'live': Command('live', 'open a page to see and turn a running drive'),
    'compile': Command('compile_', 'compile the physics ahead of the first run'),
    'run': Command('run', 'run the drive in one process and write its signals'),
    'fmu': Command('fmu', 'write the drive as an FMU for other simulation programs'),
    'configure': Command('configure', 'make a configuration of your own drive from its data '
                                      'sheets'),
    'article': Command('article', "repeat the article's experiments and compare the figures"),
    'record': Command('record', 'record a run of the five nodes'),
    'export': Command('export', 'turn a recording into CSV'),
    'import': Command('import_', 'turn a CSV from the field into a recording'),
    'replay': Command('replay', 'drive the emulator with a recorded command'),
    'plot': Command('plot', 'draw the signals of a recording'),
    'report': Command('report', 'write a self-contained page about a recording'),
    'diagnose': Command('diagnose', 'say where a real drive and the model part, and why'),
    'propose': Command('propose', 'design the next test: the one that settles a verdict'),
    'investigate': Command('investigate', 'test a drive until it is clear what is wrong with it'),
    'check-model': Command('simgap.cli.check',
                           'tell what is wrong with a model of your own machine'),
    'predict': Command('predict', 'predict a recording that the diagnosis has not seen'),
    'diagnose-many': Command('diagnose_many', 'the diagnosis of many machines, one row each'),
    'confusability': Command('confusability', 'measure which effects can be told apart'),
}

PROGRAM = Program('antenna-drive', __name__, __version__, COMMANDS, {'calibrate': 'lab calibrate'})
main, make_parser = PROGRAM.main, PROGRAM.parser
