# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Turn a file from the field into a bag that every ROS 2 tool, plotter and command here opens.

A file with the columns of a field test, which docs/recording.md lists, or of `antenna-drive
export` needs no map. Any other is described by a map, in YAML:

  time: {column: "Time (ms)", unit: ms}          # s, ms, us, ns, iso8601
  delimiter: ";"
  signals:
    test_signal/rate_command: {column: CMD, unit: deg/s, sign: -1}
    motor_1/current: {column: I1, unit: A, scale: 0.1667, offset: 0.02, clock_offset_s: 0.004}
    plant/encoder: {column: ENC, unit: counts, counts_per_revolution: 2097152}

docs/recording.md lists every entry. A test sheet NAME.yaml beside NAME.csv goes into the bag.
Whatever cannot be read is refused with its line and column, and then nothing is written.

  antenna-drive import field.csv field_bag
  antenna-drive import log.csv field_bag --map log_map.yaml
"""

import argparse
from pathlib import Path

from antenna_drive.cli.reading import refuse_none
from antenna_drive.recording.bag_writer import write_bag
from antenna_drive.recording.csv_format import read_csv
from antenna_drive.recording.files import import_file, load_map
from simgap.cli.diagnose import add_map_option
from simgap.command.output import reading
from simgap.errors import UserError
from simgap.logs.bags import REMEDY
from simgap.logs.tables import kind_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('csv', type=Path, metavar='FILE',
                        help='the file to read: a CSV, or with --map any that docs/recording.md '
                             'lists, such as .mat, .parquet or a bag of another machine')
    parser.add_argument('bag', type=Path, metavar='BAG', help='the folder to write; it must not '
                                                              'be there yet')
    add_map_option(parser)


def run(args: argparse.Namespace) -> int:
    if not args.map and args.csv.exists() and kind_of(args.csv):
        raise UserError(f'{args.csv}: no CSV, which needs a map. {REMEDY}')
    with reading():
        recording = (import_file(args.csv, load_map(args.map)) if args.map
                     else read_csv(args.csv))
    refuse_none(args.csv, recording.channels.values())
    write_bag(recording, args.bag)
    for name, channel in recording.channels.items():
        print(f'{name} [{channel.unit}]: {len(channel)} samples')
    return 0
