# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Draw the signals of a recording over time: a PNG, PDF or SVG.

Signals that belong together share a panel. Angles are in degrees, currents in article amperes
with real ones on the right where the configuration tells how many they are.

  antenna-drive plot run/ --out run.png
  antenna-drive plot run/ --signals 'motor_*/current' torque_share/bias_voltage --to 12.6
"""

import argparse
from pathlib import Path

from antenna_drive.cli.reading import add_recording_options, read
from antenna_drive.recording.picture import draw, picture_format
from simgap.command.output import replaced


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_recording_options(parser)
    parser.add_argument('--signals', nargs='+', metavar='NAME',
                        help="the signals to draw, such as plant/encoder or 'motor_*/current'; "
                             'all if not given')
    parser.add_argument('--out', type=Path, metavar='FILE',
                        help='the picture, .png, .pdf or .svg; RECORDING.png here if not given')


def run(args: argparse.Namespace) -> int:
    out = args.out or Path(f'{Path(args.recording).resolve().stem}.png')
    form = picture_format(out)
    recording = read(args)
    with replaced(out) as stream:
        draw(recording, stream, form, patterns=args.signals,
             title=Path(args.recording).resolve().name)
    print(out)
    return 0
