# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The diagnosis of many machines: find their recordings, diagnose each machine, keep what was found.

Each machine is diagnosed by a process of its own, which gets its recordings and nothing else. A
verdict is kept as soon as it is there, with a digest of what it was made from. It is found again
for the same recordings, options and sources, and only for these.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import fcntl
import hashlib
import json
import math
import os
from pathlib import Path
import shutil
import tempfile
from typing import Any

from antenna_drive.subcommand import run_command
from antenna_drive.workers import TaskLost, Workers
from antenna_drive.workers.cluster import fingerprint
from simgap.drafts import drafted
from simgap.errors import one_line, UserError

MACHINES = 'machines'           # folder of what was found, one folder a machine
VERDICT, PAGE, CORRECTED = 'verdict.json', 'verdict.html', 'corrected.yaml'
FAILURE = 'failure.txt'
CONFIG = 'config.yaml'          # of one machine, beside its recordings
MADE_FROM = 'made_from'         # the digest, in the verdict
Files = dict[str, bytes]
# Where a diagnosis works; its process holds the lock.
_WORK, _LOCK = 'antenna_drive-fleet-', '.lock'


@dataclass(frozen=True)
class FleetMachine:
    """
    One machine.

    name : of its folder, or of the group of its recordings
    recordings : its recordings, CSV files and bags
    config : its own configuration; None if it has none
    """

    name: str
    recordings: tuple[Path, ...]
    config: Path | None = None


@dataclass(frozen=True)
class FleetOptions:
    """
    What holds for every machine.

    config : configurations of the model, files or names of sets
    diagnose : further options of `antenna-drive diagnose`
    threads : simulations at once in a diagnosis; they do not change a verdict
    limit_s : time limit of a diagnosis [s]
    memory_MB : what a diagnosis may ask for [MB]
    corrected : True if the corrected configuration is wanted
    """

    config: tuple[str, ...] = ()
    diagnose: tuple[str, ...] = ()
    threads: int = 1
    limit_s: float = math.inf
    memory_MB: float = math.inf
    corrected: bool = False


def machines_of(folder: Path, out: Path | None = None) -> list[FleetMachine]:
    """
    Return the machines of a folder, by name.

    Each subfolder that holds recordings is a machine. Recordings that lie in the folder itself
    are grouped by their names up to the last underscore: north_a.csv and north_b.csv are of the
    machine north.

    folder : with the recordings
    out : a folder that holds none, although it may lie there

    Raises UserError: there is no such folder, it holds no recordings, or two machines have one
    name.
    """
    if not folder.is_dir():
        raise UserError(f'{folder}: no such folder; a folder with recordings is needed')
    found: dict[str, FleetMachine] = {}
    groups: dict[str, list[Path]] = {}
    for path in _recordings(folder):
        groups.setdefault(path.stem.rpartition('_')[0] or path.stem, []).append(path)
    for name, paths in groups.items():
        found[name] = FleetMachine(name, tuple(paths))
    for place in sorted(folder.iterdir()):
        if not place.is_dir() or place == out or place.name.startswith('.') or _is_bag(place):
            continue
        paths = _recordings(place)
        if paths and place.name in found:
            raise UserError(f'{folder}: {place.name}: a subfolder and a group of files have this '
                            'name; rename one of them')
        if paths:
            config = place / CONFIG
            found[place.name] = FleetMachine(place.name, tuple(paths),
                                             config if config.is_file() else None)
    if not found:
        raise UserError(f'{folder}: holds no recordings; allowed are .csv, .mcap and bags, in '
                        'one subfolder a machine or as MACHINE_TEST.csv')
    return [found[name] for name in sorted(found)]


def _recordings(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if not path.name.startswith('.') and (
        path.suffix in ('.csv', '.mcap', '.db3') or path.is_dir() and _is_bag(path)))


def _is_bag(folder: Path) -> bool:
    return any(folder.glob('*.mcap')) or any(folder.glob('*.db3'))


