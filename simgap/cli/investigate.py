# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Test a machine until it is clear what is wrong with it: test, verdict, better test.

The model declares the tests that are allowed. A command of yours plays each of them:

  simgap investigate my_machine.py --out found --by './play.sh {test} {out}'

{test} is a CSV of the commands, and {out} the CSV of the log to write; {duration} is the length
[s], and {number} counts the tests. After each test all logs are diagnosed, and the test that
separates the answers is designed. This ends when the verdict is --until sure of an answer that the
verdict before also named: one test alone decides nothing. One page has the whole story.

--out holds a file for each step. The same command goes on where an interrupted one was. The exit
code is 1 if nothing was decided.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import shlex
import subprocess
from typing import Any, TYPE_CHECKING

from simgap.command.output import add_json_option, check_options, give, Progress, replaced
from simgap.command.programs import PARENT
from simgap.errors import UserError
from simgap.inputs.schema import Entry

if TYPE_CHECKING:
    from simgap.model.bench import Play
    from simgap.next_test.investigation import Bench, InvestigationPlan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('model', metavar='MODEL', help='as for simgap diagnose')
    parser.add_argument('--by', metavar='COMMAND', required=True,
                        help='plays a test: with {test}, {out}, {duration} and {number}')
    add_investigation_options(parser)


def add_investigation_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder of the investigation')
    parser.add_argument('--max-tests', type=int, default=4, metavar='N',
                        help='greatest number of tests (default: 4)')
    parser.add_argument('--until', type=float, default=0.9, metavar='P',
                        help='probability from which an answer is sure (default: 0.9)')
    parser.add_argument('--duration', type=float, default=30.0, metavar='S',
                        help='length of each test (default: 30)')
    parser.add_argument('--jobs', type=int, default=2, metavar='N',
                        help='simulations at once (default: 2)')
    parser.add_argument('--seed', type=int, default=0, metavar='N',
                        help='of the tests that are drawn (default: 0)')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    add_json_option(parser)


def plan_of(arguments: argparse.Namespace) -> InvestigationPlan:
    """Return what the options ask for; UserError if one is out of its range."""
    check_options(arguments, jobs=Entry('', 1, whole=True), max_tests=Entry('', 1, 50, whole=True),
                  until=Entry('', 0.5, 1.0), duration=Entry('s', 5.0, 600.0),
                  seed=Entry('', 0, whole=True))
    from simgap.next_test.investigation import InvestigationPlan
    return InvestigationPlan(arguments.max_tests, arguments.until, arguments.duration,
                             arguments.seed)


def run(arguments: argparse.Namespace) -> int:
    """Investigate, and tell the story; 1 if nothing was decided."""
    plan, play = plan_of(arguments), played_by(shlex.split(arguments.by), '{test}')
    from simgap.model import load_model, ModelBench
    bench = ModelBench(load_model(arguments.model), plan.duration, play, arguments.jobs)
    return investigated(arguments, bench, plan)


def investigated(arguments: argparse.Namespace, bench: Bench, plan: InvestigationPlan,
                 first: Any = None) -> int:
    """Investigate a machine from a first test, and tell the story; 1 if nothing was decided."""
    from simgap.next_test.investigation import DECIDED, headline, Investigation, lines
    from simgap.report.render import render
    done: list[str] = []
    with Progress('investigation', 3 * plan.most, quiet=arguments.quiet) as progress:
        def show(doing: str, share: float) -> None:
            if doing not in done:
                done.append(doing)
            progress.update(len(done) - 1 + share)

        story = Investigation(arguments.out, bench, plan, first, arguments.jobs).run(show)
    title, lead = headline(story)
    page = arguments.out / 'story.html'
    with replaced(page) as stream:
        stream.write(render('story.html', title=title, lead=lead, story=story,
                            until=plan.until).encode())
    give(story, arguments.json, '\n'.join([*lines(story), str(page)]))
    return 0 if story['ended'] == DECIDED else 1


def played_by(words: Sequence[str], test: str) -> Play:
    """Return what plays a test by a command in which `test` stands for it; or UserError."""
    for place in (test, '{out}'):
        if not any(place in word for word in words):
            raise UserError(f'--by: {place} is missing in {" ".join(words)}')

    def play(number: int, sheet: Path, duration: float, out: Path) -> None:
        filled = [word.replace(test, str(sheet)).replace('{out}', str(out)).replace(
            '{duration}', f'{duration:g}').replace('{number}', str(number)) for word in words]
        try:
            found = subprocess.run(filled, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True, check=False,
                                   env={**os.environ, PARENT: str(os.getpid())})
        except OSError as error:
            raise UserError(f'{filled[0]}: {error.strerror}') from error
        if found.returncode or not out.exists():
            last = (found.stderr.strip().splitlines() or ['nothing said'])[-1]
            raise UserError(f'{filled[0]}: exit code {found.returncode}, '
                            + ('' if out.exists() else 'no recording; ') + last)

    return play
