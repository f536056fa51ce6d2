# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Design the next test: the one that tells the answers of a verdict apart.

The verdict of `antenna-drive diagnose --json` names several answers that its recordings cannot
tell apart. This command searches tests of eight kinds, with their amplitudes, periods, bias and
elevation, for the one that settles most, within the limits of the drive. It writes a test sheet
that test_signal plays and `diagnose` reads:

  antenna-drive diagnose rec_a.csv rec_b.csv --json verdict.json
  antenna-drive propose verdict.json --out next.yaml --report next.html
  ros2 run antenna_drive test_signal --ros-args -p sheet:=next.yaml

If one answer is left or sure, or something without a name is likelier than each answer, the test
looks for other effects, as with --objective detect.
--objective detect needs no verdict: it asks for the first test, for the effects of --suspect or
for the whole catalogue. limits.yaml may hold rate_deg_s, acceleration_deg_s2, travel_deg,
current_A, voltage_V, axis_torque_N_m, hot_current_A and hot_s; what it lacks follows from the
configuration. With --model the machine is one of your own, and --out is a table of its commands.

The exit code is 1 if no test within the limits helps. docs/next-test.md has more.
"""

import argparse
from pathlib import Path
from typing import Any, TYPE_CHECKING

from simgap.cli.propose import add_proposal_options, proposed, tests_of
from simgap.errors import UserError

if TYPE_CHECKING:
    from simgap.next_test.space import TestSpace


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_proposal_options(parser)
    parser.add_argument('--limits', type=Path, metavar='FILE',
                        help='limits of the drive that no test may exceed (.yaml)')
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration of the model; may be repeated')
    parser.add_argument('--model', metavar='FILE.py:NAME', help='a machine of your own')
    parser.add_argument('--sheet', type=Path, metavar='FILE',
                        help='what is known of the next test and is not to be changed: circuit, '
                             'bias pot, sensors (default: as in the tests so far)')


def run(arguments: argparse.Namespace) -> int:
    """Search, and write what was asked for; 1 if no test within the limits helps."""
    if not arguments.model:
        return proposed(arguments, lambda planning: _tests_of_drive(arguments, planning))
    for option in ('config', 'limits', 'sheet'):
        if getattr(arguments, option):
            raise UserError(f'--{option}: does not go with --model; a model declares its own '
                            'tests and limits')
    return proposed(arguments, lambda planning: tests_of(arguments.model, arguments.duration))


def _tests_of_drive(arguments: argparse.Namespace, planning: dict[str, Any]) -> 'TestSpace':
    from antenna_drive.diagnosis.allowed_tests import AntennaTests
    from antenna_drive.diagnosis.drive_limits import DriveLimits, read_limits
    from antenna_drive.diagnosis.planned_tests import BUILT_IN
    from antenna_drive.parameters.loading import load
    from antenna_drive.recording.sheet import load_sheet, parse_sheet
    drive = load(*arguments.config)
    limits = (read_limits(arguments.limits, drive) if arguments.limits
              else DriveLimits.of_drive(drive))
    if arguments.sheet:
        base = load_sheet(arguments.sheet)
    elif 'sheet' in planning:
        base = parse_sheet(planning['sheet'])
    elif planning:
        raise UserError(f'{arguments.verdict}: its tests carry labels or are not of this drive; '
                        'give what the next test has in common with them as --sheet')
    else:
        base = BUILT_IN['square']
    return AntennaTests(base, drive, limits, arguments.duration)
