# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Say where a machine and its model part, which effect is behind it, and how far the gap shrinks.

Give a model and the logs of some tests of one machine. The more different the tests, the surer the
verdict.

  simgap diagnose my_machine.py:machine logs/*.csv
  simgap diagnose my_machine.yaml logs/*.csv --map map.yaml --json verdict.json --report page.html
  simgap diagnose my_machine.py logs/*.csv more.csv --after verdict.json
  simgap diagnose my_machine.py a.csv b.csv --unseen c.csv

--after takes a verdict on some of the logs. Its answers are fitted to all of them, each from where
its fit had ended, beside what is found afresh.

--unseen is the proof: logs of other tests, predicted with what was found, and with the law of what
has no name. Nothing is fitted to them.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
import shlex
import sys
from typing import TYPE_CHECKING

from simgap import __version__
from simgap.command.large_arrays import give_back_large_arrays
from simgap.command.output import add_json_option, check_options, give, Progress, reading, replaced
from simgap.command.verdict_file import findings_of, planning_of
from simgap.errors import UserError
from simgap.inputs.schema import Entry

if TYPE_CHECKING:
    from simgap.search.rival import Rival
    from simgap.settings import Settings
    from simgap.verdict.record import Verdict


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('model', metavar='MODEL',
                        help='FILE.py:NAME of a declared model, or a model file FILE.yaml')
    parser.add_argument('logs', nargs='+', metavar='LOG', help='logs of its tests')
    add_map_option(parser)
    add_diagnosis_options(parser, 'angle=0.001')
    parser.add_argument('--corrected', type=Path, metavar='FILE',
                        help='write the MJCF or URDF that simgap machine-from made the model of, '
                             'with what was found')
    parser.add_argument('--unseen', nargs='+', default=[], metavar='LOG',
                        help='logs that nothing is fitted to; how well they are predicted is told')


def add_map_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--map', type=Path, metavar='MAP.yaml',
                        help='which column is which, and how it is written')


def add_diagnosis_options(parser: argparse.ArgumentParser, example: str) -> None:
    """Add what every diagnosis understands; `example` is a remainder that matters."""
    add_json_option(parser)
    parser.add_argument('--report', metavar='FILE', help='write a self-contained page to FILE')
    parser.add_argument('--jobs', type=int, default=2, metavar='N',
                        help='simulations at once (default: 2)')
    parser.add_argument('--after', type=Path, metavar='VERDICT',
                        help='JSON of a diagnosis of some of these recordings, whose answers are '
                             'fitted to all of them')
    parser.add_argument('--without', action='append', default=[], metavar='EFFECT',
                        help='leave an effect out of the catalogue, to see what is then said')
    parser.add_argument('--matters', action='append', default=[], metavar='SIGNAL=VALUE',
                        help="say of a signal's remainder beyond noise whether it is larger than "
                             f'VALUE, in the unit of the signal, e.g. {example}')
    parser.add_argument('--threshold', action='append', default=[], metavar='NAME=VALUE',
                        help='change a threshold of simgap.settings')


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, and write what was asked for; 0 whatever the verdict."""
    return diagnosed(arguments.model, arguments.logs, arguments, arguments.unseen)


def diagnosed(name: str, paths: Sequence[str], arguments: argparse.Namespace,
              further: Sequence[str] = ()) -> int:
    """Diagnose a machine by its model and its logs, and predict further ones."""
    check_options(arguments, jobs=Entry('', 1, whole=True))
    give_back_large_arrays()
    from simgap.model import diagnose_logs, load_model, read_logs, unseen
    from simgap.model.unseen import lines as lines_of_unseen, plain_fits

    model, earlier = load_model(name), earlier_of(arguments.after)
    if arguments.corrected:  # whether it can be done is told before the diagnosis
        from simgap.model.corrected import source_of
        source = source_of(Path(name), arguments.corrected)
    with reading():
        logs = read_logs(paths, arguments.map)
        others = read_logs(further, arguments.map) if further else []
    with Progress('diagnosis', 1.0) as progress:
        verdict = diagnose_logs(
            model, logs, lambda share, doing: progress.update(share), arguments.jobs,
            settings_of(arguments.threshold), arguments.without,
            dict(numbers_of('--matters', arguments.matters)), earlier)
    write_report(arguments.report, verdict, facts(f'simgap {__version__}', name, '', paths))
    lines = _write_corrected(verdict, arguments.corrected, source) if arguments.corrected else ()
    data, told, points = verdict.as_data(), [], plain_fits(verdict) if others else ()
    for log in others:
        found = unseen(verdict, log, points=points)
        told += lines_of_unseen(verdict, log, found)
        data.setdefault('unseen', {})[log.name] = {
            reading: vars(item) for reading, item in found.items()}
    give(data, arguments.json, '\n'.join([verdict.summary(), *told, *lines]))
    return int(verdict.word == 'too_few_to_judge')


def _write_corrected(verdict: Verdict, target: Path, source: tuple[Path, str]) -> Iterator[str]:
    """Write a corrected file, and a table of what it cannot say; yield what was done."""
    from simgap.model.corrected import corrected, found_of
    data, rows = corrected(source[0], found_of(verdict, source[1]))
    left = ''.join(f'{name},{before},{now}\n' for name, before, now, where in rows if not where)
    texts = {target: data} | ({target.with_suffix('.csv'): f'what,before,now\n{left}'.encode()}
                              if left else {})
    for place, text in texts.items():
        with replaced(place) as stream:
            stream.write(text)
        yield f'{place}: ' + ('what was found' if text is data else 'what such a file cannot say')
    yield from (f'  {name} {before:.6g} -> {now:.6g}: {where or "not said"}'
                for name, before, now, where in rows)


def earlier_of(path: Path | None) -> Sequence[Rival]:
    return findings_of(path, planning_of(path)).rivals if path else ()


def facts(made_by: str, machine: str, configuration: str, paths: Sequence[str]) -> dict[str, str]:
    """Return what was diagnosed, when it was written, and with what, for the page."""
    called = [made_by.partition(' ')[0], *sys.argv[1:]]
    return {'machine': machine, 'configuration': configuration, 'recordings': ', '.join(
        f'{Path(path).name} ({datetime.fromtimestamp(Path(path).stat().st_mtime):%Y-%m-%d})'
        for path in paths), 'made by': made_by,
        'command': shlex.join(called) if called[1:] and 'diagnose' in called[1] else ''}


def write_report(path: str | None, verdict: Verdict, about: Mapping[str, str]) -> None:
    """Write the page about a diagnosis, if one was asked for; `about` is from `facts`."""
    if path:
        from simgap.report.page import contents
        from simgap.report.render import render
        with replaced(Path(path)) as stream:
            stream.write(render('verdict.html', **contents(verdict, about)).encode())


def numbers_of(option: str, texts: Sequence[str]) -> Iterator[tuple[str, float]]:
    """Yield name and value of each NAME=VALUE."""
    for text in texts:
        name, _, value = text.partition('=')
        try:
            yield name, float(value)
        except ValueError as error:
            raise UserError(f'{option} {text}: {value!r} given, allowed is a number') from error


def settings_of(changes: Sequence[str]) -> Settings:
    from simgap.settings import DEFAULT
    settings = DEFAULT
    known = {name: value for name, _, value in DEFAULT.entries()}
    for name, value in numbers_of('--threshold', changes):
        if name not in known:
            raise UserError(f'--threshold {name}: no such threshold; simgap/settings.py lists '
                            'them')
        settings = settings.changed(name, type(known[name])(value))
    return settings
