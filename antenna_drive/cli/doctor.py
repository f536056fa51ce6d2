# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Say what of this installation is there, what works, and what to do about the rest.

Each part is tried: libraries are imported, the physics computes (it is compiled if it is not yet,
which takes up to a minute), a ROS 2 message is sent and received. With PART only these are
examined, and each of them has to be there.

Exit codes: 0 what is needed works; 1 something is installed and does not work; 3 something that
is needed, or was named as PART, is not installed.

For example:
  antenna-drive doctor
  antenna-drive doctor nodes recording --json -
"""

import argparse
import sys

from antenna_drive.health import (
    as_data, BROKEN, CHECKOUT, examine, Finding, MISSING, NEEDED, OK, PARTS,
)
from simgap.command.output import add_json_option, give
from simgap.command.programs import NEGATIVE, NOT_INSTALLED, OK as DONE
from simgap.errors import UserError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('parts', nargs='*', metavar='PART',
                        help=f'what to examine: {", ".join(PARTS)} (default: all '
                             f'but {", ".join(CHECKOUT)})')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    for part in arguments.parts:
        if part not in PARTS:
            raise UserError(f'{part}: no such part; there are {", ".join(PARTS)}')
    wanted = arguments.parts or [part for part in PARTS if part not in CHECKOUT]
    needed = set(arguments.parts or NEEDED)
    findings: list[Finding] = []
    for part in wanted:
        if sys.stderr.isatty():
            print(f'\r{part:20}\r', end='', file=sys.stderr, flush=True)
        findings += examine(part)
    give(as_data(findings), arguments.json, _text(findings))
    if any(item.state == BROKEN for item in findings):
        return NEGATIVE
    lacking = any(item.state == MISSING and item.part in needed for item in findings)
    return NOT_INSTALLED if lacking else DONE


def _text(findings: list[Finding]) -> str:
    lines = []
    part = ''
    for item in findings:
        lines.append(f'{item.part if item.part != part else "":11}{item.state:8} {item.what}: '
                     f'{item.found}')
        if item.remedy and item.state != OK:
            lines.append(f'{"":20}{item.remedy}')
        part = item.part
    return '\n'.join(lines)
