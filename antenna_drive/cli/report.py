# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Write one page about a recording: curves to zoom into, figures, and the configuration used.

The page is a single file that needs no network and no program but a browser. --json gives the
figures alone.

  antenna-drive report run/ -o run.html
  antenna-drive report run/ -o second_period.html --from 5 --to 10
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from antenna_drive.cli.output import add_json_option, replaced, write_json
from antenna_drive.cli.reading import add_recording_options, read
from antenna_drive.recording.figures import statistics
from antenna_drive.recording.report import page


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command understands."""
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
