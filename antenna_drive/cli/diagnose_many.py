# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
Diagnose many machines: one row a machine, a table, and a page of the fleet.

Each subfolder of FOLDER with recordings is a machine. Recordings in FOLDER itself are grouped by
their names up to the last underscore: north_a.csv and north_b.csv are of the machine north. A
file config.yaml in a machine's subfolder is its own configuration, over those of --config.

  OUT/fleet.html, fleet.json             the table
  OUT/machines/NAME/verdict.html .json   of each machine, kept as soon as it is there
  OUT/machines/NAME/failure.txt          why a diagnosis failed

The same command resumes an interrupted one. A machine is diagnosed again if its recordings, the
options or the sources of this package have changed, or if it failed. The exit code is 1 if a
diagnosis failed.

With --scheduler, the workers of a cluster diagnose. They are sent the recordings and need no
disk in common.

For example:

  antenna-drive diagnose-many antennas/ --config my_drive.yaml
  antenna-drive diagnose-many antennas/ --out found/ --scheduler tcp://host:8786 --json -
"""

import argparse
import os
from pathlib import Path
import shlex
from urllib.parse import quote

from antenna_drive.cli.options import add_diagnosis_options, add_worker_options
from simgap.command.output import (
    add_json_option, check_options, give, Progress, replaced, write_json,
)
from simgap.command.programs import NEGATIVE, OK
from simgap.inputs.schema import Entry


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('folder', type=Path, metavar='FOLDER', help='folder with the recordings')
    parser.add_argument('--out', type=Path, metavar='OUT',
                        help='folder for the results (default: FOLDER/diagnosis)')
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration of the model, a file or the name of a set in '
                             'config/; may be given several times (default: reference)')
    parser.add_argument('--corrected', action='store_true',
                        help='also write corrected.yaml for each machine')
    add_diagnosis_options(parser, '--without tach_1.gain')
    parser.add_argument('--memory-limit', type=float, default=4000.0, metavar='MB',
                        help='memory that a diagnosis may ask for before it counts as failed '
                             '(default %(default)s; on Linux)')
    add_worker_options(parser, os.cpu_count() or 1)
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Diagnose the machines, and write table and page; 1 if a diagnosis failed."""
    from antenna_drive.fleet import diagnose_fleet, FleetOptions, machines_of, share, summary, text
    from antenna_drive.pages import render
    from antenna_drive.workers import workers

    check_options(arguments, jobs=Entry('', 1, whole=True), time_limit=Entry('s', 1e-3),
                  memory_limit=Entry('MB', 1.0))
    out = arguments.out or arguments.folder / 'diagnosis'
    machines = machines_of(arguments.folder, out)
    # each diagnosis gets its share of the cores; a worker of a cluster has one
    threads = 1 if arguments.scheduler else max(1, (os.cpu_count() or 1) // arguments.jobs)
    options = FleetOptions(
        tuple(arguments.config), tuple(shlex.split(arguments.diagnose_options)), threads,
        arguments.time_limit, arguments.memory_limit, arguments.corrected)
    with (Progress('machines', len(machines)) as progress,
          workers(arguments.jobs, arguments.scheduler, threads=True) as pool):
        rows = diagnose_fleet(machines, out, options, pool, progress.update)
    found = {**summary(rows), 'rows': rows}
    write_json(found, out / 'fleet.json')
    with replaced(out / 'fleet.html') as stream:
        stream.write(render('fleet.html', title=f'Fleet {arguments.folder.resolve().name}',
                            lead=f'{len(rows)} machines', rows=rows, summary=found,
                            share=share, link=lambda path: quote(os.fsencode(path))).encode())
    give(found, arguments.json, f'{text(rows)}\n{out / "fleet.html"}')
    return NEGATIVE if found['failed'] else OK
