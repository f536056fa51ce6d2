# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Predict which effects a planned test can separate, before going to the antenna.

A test is a test sheet (YAML) or one of the built-in tests. For each effect the command shows the
smallest size that is detectable, and the effects that look alike. With --each every test is also
judged alone, to find the tests that separate most.

For example:

  antenna-drive confusability
  antenna-drive confusability --excitation square triangle --each
  antenna-drive confusability --excitation planned.yaml --json -
"""

import argparse
from pathlib import Path

import numpy as np
from simgap.command.output import add_json_option, check_options, give, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry
from simgap.verdict import spoken


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--excitation', nargs='+', metavar='TEST',
                        default=['square', 'triangle', 'multisine'],
                        help='test sheets, or square, triangle, multisine, chirp '
                             '(default: square triangle multisine)')
    parser.add_argument('--each', action='store_true', help='also judge each test alone')
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration of the model; may be repeated')
    parser.add_argument('--duration', type=float, default=30.0, metavar='S',
                        help='length of each test (default: 30)')
    parser.add_argument('--rate', type=float, default=200.0, metavar='HZ',
                        help='sample rate (default: 200)')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Analyse the tests and print which effects they separate."""
    from antenna_drive.diagnosis.planned_tests import (
        BUILT_IN, confusability_of, groups, passing_for, planned, separated,
    )
    from antenna_drive.parameters.loading import load
    from antenna_drive.recording.sheet import load_sheet

    check_options(arguments, duration=Entry('s', 1.0, 3600.0), rate=Entry('Hz', 50.0, 10000.0))
    drive = load(*arguments.config)
    tests = {}
    for name in arguments.excitation:
        sheet = BUILT_IN.get(name)
        if sheet is None:
            path = Path(name)
            if not path.is_file():
                raise UserError(f'--excitation: {name}: no such test sheet or built-in test; '
                                f'built in are {", ".join(BUILT_IN)}')
            sheet = load_sheet(path)
            if sheet.waveform is None:
                raise UserError(f'{path}: waveform: is missing, a planned test needs one')
        tests[Path(name).stem] = planned(sheet, arguments.duration, arguments.rate)
    sets = {' + '.join(tests): tests}
    if arguments.each and len(tests) > 1:
        sets.update({name: {name: test} for name, test in tests.items()})
    found = {}
    with Progress('confusability', len(sets)) as progress:
        for i, (name, chosen) in enumerate(sets.items()):
            def advance(share: float, i: int = i) -> None:
                progress.update(i + share)

            found[name] = confusability_of(chosen, drive, advance)
    result = {name: {
        'effects': [{'effect': effect, 'detectable': size if np.isfinite(size) else None,
                     'unit': unit} for effect, size, unit in zip(
                         item.effects, item.detectable.tolist(), item.units, strict=True)],
        'confusable': groups(item), 'pairs_separated': separated(item),
        'alike': item.alike} for name, item in found.items()}
    whole = next(iter(found.values()))
    lines = ['smallest detectable size, and the effects that look alike']
    for i, effect in enumerate(whole.effects):
        lines.append(f'  {effect:36s} {_size(whole.detectable[i], whole.units[i]):24s} '
                     + ', '.join(passing_for(whole, i, 3)))
    for name, item in found.items():
        lines.append(f'{name}: {100.0 * separated(item):.1f} % of all pairs of effects are '
                     f'separated; {len(groups(item))} groups are not')
    give(result, arguments.json, '\n'.join(lines))
    return 0


def _size(size: float, unit: str) -> str:
    """Return a detectable size as people say it."""
    if not np.isfinite(size):
        return 'does not show'
    return spoken.size(size, unit, ' %')
