# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
Say where a real drive and the model part, which effect is behind it, and how far it goes.

Give one or more recordings of the same machine (CSV, with the test sheet NAME.yaml beside
NAME.csv, or a bag). The more different the tests, the surer the verdict: a slow square wave, a
triangle and a chirp or multisine of half a minute each are a good programme.

For example:

  antenna-drive diagnose field.csv
  antenna-drive diagnose rec_a.csv rec_b.csv rec_c.csv --config my_drive.yaml \
      --json verdict.json --report verdict.html --corrected corrected.yaml
  antenna-drive diagnose rec_a.csv rec_b.csv rec_c.csv rec_d.csv --after verdict.json
  antenna-drive diagnose --model my_machine.py:machine logs/*.csv --map map.yaml

--corrected writes a configuration with the effects and the tolerances in it, as fitted;
`antenna-drive predict` shows how well it predicts a recording that was not used here.

--after takes a verdict on some of the recordings. Its answers are fitted to all of them, each
from where its fit had ended, beside what is found afresh. Otherwise a test in which motors creep
may hide the true one.

--model diagnoses a machine of your own, see docs/own-machine.md; `antenna-drive check-model` tells
beforehand what is wrong with it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from antenna_drive.cli.reading import warnings_in_one_line
from antenna_drive.cli.verdict_file import findings_of, planning_of
from antenna_drive.recording.files import read_recording
from antenna_drive.recording.import_map import import_file, load_map
from simgap.command.large_arrays import give_back_large_arrays
from simgap.command.output import add_json_option, check_options, give, Progress, replaced
from simgap.errors import UserError
from simgap.inputs.schema import Entry

if TYPE_CHECKING:
    from simgap.next_test.rivals import Rival
    from simgap.settings import Settings
    from simgap.verdict.diagnosis import Diagnosis


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument('recordings', nargs='+', metavar='RECORDING',
                        help='recordings of one machine: .csv, bags (folder or .mcap), or with '
                             '--map any file that docs/recording.md lists')
    parser.add_argument('--model', metavar='FILE.py:NAME',
                        help='diagnose a machine of your own in the place of the drive; also '
                             'FILE.yaml')
    parser.add_argument('--map', type=Path, metavar='MAP.yaml',
                        help='which column is which, and how it is written')
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration of the model, a file or the name of a set in '
                             'config/; may be given several times (default: reference)')
    add_json_option(parser)
    parser.add_argument('--report', metavar='FILE', help='write a self-contained page to FILE')
    parser.add_argument('--corrected', type=Path, metavar='FILE',
                        help='write the configuration with what was found to FILE (.yaml)')
    parser.add_argument('--jobs', type=int, default=2, metavar='N',
                        help='simulations at once (default: 2)')
    parser.add_argument('--after', type=Path, metavar='VERDICT',
                        help='JSON of a diagnosis of some of these recordings, whose answers are '
                             'fitted to all of them')
    parser.add_argument('--without', action='append', default=[], metavar='EFFECT',
                        help='leave an effect out of the catalogue, to see what is then said')
    parser.add_argument('--matters', action='append', default=[], metavar='SIGNAL=VALUE',
                        help="say of a signal's remainder beyond noise whether it is larger than "
                             'VALUE, in the unit of the signal, e.g. current_1=0.05')
    parser.add_argument('--threshold', action='append', default=[], metavar='NAME=VALUE',
                        help='change a threshold; lab thresholds lists them')


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, and write what was asked for; 0 whatever the verdict."""
    check_options(arguments, jobs=Entry('', 1, whole=True))
    give_back_large_arrays()
    if arguments.model:
        return _own_machine(arguments)
    # the compiled physics takes a while to load: not before it is needed
    from antenna_drive.diagnosis.diagnose import corrected, diagnose_recordings
    from antenna_drive.parameters.loading import load

    drive = load(*arguments.config)
    settings = _settings(arguments.threshold)
    limits = dict(_numbers('--matters', arguments.matters))
    earlier = _earlier(arguments.after)
    recordings = {}
    with warnings_in_one_line():
        import_map = load_map(arguments.map) if arguments.map else None
        for path in arguments.recordings:
            name = Path(path).stem
            while name in recordings:
                name += '_'
            recordings[name] = (import_file(path, import_map) if import_map
                                else read_recording(path))
    with Progress('diagnosis', 1.0) as progress:
        diagnosis = diagnose_recordings(
            recordings, drive, lambda share, doing: progress.update(share), arguments.jobs,
            settings, arguments.without, limits, earlier)
    correction = corrected(drive, diagnosis)
    _report(arguments.report, diagnosis)
    lines = [diagnosis.summary()]
    if arguments.corrected:
        with replaced(arguments.corrected) as stream:
            stream.write(correction.text.encode())
        lines.append(f'{arguments.corrected}: ' + (
            f'cannot hold {", ".join(correction.unwritten)}' if correction.unwritten else
            'holds all that was found about the machine')
            + (f'; {len(correction.recorder)} errors of the recorder are in the JSON'
               if correction.recorder else ''))
    give({**diagnosis.result, 'recorder': list(correction.recorder)}, arguments.json,
         '\n'.join(lines))
    return 0


def _own_machine(arguments: argparse.Namespace) -> int:
    """Diagnose a machine of the user's own."""
    from simgap.model import diagnose_logs, load_model, read_logs, summary_of

    for option in ('config', 'corrected'):
        if getattr(arguments, option):
            raise UserError(f'--{option}: does not go with --model')
    model, earlier = load_model(arguments.model), _earlier(arguments.after)
    with warnings_in_one_line():
        logs = read_logs(arguments.recordings, arguments.map)
    with Progress('diagnosis', 1.0) as progress:
        diagnosis = diagnose_logs(
            model, logs, lambda share, doing: progress.update(share), arguments.jobs,
            _settings(arguments.threshold), arguments.without,
            dict(_numbers('--matters', arguments.matters)), earlier)
    _report(arguments.report, diagnosis)
    give(diagnosis.result, arguments.json, summary_of(diagnosis))
    return 0


def _earlier(path: Path | None) -> Sequence[Rival]:
    """Return the answers of the verdict of --after."""
    return findings_of(path, planning_of(path)).rivals if path else ()


def _report(path: str | None, diagnosis: Diagnosis) -> None:
    """Write the page about a diagnosis, if one was asked for."""
    if path:
        from simgap.report.page import contents
        from simgap.report.render import render
        with replaced(Path(path)) as stream:
            stream.write(render('verdict.html', **vars(contents(diagnosis))).encode())


def _numbers(option: str, texts: Sequence[str]) -> Iterator[tuple[str, float]]:
    """Yield name and value of each NAME=VALUE."""
    for text in texts:
        name, _, value = text.partition('=')
        try:
            yield name, float(value)
        except ValueError as error:
            raise UserError(f'{option} {text}: {value!r} given, allowed is a number') from error


def _settings(changes: Sequence[str]) -> Settings:
    """Return the thresholds with what was given changed."""
    from simgap.settings import DEFAULT
    settings = DEFAULT
    known = {name: value for name, _, value in DEFAULT.entries()}
    for name, value in _numbers('--threshold', changes):
        if name not in known:
            raise UserError(f'--threshold {name}: no such threshold; lab thresholds '
                            'lists them')
        settings = settings.changed(name, type(known[name])(value))
    return settings
