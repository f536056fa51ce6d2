# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
Tell what is wrong with a model of your own machine, before any fit.

The model is simulated with the logs of its tests. Found are readings with a wrong shape or NaN,
numbers that nobody asks for, effects that do nothing, bounds without the neutral value, a
simulation that is not the same twice, and derivatives that are noise. docs/own-machine.md leads to
a first model.

  simgap check my_machine.py:machine logs/*.csv
  simgap check my_machine.py logs/*.csv --map map.yaml
  simgap check my_machine.yaml logs/*.csv
"""

import argparse
from pathlib import Path

from simgap.cli.diagnose import add_map_option
from simgap.command.output import add_json_option, give, reading


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('model', metavar='FILE.py:NAME',
                        help='Python file and name of the model, or a model file FILE.yaml')
    parser.add_argument('logs', nargs='+', type=Path, metavar='LOG.csv', help='logs of its tests')
    add_map_option(parser)
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check, and print what was found; 1 if something is wrong."""
    from simgap.model import check_model, load_model, read_logs

    model = load_model(arguments.model)
    with reading():
        logs = read_logs(arguments.logs, arguments.map)
    checked = check_model(model, logs)
    give({'faults': list(checked.faults), 'remarks': list(checked.remarks)}, arguments.json,
         checked.summary())
    return 1 if checked.faults else 0
