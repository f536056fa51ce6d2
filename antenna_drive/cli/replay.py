# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Drive the emulator with a recorded command, and write its recording beside the real one.

The twin takes its parameters from --config if given, else from the recording itself (with its
live changes), else from the reference set as the recording's test sheet changes it. Prints, for
each signal of both, the root mean square of their difference and its share of the real signal's
own.

  antenna-drive replay field_bag                       writes field_bag_twin
  antenna-drive replay field.csv --config new_circuit my_antenna.yaml --out twin
"""

import argparse
from pathlib import Path

from antenna_drive.cli.options import add_config_option
from antenna_drive.cli.reading import add_recording_options, read
from antenna_drive.recording.atomic import refuse_existing
from antenna_drive.recording.bag_writer import write_bag
from antenna_drive.recording.replay import distances, twin
from simgap.command.output import add_json_option, check_options, give
from simgap.inputs.schema import Entry


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_recording_options(parser)
    add_config_option(parser)
    parser.add_argument('--out', type=Path, metavar='BAG',
                        help='the folder to write, not there yet; RECORDING_twin if not given')
    parser.add_argument('--step', type=float, metavar='S',
                        help="macro-step [s]; the recording's own if it tells, else 0.001")
    parser.add_argument('--every', type=int, default=1, metavar='N',
                        help='write every N-th macro-step only')
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    check_options(args, step=Entry('s', 1e-5, 0.1), every=Entry('', 1, whole=True))
    source = Path(args.recording).resolve()
    out = args.out or source.with_name(f'{source.stem}_twin')
    refuse_existing(out)
    real = read(args)
    made = twin(real, args.config, args.step, args.every)
    write_bag(made, out)
    found = distances(real, made)
    lines = []
    for name, distance in found.items():
        share = f'{100.0 * distance["share"]:.3g} %' if distance['spread'] else '-'
        lines.append(f'{name:<40} {distance["rms"]:.4g} {real[name].unit}  {share}')
    give({'twin': out, 'signals': found}, args.json, '\n'.join([*lines, str(out)]))
    return 0
