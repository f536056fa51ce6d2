# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Test a drive until it is clear what is wrong with it: test, verdict, better test.

The first test is the one that detects most of the catalogue, or --first. After each test all
recordings are diagnosed, and the test that tells the answers apart is designed, run and recorded.
This ends when the verdict is --until sure of an answer that the verdict before also named: one
test alone decides nothing. One page tells the story.

  antenna-drive investigate --out found --real my_drive.yaml
  antenna-drive investigate --out found --set motor_1.motor.coulomb_torque=0.095 --until 0.9
  antenna-drive investigate --out found --by './run_on_the_antenna.sh {sheet} {out} {duration}'

The drive is one of five nodes, started for each test, with the configuration of --real and the
parameters of --set. Noise and digits of the sheet's sensors are added to what they say. With --by
a command of your own runs each test on any drive: it plays {sheet} for {duration} seconds and
writes the recording to {out}, a bag or CSV; {number} counts the tests. For a drive that runs
already these are test_signal with -p sheet:={sheet} and the recorder with -p out:={out}.

--out holds a file for each step. The same command goes on where an interrupted one was. The exit
code is 1 if nothing was decided.
"""

import argparse
from pathlib import Path
import shlex
import sys
from typing import TYPE_CHECKING

from antenna_drive.cli.options import add_settings_option, parse_settings
from simgap.cli.investigate import add_investigation_options, investigated, plan_of, played_by
from simgap.errors import UserError

if TYPE_CHECKING:
    from simgap.model.bench import Play


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_investigation_options(parser)
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration of the model; may be repeated')
    parser.add_argument('--real', action='append', default=[], metavar='FILE',
                        help='configuration of the five nodes that stand for the real drive')
    add_settings_option(parser)
    parser.add_argument('--by', metavar='COMMAND',
                        help='runs a test on another drive: with {sheet}, {out}, {duration} and '
                             '{number}')
    parser.add_argument('--first', type=Path, metavar='FILE', help='test sheet of the first test')
    parser.add_argument('--sheet', type=Path, metavar='FILE',
                        help='what is known of every test: circuit, bias pot, sensors')
    parser.add_argument('--limits', type=Path, metavar='FILE',
                        help='limits of the drive that no test may exceed (.yaml)')


def run(arguments: argparse.Namespace) -> int:
    """Investigate, and tell the story; 1 if nothing was decided."""
    plan, play = plan_of(arguments), _player(arguments)
    from antenna_drive.diagnosis.drive_limits import DriveLimits, read_limits
    from antenna_drive.diagnosis.investigation import DriveBench
    from antenna_drive.diagnosis.planned_tests import BUILT_IN
    from antenna_drive.diagnosis.sensors import SensorModel
    from antenna_drive.parameters.loading import load
    from antenna_drive.recording.sheet import load_sheet
    drive = load(*arguments.config)
    limits = (read_limits(arguments.limits, drive) if arguments.limits
              else DriveLimits.of_drive(drive))
    base = load_sheet(arguments.sheet) if arguments.sheet else BUILT_IN['square']
    first = load_sheet(arguments.first) if arguments.first else None
    if first is not None and first.waveform is None:
        raise UserError(f'{arguments.first}: waveform: is missing, there is nothing to play')
    bench = DriveBench(
        drive, limits, base, play, plan,
        # the nodes give true values, another drive what its sensors read
        None if arguments.by else SensorModel.of(base.sensors), arguments.jobs)
    return investigated(arguments, bench, plan, first)


def _player(arguments: argparse.Namespace) -> 'Play':
    """Return what runs a test: a command, or a drive of five nodes."""
    if arguments.by:
        if arguments.settings or arguments.real:
            raise UserError('--by: another drive has its own parameters; --real and --set are '
                            'those of the five nodes')
        return played_by(shlex.split(arguments.by), '{sheet}')
    # a fault of the middleware must not end an investigation
    parse_settings(arguments.settings)
    words = [sys.executable, '-m', 'antenna_drive', 'record', '--quiet', '--play', '{sheet}',
             '--out', '{out}', '--duration', '{duration}']
    for option, given in (('--config', arguments.real), ('--set', arguments.settings)):
        words += [option, *given] if given else []
    return played_by(words, '{sheet}')
