# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make a model of one joint of a robot from its MJCF or URDF, with no Python.

Written is a model file, and beside it the joint in MJCF, with all that hangs on it as one body.
The model file has the effects that a joint may have and tolerances: read it, and correct the noise
of its readings. An MJCF tells its servo itself, a URDF has none. --rotor is the motor's inertia
times the square of the gear's ratio. docs/robot.md leads from a bag to a corrected model.

  simgap machine-from robot.xml --joint elbow --out elbow.yaml
  simgap machine-from robot.urdf --joint elbow --drive position kp=80 kv=4 --out elbow.yaml
"""

import argparse
from pathlib import Path

from simgap.cli.diagnose import numbers_of
from simgap.command.output import replaced
from simgap.errors import UserError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('robot', type=Path, metavar='ROBOT', help='an MJCF or URDF file')
    parser.add_argument('--joint', required=True, metavar='NAME', help='a hinge of it')
    parser.add_argument('--drive', nargs='+', default=[], metavar='WORD',
                        help='position kp=N kv=N limit=N, or ros2_control p=N d=N u_clamp_max=N '
                             "(default: the file's own actuator)")
    parser.add_argument('--rotor', type=float, metavar='INERTIA',
                        help='of the motor at the joint (default: armature of the file)')
    parser.add_argument('--at', nargs='+', default=[], metavar='JOINT=ANGLE',
                        help='where other joints stand (default: 0)')
    parser.add_argument('--columns', nargs='+', default=['reference', 'position', 'effort'],
                        metavar='COLUMN', help='of the logs (default: these three words); '
                                               'effort may be left out')
    parser.add_argument('--out', type=Path, required=True, metavar='FILE.yaml', help='to write')


def run(arguments: argparse.Namespace) -> int:
    """Write the two files of the machine."""
    out, beside = arguments.out, arguments.out.with_suffix('.xml')
    if out.suffix not in ('.yaml', '.yml') or beside.resolve() == arguments.robot.resolve():
        raise UserError(f'--out {out}: allowed is another FILE.yaml: {beside} is written, too')
    from simgap.model.robot_joint import machine_of_joint
    texts = machine_of_joint(
        arguments.robot, arguments.joint, out, arguments.drive, arguments.rotor,
        dict(numbers_of('--at', arguments.at)), arguments.columns)
    for place, text in texts.items():
        with replaced(place) as stream:
            stream.write(text.encode())
        print(place)
    return 0
