# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Measure speed: headline figures are ratios of two interleaved measurements in one run.

Groups:
  transport   five processes against bare exchanges of the same frames, in Python and compiled
  simulation  one process against solve_ivp, python-control, PathSim and Drake at equal accuracy,
              and against the same loop in C
  batch       many variants on all cores, in an executor of the caller
  diagnosis   wall time and memory of a diagnosis
  fleet       diagnoses of several machines by one worker of a cluster, and by two
  start       import, first step, demo
  live        the live page in a headless Chromium: first curve, sliders, what it costs the drive;
              ten minutes of it with the page open

Peers that are not installed are left out, and the result names them; pip install
'antenna_drive[bench]' installs all. Each figure is a median with minimum and maximum; the JSON
has the single values. Do not use the machine for other work meanwhile.

For example:
  lab bench --quick
  lab bench --json bench.json
  lab bench --only simulation --json -
  lab bench --only transport --paced 480 --json -     (a quarter of an hour at most)
"""

import argparse
import sys

from simgap.command.output import add_json_option, check_options, give
from simgap.inputs.schema import Entry

GROUPS = ('start', 'simulation', 'batch', 'diagnosis', 'fleet', 'live', 'transport')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument('--quick', action='store_true',
                        help='shorter runs and fewer settings; takes up to five minutes')
    parser.add_argument('--only', action='append', choices=GROUPS, metavar='GROUP',
                        help=f'one of {", ".join(GROUPS)}; may be repeated (default: all)')
    parser.add_argument('--repetitions', type=int, default=5, metavar='N',
                        help='number of measurements for each median (default: %(default)s)')
    parser.add_argument('--paced', type=float, metavar='S',
                        help='duration of the run at real-time pace [s]; a tenth of it is added '
                        'with half the macro-step (default: 600, 15 with --quick)')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measure, and print the table or write the JSON; always 0."""
    from lab.bench import suite

    check_options(arguments, repetitions=Entry('', 1, whole=True), paced=Entry('s', 1.0, 1e5))
    result = suite.measure(arguments.only or GROUPS, arguments.repetitions, arguments.quick,
                           _say, {'transport': {'paced_s': arguments.paced}})
    give(result, arguments.json, suite.table(result))
    return 0


def _say(doing: str) -> None:
    print(f'bench: {doing}', file=sys.stderr, flush=True)
