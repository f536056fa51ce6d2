# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Make and diagnose the recordings of a trial in batches that can be resumed.

Complete parts are kept. The folder of a case gets its name only once all its recordings are in
it, and a verdict only once the diagnosis has succeeded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed, Future, ProcessPoolExecutor, ThreadPoolExecutor
import json
import math
import multiprocessing
import os
from pathlib import Path
import shutil
import subprocess
import sys
from typing import Any

from antenna_drive.errors import UserError
from antenna_drive.trial import sealing
from antenna_drive.trial.cases import draw_truths, make_recording, Truth
from antenna_drive.trial.programme import RECORDINGS
from antenna_drive.trial.real_antenna import FloatArray
from antenna_drive.trial.sensors import COLUMNS
from antenna_drive.trial.wild_programme import KEPT_BACK
import yaml

VERDICT = 'verdict.json'
FAILURE = 'failure.txt'
KEPT = 'kept'               # folder of the recordings that no diagnosis gets
DURATION_S = 30.0
# Formats that keep every digit of the sensors.
FORMATS = {'time_s': '%.6f', 'rate_command_rad_s': '%.12g', 'encoder_rad': '%.12g'}
USUAL_FORMAT = '%.9g'
Done = Callable[[int, int], None]


def prepare(folder: Path, count: int, seed: int, tolerance: float, sample_rate: float,
            duration: float, *, wild: bool = False, family: str = 'a') -> dict[str, Any]:
    """
    Draw and seal the truths of a trial, unless they are sealed already.

    Parameters
    ----------
    folder
        of the trial
    count, seed, tolerance, sample_rate, duration, wild, family
        as in `cases.draw_truths`

    Returns
    -------
    the manifest

    Raises
    ------
    UserError : the folder holds a trial with other settings

    """
    settings: dict[str, Any] = {'cases': count, 'seed': seed, 'tolerance': tolerance}
    if wild:
        settings |= {'wild': True, 'family': family}
    else:
        settings |= {'sample_rate_hz': sample_rate, 'duration_s': duration}
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
    truths = draw_truths(count, seed, tolerance, sample_rate=sample_rate, duration=duration,
                         wild=wild, family=family)
    return sealing.seal(folder, settings, truths)


def write_csv(path: Path, columns: dict[str, FloatArray]) -> None:
    """Write the columns of a recording as CSV with a heading."""
    formats = ','.join(FORMATS.get(name, USUAL_FORMAT) for name in COLUMNS)
    rows = zip(*(columns[name].tolist() for name in COLUMNS))
    lines = [','.join(COLUMNS), *(formats % row for row in rows)]
    path.write_text('\n'.join(lines) + '\n', encoding='utf-8')


def make_case(folder: Path, truth: Truth) -> None:
    """
    Write the recordings of one case and their test sheets; of a wild case, keep one back.

    Parameters
    ----------
    folder
        of the trial
    truth
        of the case

    """
    if len(truth['sheets']) > len(RECORDINGS):
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
            write_csv(draft / f'{name}.csv', make_recording(truth, number))
            given = (truth.get('given_sheets') or truth['sheets'])[number]
            if given is not None:
                sheet = yaml.safe_dump(given, sort_keys=False, default_flow_style=None)
                (draft / f'{name}.yaml').write_text(sheet, encoding='utf-8')
        shutil.rmtree(final, ignore_errors=True)
        os.replace(draft, final)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def make_cases(folder: Path, manifest: dict[str, Any], jobs: int,
               done: Done = lambda part, total: None) -> None:
    """
    Make all cases that do not exist yet.

    Parameters
    ----------
    folder
        of the trial
    manifest
        of the trial
    jobs
        number of processes
    done
        called with the number of complete cases and their total

    """
    _remove_drafts(folder)
    names = list(manifest['seals'])
    wanted = [name for name in names if not (folder / name).is_dir()]
    truths = [sealing.open_truth(folder, name, manifest) for name in wanted]
    complete = len(names) - len(wanted)
    done(complete, len(names))
    for _ in _made(folder, truths, jobs):
        complete += 1
        done(complete, len(names))


def _made(folder: Path, truths: Sequence[Truth], jobs: int) -> Iterator[None]:
    """Make the cases of these truths, in `jobs` processes; yield after each."""
    # The first case compiles the equations for the processes that follow.
    alone = 1 if jobs > 1 else len(truths)
    for truth in truths[:alone]:
        make_case(folder, truth)
        yield
    if truths[alone:]:
        context = multiprocessing.get_context('spawn')
        with ProcessPoolExecutor(jobs, mp_context=context) as pool:
            yield from _finished([pool.submit(make_case, folder, truth)
                                  for truth in truths[alone:]])


def _remove_drafts(folder: Path) -> None:
    """Remove incomplete cases of an interrupted run."""
    for draft in (*folder.glob('.case_*'), *(folder / KEPT).glob('.case_*')):
        shutil.rmtree(draft, ignore_errors=True)


def _finished(futures: Sequence[Future[Any]]) -> Iterator[Any]:
    """Yield results as they complete; cancel the rest after an error."""
    try:
        for future in as_completed(futures):
            yield future.result()
    finally:
        for future in futures:
            future.cancel()


def diagnose_case(case: Path, options: Sequence[str], limit: float) -> bool:
    """
    Diagnose one case in a process of its own, which gets only the recordings.

    Parameters
    ----------
    case
        folder of the case
    options
        further options for the diagnosis
    limit
        time limit, after which the case counts as failed [s]

    Returns
    -------
    True if there is a verdict; otherwise FAILURE holds the reason

    """
    draft = case / f'.{VERDICT}'
    command = [sys.executable, '-m', 'antenna_drive', 'diagnose',
               *(str(case / f'{name}.csv') for name in RECORDINGS),
               '--json', str(draft), *options]
    try:
        result = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, timeout=limit, check=False)
        reason = f'exit code {result.returncode}\n' + result.stderr.decode(errors='replace')
    except subprocess.TimeoutExpired:
        reason = f'no verdict after {limit:g} s'
    (case / FAILURE).unlink(missing_ok=True)
    if draft.exists():
        try:
            json.loads(draft.read_text(encoding='utf-8'))
        except ValueError as error:
            reason = f'verdict is not JSON: {error}\n{reason}'
        else:
            os.replace(draft, case / VERDICT)
            return True
    draft.unlink(missing_ok=True)
    sealing.write_whole(case / FAILURE, reason[-20000:] + '\n')
    return False


def diagnose_cases(folder: Path, manifest: dict[str, Any], jobs: int,
                   options: Sequence[str] = (), limit: float = math.inf,
                   done: Done = lambda part, total: None) -> int:
    """
    Diagnose all cases that have no verdict yet, including those that failed before.

    Parameters
    ----------
    folder
        of the trial
    manifest
        of the trial
    jobs
        diagnoses at a time
    options
        further options for the diagnosis
    limit
        time limit of one diagnosis, after which it counts as failed [s]
    done
        called with the number of finished cases and their total

    Returns
    -------
    number of cases that failed

    """
    names = list(manifest['seals'])
    wanted = [name for name in names if not (folder / name / VERDICT).exists()]
    complete, failures = len(names) - len(wanted), 0
    done(complete, len(names))
    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(diagnose_case, folder / name, options, limit) for name in wanted]
        for success in _finished(futures):
            complete += 1
            failures += not success
            done(complete, len(names))
    return failures
