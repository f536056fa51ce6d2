# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Say what is in a recording, as a first map of it.

A recording is a bag (rosbag2 as a folder or a file, MCAP with JSON or Protobuf) or a table (CSV,
.npy, .npz, .mat, JSON, Parquet). The map has every column of numbers. Its comments tell topics,
rates, ranges, gaps, and what looks wrong: readings that are stuck, or at a limit, and jumps that a
sign bit or a wrap-around makes, with the entry that mends them. Delete what you do not need.

  simgap inspect field_bag > field_map.yaml
  simgap inspect logs/one.csv
  simgap inspect field_bag --json found.json
"""

import argparse
from pathlib import Path

from simgap.command.output import add_json_option, give, reading


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('recording', type=Path, metavar='RECORDING', help='a bag or a table')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    from simgap.logs.inspection import first_map, inspected
    with reading():
        found = inspected(arguments.recording)
    give(found, arguments.json, '\n'.join(first_map(found)))
    return 0
