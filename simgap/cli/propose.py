# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Design the next test: the one that tells the answers of a verdict apart.

The verdict of `simgap diagnose --json` names several answers that its logs cannot tell apart. The
tests that the model declares are searched for the one that settles most, within its limits:

  simgap diagnose my_machine.py a.csv b.csv --json verdict.json
  simgap propose verdict.json --model my_machine.py --out next.csv --report next.html

If one answer is left or sure, or something without a name is likelier than each answer, the test
looks for other effects, as with --objective detect. --objective detect needs no verdict.

The exit code is 1 if no test within the limits helps.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
import time
from typing import Any, TYPE_CHECKING

from simgap.command.output import add_json_option, check_options, give, Progress, replaced
from simgap.command.verdict_file import findings_of, planning_of
from simgap.errors import UserError
from simgap.inputs.schema import Entry

if TYPE_CHECKING:
    from simgap.next_test.candidate import Proposal
    from simgap.next_test.space import TestSpace


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_proposal_options(parser)
    parser.add_argument('--model', metavar='MODEL', required=True, help='as for simgap diagnose')


def add_proposal_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('verdict', nargs='?', type=Path, metavar='VERDICT',
                        help='JSON of a diagnosis; not needed with --objective detect')
    parser.add_argument('--objective', choices=('separate', 'detect'),
                        help='tell the answers apart, or find effects at all (default: separate, '
                             'or detect if no answers are open)')
    parser.add_argument('--suspect', nargs='+', default=[], metavar='EFFECT',
                        help='effects that --objective detect looks for (default: all)')
    parser.add_argument('--duration', type=float, default=30.0, metavar='S',
                        help='length of the test (default: 30)')
    parser.add_argument('--rate', type=float, default=200.0, metavar='HZ',
                        help='sample rate of the recording (default: 200)')
    parser.add_argument('--out', type=Path, metavar='FILE', help='write the test sheet to FILE')
    parser.add_argument('--report', type=Path, metavar='FILE', help='write a page to FILE')
    add_json_option(parser)
    parser.add_argument('--jobs', type=int, default=2, metavar='N',
                        help='tests that are simulated at once (default: 2)')
    parser.add_argument('--seed', type=int, default=0, metavar='N',
                        help='of the tests that are drawn (default: 0)')


def run(arguments: argparse.Namespace) -> int:
    """Search, and write what was asked for; 1 if no test within the limits helps."""
    return proposed(arguments, lambda planning: tests_of(arguments.model, arguments.duration))


def tests_of(model: str, duration: float) -> TestSpace:
    from simgap.model import load_model, OwnTests
    return OwnTests(load_model(model), duration)


def proposed(arguments: argparse.Namespace, tests: Callable[[dict[str, Any]], TestSpace]) -> int:
    """
    Design the next test, and write what was asked for; 1 if no test within the limits helps.

    `tests` returns the tests that are allowed, from the entry `planning` of the verdict.
    """
    check_options(arguments, jobs=Entry('', 1, whole=True), duration=Entry('s', 5.0, 600.0),
                  rate=Entry('Hz', 20.0, 10000.0), seed=Entry('', 0, whole=True))
    if arguments.verdict is None and arguments.objective != 'detect':
        raise UserError('which verdict? The JSON of a diagnosis is needed; without one there is '
                        '--objective detect')
    planning = planning_of(arguments.verdict) if arguments.verdict else {}
    from simgap.next_test.design import objective_for, TestDesign
    from simgap.next_test.proposal import as_data, contents, lines
    from simgap.next_test.rivals import Findings
    findings = findings_of(arguments.verdict, planning) if planning else Findings()
    objective = arguments.objective or objective_for(findings)
    space = tests(planning)
    began = time.monotonic()
    with Progress('proposal', 1.0) as progress:
        try:
            found = TestDesign(space, findings, objective, arguments.suspect, arguments.jobs,
                               seed=arguments.seed).run(progress.update)
        except KeyError as error:
            raise UserError(f'{arguments.verdict}: {error.args[0]}: this configuration knows no '
                            'such effect; give the model of the diagnosis') from error
    data = {**as_data(found, space), 'duration_s': arguments.duration,
            'sample_rate_hz': arguments.rate, 'seconds': time.monotonic() - began}
    if arguments.out and found.tests:
        _write(arguments.out, found, space, data)
    if arguments.report:
        from simgap.report.render import render
        with replaced(arguments.report) as stream:
            shown = {**contents(found, space), 'data': data}
            stream.write(render('proposal.html', **shown).encode())
    told = lines(in_percent(data))
    if objective == 'detect' and not arguments.objective:
        told.insert(0, 'no answers to tell apart: this test looks for other effects; what to do '
                       "about what was found stands in the verdict's sentence, after 'Next'")
    give(data, arguments.json, '\n'.join(told))
    return 0 if found.tests else 1


def in_percent(data: dict[str, Any]) -> dict[str, Any]:
    """Return a proposal for people: the sizes of unit 1 in percent."""
    return {**data, **({'smallest_sizes': {
        name: item if item['unit'] != '1' or item['size'] is None else
        {'size': 100.0 * item['size'], 'unit': '%'}
        for name, item in data['smallest_sizes'].items()}} if 'smallest_sizes' in data else {})}


def _write(path: Path, found: Proposal, space: TestSpace, data: dict[str, Any]) -> None:
    from simgap.next_test.proposal import lines
    heading = [f'{data["duration_s"]:g} s, at least {data["sample_rate_hz"]:g} samples per second',
               *(line.strip() for line in lines(in_percent(data)))]
    if data.get('channels'):
        shares = sorted(data['channels'].items(), key=lambda item: -item[1])
        heading.append('what tells: ' + ', '.join(
            f'{name} {100.0 * share:.0f} %' for name, share in shares if share > 0.005))
    for place, text in space.files(found.tests[0].test, path).items():
        with replaced(place) as stream:
            if place.suffix == '.yaml':
                stream.write(''.join(f'# {line}\n' for line in heading).encode())
            stream.write(text.encode())
