# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The recording that a command reads: the options that name it, and what is refused."""

import argparse
from collections.abc import Iterable
import math

from antenna_drive.recording.files import import_file, load_map, read_recording
from antenna_drive.recording.recording import Recording
from simgap.cli.diagnose import add_map_option
from simgap.command.output import reading
from simgap.errors import UserError
from simgap.logs.channel import Channel


def add_recording_options(parser: argparse.ArgumentParser) -> None:
    """Add the recording to read, `--partial`, and `--from` and `--to` to read a part."""
    parser.add_argument('recording', metavar='RECORDING',
                        help='a bag (folder or .mcap) or a .csv; with --map any file that '
                             'docs/recording.md lists')
    add_map_option(parser)
    parser.add_argument('--partial', action='store_true',
                        help='take what can be read of a bag that was cut off, and say how far')
    parser.add_argument('--from', dest='start', type=float, default=-math.inf, metavar='S',
                        help='leave out what was before this time [s]')
    parser.add_argument('--to', dest='end', type=float, default=math.inf, metavar='S',
                        help='leave out this time [s] and what came after')


def refuse_none(name: object, channels: Iterable[Channel]) -> None:
    """Raise UserError if there is no sample to go on with."""
    if not any(map(len, channels)):
        raise UserError(f'{name}: no sample to draw or to write; take a recording with at least '
                        'one row, and --from and --to, if they are given, within it')


def read(args: argparse.Namespace) -> Recording:
    """Read the recording that the options name; UserError says what is wrong with it."""
    with reading():
        recording = import_file(args.recording, load_map(args.map)) if args.map else (
            read_recording(args.recording, partial=args.partial))
    if args.start > -math.inf or args.end < math.inf:
        recording = recording.between(args.start, args.end)
    refuse_none(args.recording, recording.channels.values())
    return recording
