# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Look for faults of the drive: kills, garbage, damaged files, full disks, long runs, other networks.

  lab campaign --out campaign --short     about ten minutes
  lab campaign --out campaign --dose medium   about half an hour
  lab campaign --out campaign             some hours: 200 kills, a million frames of
                                                    garbage, 100 000 damaged files of each kind,
                                                    an hour at real time

  DIR/outcomes.jsonl  one line for each trial, as it ends
  DIR/campaign.html   counts, findings, and the command that repeats each
  --json FILE         the same as JSON

Each trial is a process of its own and is drawn from the seed. The same command resumes a campaign
that was interrupted. Trials that cannot be done on this machine are skipped, with the reason. The
exit code is 0 if nothing was found and 1 if something was.
"""

import argparse
import json
import os
from pathlib import Path
import sys
from typing import Any

from lab.campaign.page import page
from lab.campaign.summary import bad, summary
from lab.campaign.supervisor import Campaign
from lab.campaign.trials import DOSES, FULL, PARTS, plan, SHORT, Trial
from simgap.command.output import add_json_option, check_options, give, replaced
from simgap.errors import UserError
from simgap.inputs.schema import Entry


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command understands."""
    parts = '; '.join(f'{part}: {what}' for part, what in PARTS.items())
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder of the campaign; one that is there is resumed')
    parser.add_argument('--short', action='store_true', help='the same as --dose short')
    parser.add_argument('--dose', choices=DOSES, default=FULL,
                        help='how much of everything (default: %(default)s)')
    parser.add_argument('--only', action='append', default=[], metavar='PART', choices=PARTS,
                        help=f'one part; may be repeated. {parts}')
    parser.add_argument('--soak', type=float, metavar='S',
                        help='duration of the run at real time [s]; that of the dose if not given')
    parser.add_argument('--seed', type=int, default=1, metavar='N',
                        help='what everything is drawn from (default: %(default)s)')
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1, metavar='N',
                        help='how many trials of damaged files run at once; all others have the '
                        'machine to themselves (default: %(default)s here)')
    parser.add_argument('--repeat', metavar='TRIAL',
                        help='do one trial again, print its outcome and keep nothing')
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Do what is not done yet, and write the result."""
    check_options(args, soak=Entry('s', 10.0, 1e6), jobs=Entry('1', 1, 1024, whole=True))
    dose = SHORT if args.short else args.dose
    trials = list(plan(dose, args.soak))
    campaign = Campaign(args.out, {'dose': dose, 'seed': args.seed, 'soak_s': args.soak})
    if args.repeat:
        return _repeat(campaign, trials, args)
    chosen = [trial for trial in trials if not args.only or trial.part in args.only]
    ahead = sum(trial.label not in campaign.outcomes for trial in chosen)
    print(f'{ahead} of {len(chosen)} trials to do', file=sys.stderr)
    number = 0

    def told(trial: Trial, entry: dict[str, Any]) -> None:
        nonlocal number
        number += 1
        what = entry['skipped'] or '; '.join(
            finding['what'][:200] for finding in entry['findings']) or 'nothing found'
        print(f'{number}/{ahead}  {trial.label}  {entry["wall_s"]:.0f} s: {what}', file=sys.stderr,
              flush=True)

    try:
        campaign.do(chosen, told, args.jobs)
    finally:
        result = summary(chosen, campaign.outcomes, campaign.settings, str(args.out))
        with replaced(args.out / 'campaign.html') as stream:
            stream.write(page(result).encode(errors='replace'))
    give(result, args.json, _text(result, args.out))
    return 1 if bad(result) or result['findings'] else 0


def _text(result: dict[str, Any], folder: Path) -> str:
    found = ', '.join(f'{name} {count}' for name, count in bad(result).items()) or 'no fault'
    return (f'{result["trials_done"]} of {result["trials"]} trials, {result["kills"]} kills, '
            f'{result["garbage_frames"]} frames of garbage, {result["mutated_files"]} damaged '
            f'files: {found}; {folder / "campaign.html"}')


def _repeat(campaign: Campaign, trials: list[Trial], args: argparse.Namespace) -> int:
    trial = next((trial for trial in trials if trial.label == args.repeat), None)
    if trial is None:
        raise UserError(f'--repeat {args.repeat}: no such trial in {args.out}; it is one of '
                        f'{trials[0].label} to {trials[-1].label}')
    entry = campaign.one(trial)
    give(entry, args.json, json.dumps(entry, indent=1))
    return 1 if entry['findings'] else 0