def diagnose_fleet(machines: Sequence[FleetMachine], out: Path, options: FleetOptions,
                   workers: Workers, done: Callable[[int], None] = lambda count: None,
                   ) -> list[dict[str, Any]]:
    """
    Diagnose the machines that have no verdict yet, and return a row for each one.

    machines : from `machines_of`
    out : folder for the verdicts; those found there are used again
    options : of the diagnoses
    workers : who diagnose
    done : called with the number of machines that are done

    Raises UserError: something cannot be read or written.
    """
    rows: dict[str, dict[str, Any]] = {}
    wanted: list[tuple[FleetMachine, str]] = []
    for machine in machines:
        key = _key(machine, options)
        verdict = _kept(out / MACHINES / machine.name, key)
        if verdict is None:
            wanted.append((machine, key))
        else:
            rows[machine.name] = row_of(machine, verdict)
    done(len(rows))
    tasks = ((_files(machine, options), [f'recordings/{path.name}' for path in machine.recordings],
              options) for machine, _ in wanted)
    for number, result in workers.each(diagnosed, tasks):
        machine, key = wanted[number]
        try:
            found = result()
        except TaskLost as error:
            found = {FAILURE: os.fsencode(str(error))}
        rows[machine.name] = _keep(out / MACHINES / machine.name, machine, key, found)
        done(len(rows))
    return [rows[machine.name] for machine in machines]


def diagnosed(files: Mapping[str, bytes], recordings: Sequence[str],
              options: FleetOptions) -> Files:
    """
    Diagnose one machine in a process of its own.

    files : recordings, sheets and configurations, by path
    recordings : which of them, or which folders of them, are the recordings
    options : of the diagnosis; a configuration that is among `files` is taken from there

    Returns the files VERDICT and PAGE, and CORRECTED if it is wanted; FAILURE alone if there is
    none.
    """
    with _work_folder() as folder:
        for path, content in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content)
        wanted = {VERDICT: '--json', PAGE: '--report'}
        if options.corrected:
            wanted[CORRECTED] = '--corrected'
        words = ['diagnose', *(str(folder / path) for path in recordings)]
        for config in options.config:
            shipped = folder / _shipped(config)
            words += ['--config', str(shipped) if shipped.exists() else config]
        if (folder / CONFIG).exists():
            words += ['--config', str(folder / CONFIG)]
        for path, option in wanted.items():
            words += [option, str(folder / path)]
        said = run_command([*words, '--jobs', str(options.threads), *options.diagnose],
                           options.limit_s, options.memory_MB)
        if not all((folder / path).exists() for path in wanted):
            return {FAILURE: os.fsencode(said.replace(f'{folder}/', ''))}
        return {path: (folder / path).read_bytes() for path in wanted}


@contextmanager
def _work_folder() -> Iterator[Path]:
    """
    Yield a folder that is gone at the end; remove those of processes that were killed.

    A process holds a lock on its folder for as long as it lives.
    """
    for old in Path(tempfile.gettempdir()).glob(f'{_WORK}*'):
        try:
            with (old / _LOCK).open() as lock:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(old, ignore_errors=True)
        except OSError:  # in use, or not ours
            continue
    with tempfile.TemporaryDirectory(prefix=_WORK) as name:
        folder = Path(name)
        with (folder / _LOCK).open('w') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield folder


