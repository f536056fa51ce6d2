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

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import shlex
import subprocess
import sys
from typing import TYPE_CHECKING

from antenna_drive.cli.settings import add_settings_option, parse_settings
from simgap.command.output import add_json_option, check_options, give, Progress, replaced
from simgap.command.programs import PARENT
from simgap.errors import UserError
from simgap.inputs.schema import Entry

if TYPE_CHECKING:
    from antenna_drive.diagnosis.investigation import RunTest
    from antenna_drive.recording.sheet import TestSheet

PAGE = 'story.html'
_UNTIL = 0.9


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder of the investigation')
    parser.add_argument('--max-tests', type=int, default=4, metavar='N',
                        help='greatest number of tests (default: 4)')
    parser.add_argument('--until', type=float, default=_UNTIL, metavar='P',
                        help=f'probability from which an answer is sure (default: {_UNTIL:g})')
    parser.add_argument('--duration', type=float, default=30.0, metavar='S',
                        help='length of each test (default: 30)')
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
    parser.add_argument('--jobs', type=int, default=2, metavar='N',
                        help='simulations at once (default: 2)')
    parser.add_argument('--seed', type=int, default=0, metavar='N',
                        help='of the tests that are drawn (default: 0)')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Investigate, and tell the story; 1 if nothing was decided."""
    check_options(arguments, jobs=Entry('', 1, whole=True), max_tests=Entry('', 1, 50, whole=True),
                  until=Entry('', 0.5, 1.0), duration=Entry('s', 5.0, 600.0),
                  seed=Entry('', 0, whole=True))
    run_test = _run_test(arguments)
    from antenna_drive.diagnosis.drive_limits import DriveLimits, read_limits
    from antenna_drive.diagnosis.investigation import (
        DECIDED, headline, Investigation, InvestigationPlan, lines,
    )
    from antenna_drive.diagnosis.planned_tests import BUILT_IN
    from antenna_drive.diagnosis.sensors import SensorModel
    from antenna_drive.parameters.loading import load
    from antenna_drive.recording.sheet import load_sheet
    from simgap.report.render import render
    drive = load(*arguments.config)
    limits = (read_limits(arguments.limits, drive) if arguments.limits
              else DriveLimits.of_drive(drive))
    base = load_sheet(arguments.sheet) if arguments.sheet else BUILT_IN['square']
    first = load_sheet(arguments.first) if arguments.first else None
    if first is not None and first.waveform is None:
        raise UserError(f'{arguments.first}: waveform: is missing, there is nothing to play')
    steps = 3 * arguments.max_tests
    done: list[str] = []
    with Progress('investigation', steps, quiet=arguments.quiet) as progress:
        def show(doing: str, share: float) -> None:
            if doing not in done:
                done.append(doing)
            progress.update(len(done) - 1 + share)

        story = Investigation(
            arguments.out, drive, limits, base, run_test,
            InvestigationPlan(arguments.max_tests, arguments.until, arguments.duration,
                              arguments.seed), first,
            # the nodes give true values, another drive what its sensors read
            None if arguments.by else SensorModel.of(base.sensors), arguments.jobs).run(show)
    title, lead = headline(story)
    with replaced(arguments.out / PAGE) as stream:
        stream.write(render('story.html', title=title, lead=lead, story=story,
                            until=arguments.until).encode())
    give(story, arguments.json, '\n'.join([*lines(story), str(arguments.out / PAGE)]))
    return 0 if story['ended'] == DECIDED else 1


def _run_test(arguments: argparse.Namespace) -> RunTest:
    """Return what runs a test: a command, or a drive of five nodes."""
    if arguments.by:
        if arguments.settings or arguments.real:
            raise UserError('--by: another drive has its own parameters; --real and --set are '
                            'those of the five nodes')
        return _TestsByCommand(shlex.split(arguments.by))
    # a fault of the middleware must not end an investigation
    parse_settings(arguments.settings)
    words = [sys.executable, '-m', 'antenna_drive', 'record', '--quiet', '--play', '{sheet}',
             '--out', '{out}', '--duration', '{duration}']
    for option, given in (('--config', arguments.real), ('--set', arguments.settings)):
        words += [option, *given] if given else []
    return _TestsByCommand(words)


class _TestsByCommand:
    """Runs tests by a command."""

    def __init__(self, words: Sequence[str]) -> None:
        """
        Take the command.

        Raises
        ------
        UserError : it has no {sheet} or no {out}

        """
        for place in ('{sheet}', '{out}'):
            if not any(place in word for word in words):
                raise UserError(f'--by: {place} is missing in {" ".join(words)}')
        self._words = words

    def __call__(self, number: int, sheet: TestSheet, duration: float, out: Path) -> None:
        """Run a test, see `RunTest`."""
        from antenna_drive.recording.sheet import dump_sheet
        path = out.with_name(f'{out.name}.yaml')
        path.write_text(dump_sheet(sheet), encoding='utf-8')
        words = [word.replace('{sheet}', str(path)).replace('{out}', str(out)).replace(
            '{duration}', f'{duration:g}').replace('{number}', str(number))
            for word in self._words]
        try:
            found = subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True, check=False,
                                   env={**os.environ, PARENT: str(os.getpid())})
        except OSError as error:
            raise UserError(f'{words[0]}: {error.strerror}') from error
        finally:
            path.unlink(missing_ok=True)
        if found.returncode or not out.exists():
            last = (found.stderr.strip().splitlines() or ['nothing said'])[-1]
            raise UserError(f'{words[0]}: exit code {found.returncode}, '
                            + ('' if out.exists() else 'no recording; ') + last)
