# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Options that several commands have, and what they stand for."""

import argparse
from collections.abc import Sequence
from typing import Any

from antenna_drive.emulator.wiring import UNITS
from simgap.errors import UserError
from simgap.inputs.plain_yaml import parse_yaml
from simgap.inputs.schema import nearest, ParameterError


def add_config_option(parser: argparse.ArgumentParser) -> None:
    """Add `--config FILE ...`, for `load`."""
    parser.add_argument('--config', nargs='+', default=(), metavar='FILE',
                        help='configuration files or names of sets in config/, later over earlier')


def add_settings_option(parser: argparse.ArgumentParser) -> None:
    """Add `--set UNIT.NAME=VALUE ...`, for `parse_settings`."""
    parser.add_argument('--set', nargs='+', default=(), metavar='UNIT.NAME=VALUE', dest='settings',
                        help='parameters of single units, such as torque_share.bias_pot=0.8')


def parse_settings(settings: Sequence[str]) -> dict[str, dict[str, Any]]:
    """
    Return what was given, by unit and parameter name; values are YAML and not yet checked.

    Raises UserError: a setting is not of the form UNIT.NAME=VALUE, or there is no such unit.
    """
    found: dict[str, dict[str, Any]] = {}
    for text in settings:
        name, equals, value = text.partition('=')
        unit, dot, key = name.partition('.')
        if not equals or not dot or not key:
            raise UserError(f'--set {text}: allowed is UNIT.NAME=VALUE, such as '
                            'torque_share.bias_pot=0.8')
        if unit not in UNITS:
            raise UserError(f'--set {text}: {unit}: no such unit{nearest(unit, UNITS)}; '
                            f'allowed are {", ".join(UNITS)}')
        try:
            given = parse_yaml(value)
        except ParameterError as error:
            raise UserError(f'--set {text}: {value!r} is no value') from error
        # ROS 2 tells whole numbers from others, the drive's parameters are nearly all others
        whole = isinstance(given, int) and not isinstance(given, bool)
        found.setdefault(unit, {})[key] = float(given) if whole else given
    return found


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
