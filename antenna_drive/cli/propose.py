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
--objective sharpen asks for the test that makes the numbers of the likeliest answer most certain.
--objective detect needs no verdict: it asks for the first test, for the effects of --suspect or
for the whole catalogue. limits.yaml may hold rate_deg_s, acceleration_deg_s2, travel_deg,
current_A, voltage_V, axis_torque_N_m, hot_current_A and hot_s; what it lacks follows from the
configuration. With --model the machine is one of your own, and --out is a table of its commands.

The exit code is 1 if no test within the limits helps. docs/next-test.md has more.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import time
from typing import Any, TYPE_CHECKING

from antenna_drive.cli.verdict_file import findings_of, planning_of
from simgap.command.output import add_json_option, check_options, give, Progress, replaced
from simgap.errors import UserError
from simgap.inputs.schema import Entry

if TYPE_CHECKING:
    from simgap.next_test.candidate import Proposal
    from simgap.next_test.space import TestSpace

_OBJECTIVES = ('separate', 'sharpen', 'detect')
_RULES = ('d-optimal', 'random')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('verdict', nargs='?', type=Path, metavar='VERDICT',
                        help='JSON of a diagnosis; not needed with --objective detect')
    parser.add_argument('--objective', choices=_OBJECTIVES,
                        help='tell the answers apart, make numbers more certain, or find effects '
                             'at all (default: separate, or detect if no answers are open)')
    parser.add_argument('--suspect', nargs='+', default=[], metavar='EFFECT',
                        help='effects that --objective detect looks for (default: all)')
    parser.add_argument('--limits', type=Path, metavar='FILE',
                        help='limits of the drive that no test may exceed (.yaml)')
    parser.add_argument('--duration', type=float, default=30.0, metavar='S',
                        help='length of the test (default: 30)')
    parser.add_argument('--rate', type=float, default=200.0, metavar='HZ',
                        help='sample rate of the recording (default: 200)')
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration of the model; may be repeated')
    parser.add_argument('--model', metavar='FILE.py:NAME', help='a machine of your own')
    parser.add_argument('--sheet', type=Path, metavar='FILE',
                        help='what is known of the next test and is not to be changed: circuit, '
                             'bias pot, sensors (default: as in the tests so far)')
    parser.add_argument('--out', type=Path, metavar='FILE', help='write the test sheet to FILE')
    parser.add_argument('--report', type=Path, metavar='FILE', help='write a page to FILE')
    add_json_option(parser)
    parser.add_argument('--jobs', type=int, default=2, metavar='N',
                        help='tests that are simulated at once (default: 2)')
    parser.add_argument('--seed', type=int, default=0, metavar='N',
                        help='of the tests that are drawn (default: 0)')
    parser.add_argument('--rule', choices=_RULES,
                        help='choose by another rule, to compare with it')


def run(arguments: argparse.Namespace) -> int:
    """Search, and write what was asked for; 1 if no test within the limits helps."""
    check_options(arguments, jobs=Entry('', 1, whole=True), duration=Entry('s', 5.0, 600.0),
                  rate=Entry('Hz', 20.0, 10000.0), seed=Entry('', 0, whole=True))
    planning = _planning(arguments)
    from simgap.next_test.design import objective_for, TestDesign
    from simgap.next_test.proposal import as_data, contents, lines
    from simgap.next_test.rivals import Findings
    findings = findings_of(arguments.verdict, planning) if planning else Findings()
    objective = arguments.rule or arguments.objective or objective_for(findings)
    space = (_tests_of_own if arguments.model else _tests_of_drive)(arguments, planning)
    began = time.monotonic()
    with Progress('proposal', 1.0) as progress:
        try:
            found = TestDesign(space, findings, objective, arguments.suspect, arguments.jobs,
                               seed=arguments.seed).run(
                lambda share, doing: progress.update(share))
        except KeyError as error:
            raise UserError(f'{arguments.verdict}: {error.args[0]}: this configuration knows no '
                            'such effect; give the --config and --model of the diagnosis'
                            ) from error
    data = {**as_data(found, space), 'duration_s': arguments.duration,
            'sample_rate_hz': arguments.rate, 'seconds': time.monotonic() - began}
    if arguments.out and found.tests:
        _write(arguments.out, found, space, data)
    if arguments.report:
        from simgap.report.render import render
        with replaced(arguments.report) as stream:
            shown = contents(found, space)
            stream.write(render('proposal.html', **{**vars(shown), 'data': data}).encode())
    told = lines(data)
    if objective == 'detect' and not arguments.objective:
        told.insert(0, 'no answers to tell apart: this test looks for other effects')
    give(data, arguments.json, '\n'.join(told))
    return 0 if found.tests else 1


def _planning(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return what a verdict says for the design of a further test."""
    if arguments.verdict is None:
        if arguments.objective != 'detect':
            raise UserError('which verdict? The JSON of a diagnosis is needed; without one there '
                            'is --objective detect')
        return {}
    return planning_of(arguments.verdict)


def _tests_of_drive(arguments: argparse.Namespace, planning: dict[str, Any]) -> TestSpace:
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


def _tests_of_own(arguments: argparse.Namespace, planning: dict[str, Any]) -> TestSpace:
    from simgap.model import load_model, own_tests
    for option in ('config', 'limits', 'sheet'):
        if getattr(arguments, option):
            raise UserError(f'--{option}: does not go with --model; a model declares its own '
                            'tests and limits')
    return own_tests(load_model(arguments.model), arguments.duration)


def _write(path: Path, found: Proposal, space: TestSpace, data: dict[str, Any]) -> None:
    """Write the test that was found: a test sheet, or a table of commands."""
    from simgap.next_test.proposal import lines
    best = found.tests[0]
    heading = [f'{data["duration_s"]:g} s, at least {data["sample_rate_hz"]:g} samples per second',
               *(line.strip() for line in lines(data))]
    if data.get('channels'):
        shares = sorted(data['channels'].items(), key=lambda item: -item[1])
        heading.append('what tells: ' + ', '.join(
            f'{name} {100.0 * share:.0f} %' for name, share in shares if share > 0.005))
    for place, text in space.files(best.test, path).items():
        with replaced(place) as stream:
            if place.suffix == '.yaml':
                stream.write(''.join(f'# {line}\n' for line in heading).encode())
            stream.write(text.encode())
