# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Diagnose cases of a trial again, each without its true effect in the catalogue.

A machine's fault may be on no list. So cases whose single effect was named first are diagnosed
again without that effect, the same effect in other places, and what becomes it at an end of its
range. The probability of 'unknown' must rise. `lab trial --diagnose` makes the cases;
those that are not diagnosed yet, or were not right, are not used. The second verdict is
DIR/case_0001/without.json. The same command resumes an interrupted trial.

The exit code is 1 if no case could be diagnosed.

For example:
  lab trial-without wild7 --cases 20
  lab trial-without wild7 --scored wild7.jsonl
"""

import argparse
from pathlib import Path
import shlex

from lab.cli.trial import add_batch_options
from lab.trials.left_out import RISE, run_trial
from lab.trials.scorecard import OVERCONFIDENT
from simgap.command.output import check_options, give, Progress
from simgap.inputs.schema import Entry


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('trial', type=Path, metavar='DIR', help='folder of a diagnosed trial')
    parser.add_argument('--cases', type=int, default=20, metavar='N',
                        help='how many cases, in their order (default: %(default)s)')
    parser.add_argument('--scored', type=Path, metavar='FILE',
                        help='take the first answers from this file of `lab score '
                             '--cases`, of a trial that was drawn again in DIR')
    add_batch_options(parser, 'diagnoses')


def run(arguments: argparse.Namespace) -> int:
    """Diagnose the cases again, and print what became of 'unknown'."""
    check_options(arguments, cases=Entry('', 1, whole=True), jobs=Entry('', 1, whole=True))
    with Progress('without', arguments.cases, quiet=arguments.quiet) as progress:
        found = run_trial(arguments.trial, arguments.cases, arguments.jobs, arguments.time_limit,
                          shlex.split(arguments.diagnose_options),
                          lambda done, total: progress.update(done), arguments.scored)
    lines = [f'{"case":10s} {"left out":34s} {"unknown before, after":>22s}  named now']
    lines += [f'{row["case"]:10s} {row["effect"]:34s} {row["unknown_before"]:13.2f} '
              f'{row["unknown_after"]:8.2f}  {" + ".join(row["named"])}, {row["probability"]:.2f}'
              for row in found['cases']]
    if found['cases']:
        lines.append(f"probability of 'unknown' rises by {found['median_rise']:.2f} (median), "
                     f'{found["mean_rise"]:.2f} (mean)')
        for key, words in (('recognised', f'by {RISE:g} or more in'),
                           ('named_wrongly',
                            f'something else is named above {OVERCONFIDENT:g} in')):
            low, high = found[f'{key}_ci95']
            lines.append(f'{words} {found[key]:.2f} ({low:.2f} to {high:.2f}) '
                         f'of {len(found["cases"])} cases')
    if found['failures']:
        lines.append(f'{found["failures"]} diagnoses failed')
    give(found, arguments.json, '\n'.join(lines))
    return 0 if found['cases'] else 1
