# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The options of commands whose work other processes or machines can do."""

import argparse
import os

from simgap.command.output import add_json_option


def add_worker_options(parser: argparse.ArgumentParser, jobs: int) -> None:
    """Add `--jobs` and `--scheduler`, which `antenna_drive.workers.workers` takes."""
    parser.add_argument('--jobs', type=int, default=jobs, metavar='N',
                        help='parallel processes on this machine (default: %(default)s here)')
    parser.add_argument('--scheduler', metavar='ADDRESS',
                        help='let the workers of a dask.distributed scheduler do the work, '
                             'e.g. tcp://host:8786')


def add_diagnosis_options(parser: argparse.ArgumentParser, example: str) -> None:
    """Add `--diagnose-options` and `--time-limit`, for diagnoses in processes of their own."""
    parser.add_argument('--diagnose-options', default='', metavar='TEXT',
                        help=f"further options for each diagnosis, e.g. '{example}'")
    parser.add_argument('--time-limit', type=float, default=900.0, metavar='S',
                        help='time limit of a diagnosis, after which it counts as failed '
                             '(default %(default)s)')


def add_batch_options(parser: argparse.ArgumentParser, of: str) -> None:
    """Add what commands share that diagnose many cases; `of` is what `--jobs` counts."""
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1, metavar='N',
                        help=f'{of} at a time (default: %(default)s here)')
    add_diagnosis_options(parser, '--config my.yaml')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    add_json_option(parser)
