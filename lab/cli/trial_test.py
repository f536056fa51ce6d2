# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make one test more on the antenna of a sealed case.

DIR holds a trial that `lab trial` has made. The independent antenna of CASE plays the
waveform of a test sheet, with the tolerances, imperfections and sensors of the case, and the
recording is written as CSV. What the sheet does not say is as in the other tests of the case.

So you can try the whole loop by hand, or let it run by itself:

  lab trial-test wild7 case_0001 --sheet next.yaml --out next.csv
  antenna-drive investigate --out found --by 'lab trial-test wild7 case_0001
      --sheet {sheet} --out {out} --duration {duration} --number {number}'

The same test gives the same recording; with another --number it has another noise.
"""

import argparse
from pathlib import Path

from lab.antenna.sheet import SHAPES
from lab.trials import sealing
from lab.trials.further_tests import DURATION_S, known, record_test, with_test
from simgap.command.output import check_options
from simgap.errors import UserError
from simgap.inputs.schema import Entry

# Places before these belong to the tests of `lab trial-next`.
_FIRST_PLACE = 10


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `lab trial-test`."""
    parser.add_argument('trial', type=Path, metavar='DIR', help='folder of the trial')
    parser.add_argument('case', metavar='CASE', help='of an antenna, e.g. case_0001')
    parser.add_argument('--sheet', type=Path, required=True, metavar='FILE',
                        help='test sheet with a waveform (.yaml)')
    parser.add_argument('--out', type=Path, required=True, metavar='FILE', help='recording (CSV)')
    parser.add_argument('--duration', type=float, default=DURATION_S, metavar='S',
                        help='of the test (default: %(default)g)')
    parser.add_argument('--number', type=int, default=1, metavar='N',
                        help='of the test, which draws its noise (default: %(default)s)')


def run(arguments: argparse.Namespace) -> int:
    """Make the test and write its recording."""
    check_options(arguments, duration=Entry('s', 1.0, 600.0),
                  number=Entry('', 1, 1000, whole=True))
    from antenna_drive.recording.sheet import load_sheet, sheet_tree
    manifest = sealing.read_manifest(arguments.trial)
    if arguments.case not in manifest['seals']:
        raise UserError(f'{arguments.trial}: has no {arguments.case}; the cases are case_0001 to '
                        f'{list(manifest["seals"])[-1]}')
    truth = sealing.open_truth(arguments.trial, arguments.case, manifest)
    if 'machine' in truth:
        raise UserError(f'{arguments.case}: is a {truth["machine"]}, which cannot play a test '
                        'sheet; give a case of an antenna')
    sheet = sheet_tree(load_sheet(arguments.sheet))
    kind = sheet.get('waveform', {}).get('type')
    if kind not in SHAPES:
        raise UserError(f'{arguments.sheet}: waveform: {kind or "nothing"} given, the antenna of '
                        f'a case plays {", ".join(SHAPES)}')
    whole, number = with_test(truth, {**known(truth), **sheet},
                              _FIRST_PLACE + arguments.number, arguments.duration)
    draft = arguments.out.with_name(f'.{arguments.out.name}.draft')
    try:
        record_test(whole, number, draft)
        draft.replace(arguments.out)
    finally:
        draft.unlink(missing_ok=True)
    return 0
