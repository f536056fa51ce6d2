# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Write the drive as an FMU, for programs that simulate with models of many kinds.

  antenna-drive fmu drive.fmu                                    FMI 2, the reference drive
  antenna-drive fmu mine.fmu --fmi 3 --config my_drive.yaml      FMI 3, a drive of your own

It is for co-simulation on x86-64 Linux. Inputs: rate_command and external_torque, each with a
slope (0: held until the next step). Outputs: every signal, as torque_share.bias_voltage.
Parameters: parameters.UNIT.SETTING for each setting that --set knows, which start as configured,
and effects.COMPONENT.EFFECT.NUMBER for each effect that a diagnosis knows, which start at none.
Those that may be turned while the drive runs are tunable.

A communication step is a whole number of macro-steps. The signals are those of `antenna-drive
run`, to the last bit. The FMU runs this package: the Python that loads it needs antenna_drive.
docs/running.md has an example, and says what a program that is not written in Python needs.
"""

import argparse
from pathlib import Path

from antenna_drive.cli.options import add_config_option
from simgap.command.programs import OK
from simgap.errors import UserError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('out', type=Path, metavar='FILE',
                        help='what to write, a name that ends in .fmu; it must not be there yet')
    parser.add_argument('--fmi', type=int, choices=(2, 3), default=2,
                        help='version of the standard (default: %(default)s)')
    add_config_option(parser)
    parser.add_argument('--step', type=float, default=1e-3, metavar='S',
                        help='macro-step [s] (default: %(default)s)')


def run(args: argparse.Namespace) -> int:
    from antenna_drive.fmu.export import write_fmu
    from antenna_drive.parameters import load

    if args.out.suffix != '.fmu':
        raise UserError(f'{args.out}: an FMU has a name that ends in .fmu')
    write_fmu(load(*args.config), args.out, args.fmi, args.step)
    print(f'{args.out}: FMI {args.fmi}, macro-step {args.step:g} s')
    return OK
