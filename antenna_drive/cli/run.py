# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
Run the drive in one process and write every signal.

  antenna-drive run --duration 20 --out run.csv --config old_circuit \
      --set test_signal.waveform=saw_tooth test_signal.amplitude=0.01196 test_signal.period=5

The numbers are those of the five nodes, to the last bit, and come hundreds of times faster than
real time. --out NAME.csv writes a table, any other name a rosbag2 folder (MCAP).
"""

import argparse
from pathlib import Path

from antenna_drive.cli.options import add_config_option, add_settings_option, parse_settings
from simgap.command.output import check_options, Progress
from simgap.inputs.schema import Entry


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--duration', type=float, required=True, metavar='S',
                        help='simulated time [s]')
    parser.add_argument('--out', type=Path, required=True, metavar='FILE',
                        help='what to write; it must not be there yet')
    add_config_option(parser)
    add_settings_option(parser)
    parser.add_argument('--step', type=float, default=1e-3, metavar='S',
                        help='macro-step [s] (default: %(default)s)')
    parser.add_argument('--every', type=int, default=1, metavar='N',
                        help='write every N-th macro-step only')


def run(args: argparse.Namespace) -> int:
    from antenna_drive.emulator.run import Emulator
    from antenna_drive.emulator.units import overridden
    from antenna_drive.parameters import load
    from antenna_drive.recording.atomic import refuse_existing
    from antenna_drive.recording.bag_writer import write_bag
    from antenna_drive.recording.csv_format import write_csv
    from antenna_drive.recording.runs import from_run

    check_options(args, duration=Entry('s', 1e-5, 1e9), every=Entry('', 1, whole=True))
    refuse_existing(args.out)
    drive = overridden(load(*args.config), parse_settings(args.settings))
    with Progress('running', 1.0) as progress:
        result = Emulator(drive, args.step).run(args.duration, every=args.every,
                                                progress=progress.update)
    recording = from_run(result, drive)
    if args.out.suffix == '.csv':
        write_csv(recording, args.out)
    else:
        write_bag(recording, args.out)
    print(f'{result.steps[-1]} steps, {result.time[-1]:g} s: {args.out}')
    return 0
