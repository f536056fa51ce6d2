# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The laboratory: sealed trials, fault campaigns and benchmarks of the diagnosis and the drive.

It runs from a checkout and is never installed with the drive. lab/README.md says what is what.
"""

from lab import __version__
from simgap.command.program import Command, Program
from simgap.command.remedies import REMEDIES

COMMANDS = {
    'trial': Command('trial', 'make sealed test cases with an independent antenna'),
    'trial-without': Command('trial_without', 'leave true effects out of the catalogue'),
    'trial-next': Command('trial_next', 'try designed tests on sealed cases'),
    'trial-test': Command('trial_test', 'make one test more on a sealed antenna'),
    'twin-trial': Command('twin_trial', 'test the twin on sealed antennas that change'),
    'score': Command('score', 'score the verdicts of a trial against its truths'),
    'benchmark': Command('benchmark', 'put any method beside others on cases by MuJoCo'),
    'servo': Command('servo', 'say what the model of an ordinary servo lacks'),
    'calibrate': Command('calibrate', 'fit parameters to the published figures'),
    'bench': Command('bench', 'measure speed'),
    'accuracy': Command('accuracy', 'measure how far a macro-step is from the converged run'),
    'campaign': Command('campaign', 'look for faults: kills, garbage, damaged files, full disks'),
}

REMEDIES['cma'] = 'make set-up, or pip install cma'
PROGRAM = Program('lab', __name__, __version__, COMMANDS)
main, make_parser = PROGRAM.main, PROGRAM.parser
