# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make a configuration of your own drive from its data sheets and test report.

Without a sheet it asks, one figure after the other, and keeps the answers beside the
configuration. With a filled sheet it asks nothing:

  antenna-drive configure --template > empty_sheet.yaml          a sheet to fill
  antenna-drive configure data_sheet.yaml --out my_drive.yaml    from a filled sheet
  antenna-drive run --config my_drive.yaml --duration 5 --out run.csv

Currents of the sheet are real amperes, as a clamp meter shows them. The configuration is in
article amperes, which it names: its first lines say how many real ones each is. Every number in
it has its source: from the sheet, derived, assumed, or kept from the reference drive.

Then the configured drive is run, and what it gives is printed beside the sheet: the currents at
two rates, and the bias at standstill. The exit code is 1 if one is off by more than 5 percent.
docs/your-drive.md goes through an example.
"""

import argparse
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from simgap.command.output import replaced
from simgap.command.programs import NEGATIVE, OK
from simgap.errors import UserError

if TYPE_CHECKING:
    from antenna_drive.configuring.sheet import Sheet


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('sheet', type=Path, nargs='?', metavar='SHEET',
                        help='filled sheet (.yaml); without it the command asks')
    parser.add_argument('--out', type=Path, default=Path('my_drive.yaml'), metavar='FILE',
                        help='the configuration (default: %(default)s)')
    parser.add_argument('--template', action='store_true', help='print a sheet to fill, and end')
    parser.add_argument('--no-run', action='store_true',
                        help='do not run the drive to compare it with the sheet')


def run(args: argparse.Namespace) -> int:
    """Write the configuration; return 0, or 1 if the drive does not give the sheet back."""
    from antenna_drive.configuring.sheet import ask, read_sheet, written

    if args.template:
        print(written({}), end='')
        return OK
    if args.sheet is not None and args.sheet.absolute() == args.out.absolute():
        raise UserError(f'--out {args.out}: is the sheet itself, choose another name')
    sheet = read_sheet(args.sheet) if args.sheet else ask(input, print)
    from antenna_drive.configuring.written import configuration
    text = configuration(sheet)
    _write(args.out, text)
    if args.sheet is None:
        kept = args.out.with_suffix('.sheet.yaml')
        _write(kept, written(sheet.figures, sheet.circuit))
        print(f'{kept}: your answers')
    counts = {source: text.count(f'source: "{source}') for source in (
        'sheet', 'derived', 'assumed', 'kept')}
    print(f'{args.out}: ' + ', '.join(f'{count} {source}' for source, count in counts.items()))
    return OK if args.no_run else _compare(args.out, sheet)


def _compare(path: Path, sheet: 'Sheet') -> int:
    from antenna_drive.configuring.proof import checks
    from antenna_drive.parameters import load

    found = checks(sheet, load(path))
    print(_LINE.format('', 'what the configured drive gives', 'sheet', 'obtained', '').rstrip())
    for check in found:
        wanted = '' if check.wanted is None else f'{check.wanted:.4g}'
        print(_LINE.format('' if check.holds else 'DIFFERS', check.what, wanted,
                           f'{check.obtained:.4g}', check.unit).rstrip())
    if all(check.holds for check in found):
        return OK
    print('what differs: the rate is too slow to be steady, the voltage too low, or a loop too '
          'slow or unstable', file=sys.stderr)
    return NEGATIVE


def _write(path: Path, text: str) -> None:
    with replaced(path) as stream:
        stream.write(text.encode())


_LINE = '{:<8}{:<46}{:>10}{:>10}  {}'
