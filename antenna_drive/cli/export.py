# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Turn a recording into CSV, exact to the last bit of every number.

One column for each signal, named 'unit/signal [unit]'; with --field the columns of a field test
instead, which docs/recording.md lists. A cell is empty where a signal has no sample. Beside
OUT.csv come OUT.yaml, the test sheet, and OUT.meta.json, the configuration in force and the live
changes; `antenna-drive import` reads all three back.

  antenna-drive export run/ run.csv
  antenna-drive export run/ field.csv --field --from 5 --to 25
  antenna-drive export run/ currents.csv --signals 'motor_*/current' --real-amperes

Currents are in article amperes, one of which is several real ones; --real-amperes adds a column
such as 'motor_1/real_current [real A]' for each.
"""

import argparse
from pathlib import Path

from antenna_drive.cli.reading import add_recording_options, read, refuse_none
from antenna_drive.recording.csv_format import write_csv
from antenna_drive.recording.panels import chosen, with_real_amperes
from simgap.errors import UserError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_recording_options(parser)
    parser.add_argument('out', type=Path, metavar='OUT.csv', help='the file to write; it must '
                                                                  'not be there yet')
    parser.add_argument('--field', action='store_true',
                        help="write the field test's columns, and no other signal")
    parser.add_argument('--signals', nargs='+', metavar='NAME',
                        help="the signals to write, such as plant/encoder or 'motor_*/current'")
    parser.add_argument('--real-amperes', action='store_true',
                        help='write each current in real amperes as well, as a clamp meter shows '
                             'it')


def run(args: argparse.Namespace) -> int:
    if args.real_amperes and args.field:
        raise UserError('--real-amperes: does not go with --field, whose columns are fixed')
    recording = read(args)
    names = chosen(recording, args.signals) if args.signals else None
    if names:
        refuse_none(', '.join(names), (recording[name] for name in names))
    if args.real_amperes:
        recording, names = with_real_amperes(recording, names or recording.names), None
    for path in write_csv(recording, args.out, field=args.field, names=names):
        print(path)
    return 0
