# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make and diagnose the recordings of a trial in batches that can be resumed.

Complete parts are kept. The folder of a case gets its name only once all its recordings are in
it, and a verdict only once the diagnosis has succeeded.
"""

from __future__ import annotations

import argparse
from collections.abc import Container, Mapping, Sequence
from functools import partial
import json
import math
import os
from pathlib import Path
import shutil
from typing import Any

from antenna_drive.subcommand import run_command
from lab.antenna.cases import draw_truths, make_recording, Truth
from lab.antenna.programme import RECORDINGS
from lab.antenna.real_antenna import FloatArray
from lab.antenna.sensors import COLUMNS
from lab.antenna.wild_programme import KEPT_BACK, LONGEST_S
from lab.benchmark import cases as benchmark
from lab.joints import cases as others
from lab.joints.machines import BENCHMARK, kind_of
from lab.trials import sealing
from lab.trials.driver import Arm, complete, Done, Row
from simgap.errors import UserError
import yaml

VERDICT = 'verdict.json'
FAILURE = 'failure.txt'
KEPT = 'kept'               # folder of the recordings that no diagnosis gets
CORRECTED = 'corrected.yaml'
PREDICTIONS = {'before': 'before.csv', 'after': 'after.csv'}
PREDICTION_FAILURE = 'prediction_failure.txt'
PREDICTION_LIMIT_S = 300.0
DURATION_S = 30.0
# Formats that keep every digit of the sensors.
FORMATS = {'time_s': '%.6f', 'rate_command_rad_s': '%.12g', 'encoder_rad': '%.12g'}
USUAL_FORMAT = '%.9g'


def prepare(folder: Path, count: int, seed: int, tolerance: float, sample_rate: float,
            duration: float, *, wild: bool = False, family: str = 'a', largest: float = 1.0,
            longest: float = LONGEST_S, machines: Sequence[str] = ()) -> dict[str, Any]:
    """
    Draw and seal the truths of a trial, unless they are sealed already; return the manifest.

    Settings are those of `cases.draw_truths`; with `machines` other than the antenna only `count`
    and `seed` are used. Raise UserError where the folder holds a trial with other settings.
    """
    settings: dict[str, Any] = {'cases': count, 'seed': seed}
    if machines:
        settings |= {'machines': list(machines)}
    elif wild:
        settings |= {'tolerance': tolerance, 'wild': True, 'family': family}
    else:
        settings |= {'tolerance': tolerance, 'sample_rate_hz': sample_rate, 'duration_s': duration}
    # a trial that was begun without these entries goes on
    if largest != 1.0:
        settings['largest'] = largest
    if longest != LONGEST_S:
        settings['longest_s'] = longest
    if (folder / sealing.MANIFEST).exists():
        manifest = sealing.read_manifest(folder)
        if manifest['settings'] != settings:
            old: dict[str, Any] = manifest['settings']
            differing = [f'{key} {old.get(key)}, not {value}'
                         for key, value in {**dict.fromkeys(old), **settings}.items()
                         if old.get(key) != value]
            raise UserError(f'{folder}: holds a trial with {"; ".join(differing)}; '
                            'give the same settings to resume it, or another --out')
        return manifest
    if machines:
        room = benchmark if machines[0] in BENCHMARK else others
        truths = room.draw_truths(count, seed, list(machines))
    else:
        truths = draw_truths(count, seed, tolerance, sample_rate=sample_rate, duration=duration,
                             wild=wild, family=family, largest=largest, longest=longest)
    return sealing.seal(folder, settings, truths)


def write_csv(path: Path, columns: Mapping[str, FloatArray],
              formats: Mapping[str, str] = FORMATS) -> None:
    """Write the columns of a recording as CSV with a heading."""
    row_format = ','.join(formats.get(name, USUAL_FORMAT) for name in columns)
    rows = zip(*(values.tolist() for values in columns.values()))
    lines = [','.join(columns), *(row_format % row for row in rows)]
    path.write_text('\n'.join(lines) + '\n', encoding='utf-8')


def make_case(folder: Path, truth: Truth) -> None:
    """Write the recordings of one case and their test sheets; of a wild case, keep one back."""
    if len(truth.get('sheets') or truth.get('tests', ())) > len(RECORDINGS):
        (folder / KEPT).mkdir(exist_ok=True)
        _make_folder(folder / KEPT / truth['case'], truth, {len(RECORDINGS): KEPT_BACK})
    _make_folder(folder / truth['case'], truth, dict(enumerate(RECORDINGS)))


def _make_folder(final: Path, truth: Truth, names: Mapping[int, str]) -> None:
    """Write recordings of a case, by number and name, and their sheets; all or none."""
    draft = final.with_name(f'.{final.name}.{os.getpid()}')
    shutil.rmtree(draft, ignore_errors=True)
    draft.mkdir()
    try:
        for number, name in names.items():
            if 'machine' in truth:
                _write_other(draft, truth, number, name)
                continue
            columns = make_recording(truth, number)
            write_csv(draft / f'{name}.csv', {key: columns[key] for key in COLUMNS})
            given = (truth.get('given_sheets') or truth['sheets'])[number]
            if given is not None:
                sheet = yaml.safe_dump(given, sort_keys=False, default_flow_style=None)
                (draft / f'{name}.yaml').write_text(sheet, encoding='utf-8')
        shutil.rmtree(final, ignore_errors=True)
        os.replace(draft, final)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _write_other(folder: Path, truth: Truth, number: int, name: str) -> None:
    """Write one recording of a machine other than the antenna, and what else its case has."""
    kind = kind_of(truth['machine'])
    room = benchmark if kind.name in BENCHMARK else others
    write_csv(folder / f'{name}.csv', room.make_recording(truth, number), kind.formats)
    if room is benchmark and name == KEPT_BACK:
        write_csv(folder / PREDICTIONS['before'], benchmark.base_prediction(truth, number),
                  kind.formats)
    elif room is benchmark:
        benchmark.write_task(folder, truth)


def make_cases(folder: Path, manifest: dict[str, Any], jobs: int,
               done: Done = lambda part, total: None, scheduler: str | None = None,
               skipped: Container[str] = ()) -> None:
    """
    Make all cases that do not exist yet, except those in `skipped`, in `jobs` processes.

    `done` gets the number of complete cases and their total. `scheduler` is the address of a
    dask.distributed scheduler whose workers make them; they see the folder under the same path.
    """
    _remove_drafts(folder)
    names = [name for name in manifest['seals'] if name not in skipped]
    truth_of = partial(sealing.open_truth, folder, manifest=manifest)
    missing = [name for name in names if not (folder / name).is_dir()]
    if jobs > 1 and scheduler is None and missing:
        # the first case compiles the equations for the processes that follow
        make_case(folder, truth_of(missing[0]))
    complete(names, truth_of, [Arm(lambda name, row: not (folder / name).is_dir(),
                                   partial(_make_seen_case, folder.absolute()))],
             jobs=jobs, scheduler=scheduler, done=done)
    _remove_drafts(folder)


def _make_seen_case(folder: Path, truth: Truth) -> Row:
    """Make a case, unless a worker that was killed had just completed it."""
    _check_seen(folder)
    if not (folder / truth['case']).exists():
        make_case(folder, truth)
    return {}


def _check_seen(folder: Path) -> None:
    if not (folder / sealing.MANIFEST).exists():
        raise UserError(f'{folder}: a worker does not see this folder; --out must lie on a disk '
                        'that all workers have under the same path')


def _remove_drafts(folder: Path) -> None:
    """Remove incomplete cases of an interrupted run or of a worker that was killed."""
    for draft in (*folder.glob('.case_*'), *(folder / KEPT).glob('.case_*')):
        shutil.rmtree(draft, ignore_errors=True)


def machine_of(folder: Path, name: str, manifest: Mapping[str, Any]) -> str | None:
    """Return the machine of a case if it is no antenna: a diagnosis is told that much."""
    if 'machines' not in manifest['settings']:
        return None
    return str(sealing.open_truth(folder, name, dict(manifest))['machine'])


def model_options(machine: str | None) -> list[str]:
    """Return the options of a diagnosis that name the model of a machine; None: the antenna."""
    return [] if machine is None else ['--model', kind_of(machine).model]


def diagnose_case(case: Path, options: Sequence[str], limit: float,
                  kept: Path | None = None) -> bool:
    """
    Diagnose one case in a process of its own, which gets only the recordings.

    After `limit` [s] the case counts as failed. The recording `kept` is predicted after the
    verdict. Return whether there is a verdict; otherwise FAILURE holds the reason.
    """
    correction = [] if kept is None else ['--corrected', str(case / CORRECTED)]
    failure = diagnose_recordings(case, RECORDINGS, VERDICT, limit, [*correction, *options])
    (case / FAILURE).unlink(missing_ok=True)
    if not (case / VERDICT).exists():
        sealing.write_whole(case / FAILURE, failure[-20000:] + '\n')
        return False
    if kept is not None:
        predict_kept(case, options, kept)
    return True


def diagnose_recordings(case: Path, recordings: Sequence[str], name: str, limit: float,
                        options: Sequence[str]) -> str:
    """
    Diagnose some recordings of a case in a process of its own, unless that was done before.

    The verdict `name` is there only if the diagnosis succeeds within `limit` [s]. Return what the
    diagnosis said, '' if it was done before.
    """
    if (case / name).exists():
        return ''
    draft = case / f'.{name}.{os.getpid()}'
    said = run_command(['diagnose', *(str(case / f'{item}.csv') for item in recordings),
                        '--jobs', '1', '--json', str(draft), *options], limit)
    if not draft.exists():
        return said
    try:
        json.loads(draft.read_text(encoding='utf-8'))
    except ValueError as error:
        draft.unlink()
        return f'verdict is not JSON: {error}\n{said}'
    os.replace(draft, case / name)
    return said


def predict_kept(case: Path, options: Sequence[str], kept: Path) -> bool:
    """
    Predict the recording that was kept back, before and after, and name it in the verdict.

    The case has its verdict and its corrected configuration. Return whether both predictions are
    there; otherwise PREDICTION_FAILURE holds the reason.
    """
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument('--config', action='append')
    given = parser.parse_known_args(list(options))[0].config or ['reference']
    (case / PREDICTION_FAILURE).unlink(missing_ok=True)
    for key, words in (
            ('before', [word for name in given for word in ('--config', name)]),
            ('after', ['--config', str(case / CORRECTED), '--recorder', str(case / VERDICT)])):
        out = case / PREDICTIONS[key]
        for old in (out, out.with_suffix('.meta.json')):
            old.unlink(missing_ok=True)
        failure = run_command(['predict', str(kept), *words, '--out', str(out)],
                              PREDICTION_LIMIT_S)
        if not out.exists():
            sealing.write_whole(case / PREDICTION_FAILURE, f'{key}: {failure[-20000:]}\n')
            return False
    verdict = json.loads((case / VERDICT).read_text(encoding='utf-8'))
    sealing.write_whole(case / VERDICT, json.dumps(
        {**verdict, 'held_back': PREDICTIONS}, indent=2, ensure_ascii=False) + '\n')
    return True


def _unpredicted(case: Path) -> bool:
    """Return whether a case has a verdict that still lacks its predictions."""
    if not (case / VERDICT).exists() or not (case / CORRECTED).exists():
        return False
    verdict = json.loads((case / VERDICT).read_text(encoding='utf-8'))
    return isinstance(verdict, dict) and 'held_back' not in verdict


def diagnose_cases(folder: Path, manifest: dict[str, Any], jobs: int,
                   options: Sequence[str] = (), limit: float = math.inf,
                   done: Done = lambda part, total: None,
                   scheduler: str | None = None, skipped: Container[str] = ()) -> int:
    """
    Diagnose all cases that have no verdict yet, including those that failed before.

    Where a recording was kept back, it is predicted then. A diagnosis counts as failed after
    `limit` [s]; for the rest see `make_cases`. Return the number of cases that failed.
    """
    names = [name for name in manifest['seals'] if name not in skipped]
    here = folder if scheduler is None else folder.absolute()
    if scheduler is None:
        # each diagnosis gets its share of the cores; a worker of a cluster has one
        options = ['--jobs', str(max(1, (os.cpu_count() or 1) // jobs)), *options]

    def kept(name: str) -> Path | None:
        path = here / KEPT / name / f'{KEPT_BACK}.csv'
        return path if path.exists() else None

    def lacks(name: str, _: Row) -> bool:
        return not (folder / name / VERDICT).exists() or (
            kept(name) is not None and _unpredicted(folder / name))

    def known(name: str) -> tuple[Path, Path | None, str | None]:
        diagnosed = (folder / name / VERDICT).exists()
        return here / name, kept(name), (None if diagnosed else machine_of(folder, name, manifest))

    complete(names, known, [Arm(lacks, partial(_diagnose_seen_case, here, options, limit))],
             jobs=jobs, scheduler=scheduler, threads=True, done=done)
    return sum(not (folder / name / VERDICT).exists() for name in names)


def _diagnose_seen_case(folder: Path, options: Sequence[str], limit: float,
                        known: tuple[Path, Path | None, str | None]) -> Row:
    """Do what a case still lacks: its diagnosis, the predictions of what was kept back."""
    _check_seen(folder)
    case, kept, machine = known
    if not (case / VERDICT).exists():
        diagnose_case(case, [*model_options(machine), *options], limit, kept)
    elif kept is not None and _unpredicted(case):
        predict_kept(case, options, kept)
    return {}