def row_of(machine: FleetMachine, verdict: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the table says of a machine, from its verdict."""
    first = verdict['which'][0] if verdict['which'] else {'effects': [], 'probability': None}
    explained = verdict['how_far']['explained_fraction']
    return {'machine': machine.name,
            'recordings': [path.name for path in machine.recordings],
            'verdict': verdict['verdict'],
            'sentence': verdict.get('sentence', ''),
            'effects': first['effects'],
            'probability': first['probability'],
            'explained': explained['value'],
            'explained_ci95': explained.get('ci95') if explained['value'] is not None else None,
            'confusable': verdict['confusable'],
            'notes': verdict['notes'],
            'seconds': verdict['seconds'],
            'page': f'{MACHINES}/{machine.name}/{PAGE}',
            'failure': None}


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return how many machines have each verdict, and for each effect how many name it."""
    return {'machines': len(rows),
            'failed': sum(row['failure'] is not None for row in rows),
            'verdicts': dict(Counter(row['verdict'] for row in rows
                                     if row['failure'] is None).most_common()),
            'effects': dict(Counter(
                effect for row in rows if row['verdict'] in ('explained', 'partly_explained')
                for effect in row['effects']).most_common())}


def share(row: Mapping[str, Any]) -> str:
    """Return the share of the gap that is explained, as people read it."""
    if row['explained'] is None:
        return ''
    # an effect may make the gap wider on withheld data
    return 'nothing' if row['explained'] < 0.0 else f'{100.0 * row["explained"]:.0f} %'


def text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the table of the fleet for a terminal."""
    width = max(len('machine'), *(len(row['machine']) for row in rows))
    lines = [f'{"machine":{width}}  {"verdict":18}{"explains":>9}  effect']
    for row in rows:
        if row['failure'] is not None:
            lines.append(f'{row["machine"]:{width}}  {"failed":18}{"":>9}  {row["failure"]}')
            continue
        lines.append(f'{row["machine"]:{width}}  {row["verdict"]:18}{share(row):>9}  '
                     + (' + '.join(row['effects']) + f' ({100.0 * row["probability"]:.0f} %)'
                        if row['effects'] else ''))
        lines += [f'{"":{width}}  {row["sentence"]}'] if row['sentence'] else []
    found = summary(rows)
    lines.append('')
    lines.append(f'{found["machines"]} machines: ' + ', '.join(
        [f'{count} {word}' for word, count in found['verdicts'].items()]
        + ([f'{found["failed"]} failed'] if found['failed'] else [])))
    if found['effects']:
        lines.append('named: ' + ', '.join(f'{effect} ({count})'
                                           for effect, count in found['effects'].items()))
    return '\n'.join(lines)


def _files(machine: FleetMachine, options: FleetOptions) -> Files:
    """Return everything that a diagnosis reads, by the path under which it finds it."""
    files: Files = {}
    try:
        for path in machine.recordings:
            parts = path.rglob('*') if path.is_dir() else (
                path, path.with_suffix('.yaml'), path.with_suffix('.meta.json'))
            files |= {str(Path('recordings', part.relative_to(path.parent))): part.read_bytes()
                      for part in parts if part.is_file()}
        for config in options.config:
            if Path(config).is_file():
                files[_shipped(config)] = Path(config).read_bytes()
        if machine.config is not None:
            files[CONFIG] = machine.config.read_bytes()
    except OSError as error:
        raise UserError(f'{error.filename}: cannot be read, {error.strerror}') from error
    return files


def _shipped(config: str) -> str:
    """Return where a configuration file lies for a diagnosis."""
    return f'config/{hashlib.sha256(os.fsencode(config)).hexdigest()[:8]}/{Path(config).name}'


def _key(machine: FleetMachine, options: FleetOptions) -> str:
    """Return a digest of all that a verdict depends on."""
    digest = hashlib.sha256(repr((fingerprint(), options.config, options.diagnose,
                                  options.corrected)).encode())
    for path, content in sorted(_files(machine, options).items()):
        digest.update(os.fsencode(f'{path} {len(content)} '))
        digest.update(content)
    return digest.hexdigest()


def _kept(folder: Path, key: str) -> dict[str, Any] | None:
    try:
        verdict = json.loads((folder / VERDICT).read_bytes())
    except (OSError, ValueError):
        return None
    return verdict if isinstance(verdict, dict) and verdict.get(MADE_FROM) == key else None


def _keep(folder: Path, machine: FleetMachine, key: str, found: Files) -> dict[str, Any]:
    """Write what a diagnosis gave, each file whole and the verdict last; return the row."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if FAILURE in found:
            for name in (VERDICT, PAGE, CORRECTED):
                (folder / name).unlink(missing_ok=True)
            _write(folder / FAILURE, found[FAILURE])
            return _failed(machine, os.fsdecode(found[FAILURE]))
        verdict = {**json.loads(found.pop(VERDICT)), MADE_FROM: key}
        for name, content in found.items():
            _write(folder / name, content)
        (folder / FAILURE).unlink(missing_ok=True)
        _write(folder / VERDICT,
               (json.dumps(verdict, indent=2, ensure_ascii=False) + '\n').encode(
                   errors='backslashreplace'))
    except OSError as error:
        raise UserError(f'{folder}: cannot be written, {error.strerror}') from error
    return row_of(machine, verdict)


def _failed(machine: FleetMachine, said: str) -> dict[str, Any]:
    lines = said.strip().splitlines() or ['nothing said']
    nothing: dict[str, Any] = {
        'verdict': None, 'which': [], 'how_far': {'explained_fraction': {'value': None}},
        'confusable': [], 'notes': [], 'seconds': None}
    return {**row_of(machine, nothing), 'page': None,
            'failure': one_line(lines[-1].removeprefix('antenna-drive diagnose: '), 200)}


def _write(path: Path, content: bytes) -> None:
    with drafted(path) as stream:
        stream.write(content)
