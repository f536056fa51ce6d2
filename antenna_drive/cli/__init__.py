# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
A 34-m antenna's elevation drive, two motors with torque bias, on your own machine.

Run the drive as five ROS 2 nodes or in one process, repeat the article's experiments,
record, compare with a real drive, and find out where the two part.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import difflib
import importlib
import os
import sys
from typing import NamedTuple
import warnings

from antenna_drive import __version__
from antenna_drive.cli.interruption import interruptible
from antenna_drive.errors import UserError
from antenna_drive.programs import answered, BAD_INPUT, say
from antenna_drive.workers import expect_overflow

INTERRUPTED, BROKEN_PIPE = 130, 141  # 128 + the signal's number, as shells do

EXIT_CODES = """\
exit codes:
  0    done, and the answer, where there is one, is yes
  1    done, and the answer is no (a comparison failed, a check found a difference)
  2    wrong input: one line says which file, which entry, and what is allowed
  3    something is not installed: one line says what and how to get it
  130  interrupted
"""


class Command(NamedTuple):
    """One subcommand: the module that does it, and what it does in one line."""

    module: str
    summary: str


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
    'article': Command('article', "repeat the article's experiments and compare the figures"),
    'accuracy': Command('accuracy', 'measure how far a macro-step is from the converged run'),
    'calibrate': Command('calibrate', 'fit parameters to the published figures'),
    'record': Command('record', 'record a run of the five nodes'),
    'export': Command('export', 'turn a recording into CSV'),
    'import': Command('import_', 'turn a CSV from the field into a recording'),
    'replay': Command('replay', 'drive the emulator with a recorded command'),
    'plot': Command('plot', 'draw the signals of a recording'),
    'report': Command('report', 'write a self-contained page about a recording'),
    'diagnose': Command('diagnose', 'say where a real drive and the model part, and why'),
    'propose': Command('propose', 'design the next test: the one that settles a verdict'),
    'investigate': Command('investigate', 'test a drive until it is clear what is wrong with it'),
    'check-model': Command('check_model', 'tell what is wrong with a model of your own machine'),
    'predict': Command('predict', 'predict a recording that the diagnosis has not seen'),
    'diagnose-many': Command('diagnose_many', 'the diagnosis of many machines, one row each'),
    'trial': Command('trial', 'make sealed test cases with an independent antenna'),
    'trial-without': Command('trial_without', 'leave true effects out of the catalogue'),
    'trial-next': Command('trial_next', 'try designed tests on sealed cases'),
    'trial-test': Command('trial_test', 'make one test more on a sealed antenna'),
    'twin-trial': Command('twin_trial', 'test the twin on sealed antennas that change'),
    'score': Command('score', 'score the verdicts of a trial against its truths'),
    'thresholds': Command('thresholds', "list the diagnosis' thresholds and what they decide"),
    'servo': Command('servo', 'say what the model of an ordinary servo lacks'),
    'confusability': Command('confusability', 'measure which effects can be told apart'),
    'bench': Command('bench', 'measure speed'),
    'campaign': Command('campaign', 'look for faults: kills, garbage, damaged files, full disks'),
}


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run the antenna-drive command.

    Parameters
    ----------
    argv
        arguments without the program's name; None for those of the process

    Returns
    -------
    the exit code, one of those that `antenna-drive --help` lists

    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    # No option before the command takes a value, so the first plain word is the command.
    name = next((word for word in arguments if not word.startswith('-')), '')
    program = f'antenna-drive {name}'.rstrip()
    try:
        try:
            with interruptible(lambda: say(program, 'interrupted', INTERRUPTED)):
                with warnings.catch_warnings():
                    expect_overflow()
                    return answered(program, lambda: _run(name, arguments))
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        # The reader has gone. Python would complain again when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except KeyboardInterrupt:
        return say(program, 'interrupted', INTERRUPTED)
    except OSError as error:
        if error.strerror is None:
            raise
        place = f'{error.filename}: ' if error.filename else ''
        return say(program, f'{place}{error.strerror}', BAD_INPUT)


def _run(name: str, arguments: list[str]) -> int:
    if name and name not in COMMANDS:
        close = difflib.get_close_matches(name, COMMANDS, n=1)
        guess = f'did you mean {close[0]}?' if close else 'antenna-drive --help lists them'
        raise UserError(f'no such command, {guess}')
    parsed = make_parser(name).parse_args(arguments)
    # parse_args has left by now unless there was a command
    return int(importlib.import_module(f'{__name__}.{COMMANDS[name].module}').run(parsed))


def make_parser(*names: str) -> argparse.ArgumentParser:
    """
    Return the parser of the command line.

    Only the commands in `names` know their arguments, because only these are imported: the
    compiled physics takes a while to load.
    """
    parser = argparse.ArgumentParser(
        prog='antenna-drive', description=__doc__, epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--version', action='version', version=f'antenna-drive {__version__}')
    subparsers = parser.add_subparsers(metavar='COMMAND', required=True)
    for command_name, command in COMMANDS.items():
        if command_name not in names:
            subparsers.add_parser(command_name, help=command.summary)
            continue
        module = importlib.import_module(f'{__name__}.{command.module}')
        module.add_arguments(subparsers.add_parser(
            command_name, help=command.summary, description=module.__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter))
    return parser
