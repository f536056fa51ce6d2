# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Write one page about a recording: curves to zoom into, figures, and the configuration used.

The page is a single file that needs no network and no program but a browser. --json gives the
figures alone.

  antenna-drive report run/ -o run.html
  antenna-drive report run/ -o second_period.html --from 5 --to 10
"""

import argparse
from dataclasses import asdict
from pathlib import Path

from antenna_drive.cli.reading import add_recording_options, read
from antenna_drive.recording.figures import statistics
from antenna_drive.recording.report import page
from simgap.command.output import add_json_option, replaced, write_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_recording_options(parser)
    parser.add_argument('-o', '--out', type=Path, metavar='FILE',
                        help='the page; RECORDING.html here if not given')
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Write the page, and the figures as JSON if asked for."""
    recording = read(args)
    if args.json:
        write_json(asdict(statistics(recording)), args.json)
    if args.out or not args.json:
        source = Path(args.recording).resolve()
        out = args.out or Path(f'{source.stem}.html')
        with replaced(out) as stream:
            stream.write(page(recording, source.name).encode())
        if args.json != '-':
            print(out)
    return 0
