# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A cluster of four workers: nothing lost when two are killed, and the memory bounded."""

from __future__ import annotations

from collections.abc import Iterator
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import threading

from antenna_drive.cli import main
from antenna_drive.workers import TaskLost, workers
from antenna_drive.workers.cluster import cluster as connected, fingerprint
from lab.trials import batch
import pytest
from simgap.errors import UserError
import worker_tasks

pytest.importorskip('distributed', reason="needs the extra 'cluster'")
from cluster import Cluster, cluster, wait_for  # noqa: E402, I100

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def four(tmp_path: Path) -> Iterator[Cluster]:
    with cluster(tmp_path, 4) as found:
        yield found


@pytest.fixture(scope='module')
def steady(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """Return a cluster whose workers no test kills."""
    with cluster(tmp_path_factory.mktemp('cluster'), 2) as found:
        yield found


def test_two_of_four_killed(four: Cluster, tmp_path: Path) -> None:
    """Each of the two tasks that died with their workers is repeated once, and no other."""
    os.mkfifo(tmp_path / 'nothing')

    def kill() -> None:
        for victim in range(2):
            four.kill(int(wait_for(tmp_path / f'waiting-{victim}')))

    killer = threading.Thread(target=kill)
    killer.start()
    came = []
    with workers(1, four.address) as pool:
        for number, result in pool.each(worker_tasks.told, (
                (str(tmp_path), k, 2) for k in range(40))):
            assert result() == number * number
            came.append(number)
    killer.join()
    assert sorted(came) == list(range(40))
    assert four.alive() == 2
    # results come as they are there, not in the order of the tasks
    assert came.index(0) > 0
    begun = [len((tmp_path / f'task-{k}').read_text().splitlines()) for k in range(40)]
    assert begun == [2, 2] + 38 * [1]


def test_memory_of_a_worker_does_not_grow_with_the_tasks(steady: Cluster) -> None:
    """0.8 GB of results pass through two workers, none of which ever holds much of it."""
    peaks: dict[int, list[float]] = {}
    size = 0
    with workers(1, steady.address) as pool:
        for _, result in pool.each(worker_tasks.large, ((10,) for _ in range(80))):
            content, pid, peak = result()
            size += len(content)
            peaks.setdefault(pid, []).append(peak)
    assert size == 80 * 10 * 2**20
    # room for the result in work, the next one, and two on their way as bytes
    assert all(max(values) - min(values) < 100.0 for values in peaks.values())


def test_errors_are_those_of_the_task(steady: Cluster) -> None:
    with workers(1, steady.address) as pool:
        for number, result in pool.each(worker_tasks.fail, [(0,), (1,)]):
            with pytest.raises(ValueError, match=f'task {number}'):
                result()


def test_a_task_that_kills_every_worker(four: Cluster) -> None:
    """It is given up after as many as dask allows, and told in one line."""
    with workers(1, four.address) as pool:
        for _, result in pool.each(worker_tasks.end_worker, [(1,)]):
            with pytest.raises(TaskLost, match='every worker that was given a task ended'):
                result()


@pytest.mark.trial
def test_trial_with_two_workers_killed(four: Cluster, tmp_path: Path) -> None:
    """The recordings are those that one machine makes from the same truths, byte for byte."""
    here, there = tmp_path / 'here', tmp_path / 'there'
    manifest = batch.prepare(here, 10, 3, 0.02, 50.0, batch.DURATION_S)
    shutil.copytree(here, there)
    batch.make_cases(here, manifest, jobs=1)
    process = subprocess.Popen(
        [sys.executable, '-m', 'lab', 'trial', '--cases', '10', '--seed', '3',
         '--sample-rate', '50', '--out', str(there), '--scheduler', four.address],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        wait_for(there / 'case_0001' / 'rec_a.csv')
        for worker in four.workers[:2]:
            four.kill(worker.pid)
        _, error = process.communicate(timeout=240)
    finally:
        process.kill()
    assert (process.returncode, error) == (0, b'')
    assert not list(there.glob('.case*'))
    made = sorted(path.relative_to(there) for path in there.glob('case_*/*'))
    assert len(made) == 60
    for name in made:
        assert (here / name).read_bytes() == (there / name).read_bytes()


@pytest.mark.parametrize(('who', 'said'), [
    ('workers', 'no worker for 3 s'), ('scheduler', 'the scheduler is gone')])
def test_a_cluster_that_goes_away(who: str, said: str, tmp_path: Path,
                                  monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends the batch in one line; nobody waits for ever."""
    monkeypatch.setattr('antenna_drive.workers.cluster.PATIENCE_S', 3.0)
    os.mkfifo(tmp_path / 'nothing')

    def kill() -> None:
        pid = int(wait_for(tmp_path / 'waiting-0'))
        if who == 'workers':
            found.kill(pid)
        else:
            found.scheduler.kill()

    with cluster(tmp_path, 1) as found:
        killer = threading.Thread(target=kill)
        killer.start()
        with pytest.raises(TaskLost, match=said):
            with workers(1, found.address) as pool:
                for _, result in pool.each(worker_tasks.told, [(str(tmp_path), 0, 1)]):
                    result()
        killer.join()


def test_a_fleet_is_sent_to_the_workers(steady: Cluster, tmp_path: Path,
                                        capsys: pytest.CaptureFixture[str]) -> None:
    """They have no disk in common with us as far as they know, and say what is wrong."""
    for name in ('north', 'south'):
        (tmp_path / 'fleet' / name).mkdir(parents=True)
        (tmp_path / 'fleet' / name / 'rec_a.csv').write_text(f'time_s,{name}\n0,1\n')
    assert main(['diagnose-many', str(tmp_path / 'fleet'), '--scheduler', steady.address,
                 '--json', '-']) == 1
    rows = json.loads(capsys.readouterr().out)['rows']
    assert [row['machine'] for row in rows] == ['north', 'south']
    for row in rows:
        assert row['failure'].startswith('recordings/rec_a.csv: line 1, column 2: no such column')


# Takes the place of a diagnosis: notes that it was begun; the first two wait when first begun.
STAND_IN = """
import json, os, pathlib, sys
words = sys.argv[3:]
case = pathlib.Path(words[1]).parent.name
with open(f'{folder}/begun-{{case}}', 'a+') as stream:
    stream.write('x')
    stream.seek(0)
    first = len(stream.read()) == 1
if first and case in ('case_0001', 'case_0002'):
    pathlib.Path(f'{folder}/waiting-{{case}}').write_text(os.environ['SIMGAP_PARENT'])
    open(f'{folder}/nothing').read()
pathlib.Path(words[words.index('--json') + 1]).write_text(json.dumps({{'case': case}}))
"""


def test_diagnoses_of_a_trial_with_two_workers_killed(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was being diagnosed by the two is begun once more, and nothing else."""
    program, launcher = tmp_path / 'stand_in.py', tmp_path / 'launcher'
    program.write_text(STAND_IN.format(folder=tmp_path))
    launcher.write_text(f'#!/bin/sh\nexec {sys.executable} {program} "$@"\n')
    launcher.chmod(0o755)
    os.mkfifo(tmp_path / 'nothing')
    manifest = batch.prepare(tmp_path / 'trial', 12, 4, 0.02, 50.0, batch.DURATION_S)
    for name in manifest['seals']:
        (tmp_path / 'trial' / name).mkdir()

    with cluster(tmp_path, 4, launcher) as found:
        def kill() -> None:
            for case in ('case_0001', 'case_0002'):
                found.kill(int(wait_for(tmp_path / f'waiting-{case}')))

        killer = threading.Thread(target=kill)
        killer.start()
        told: list[tuple[int, int]] = []
        assert batch.diagnose_cases(
            tmp_path / 'trial', manifest, 1, done=lambda *count: told.append(count),
            scheduler=found.address) == 0
        killer.join()
        assert found.alive() == 2
        # let the diagnoses end whose workers were killed: a writer comes and goes, without waiting
        os.close(os.open(tmp_path / 'nothing', os.O_RDWR))
    assert told == [(k, 12) for k in range(13)]
    for name in manifest['seals']:
        verdict = json.loads((tmp_path / 'trial' / name / 'verdict.json').read_text())
        assert verdict == {'case': name}
        begun = (tmp_path / f'begun-{name}').read_text()
        assert begun == ('xx' if name in ('case_0001', 'case_0002') else 'x')


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scheduler that does not answer is one line, with its address."""
    monkeypatch.setattr('antenna_drive.workers.cluster.CONNECT_S', 1.0)
    with pytest.raises(UserError, match='--scheduler tcp://127.0.0.1:1: no scheduler answers'):
        with workers(1, 'tcp://127.0.0.1:1'):
            pass


def test_no_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('antenna_drive.workers.cluster.CONNECT_S', 3.0)
    with cluster(tmp_path, 0) as found:
        with pytest.raises(UserError, match=f'dask worker {found.address}'):
            with connected(found.address):
                pass


def test_other_sources_are_refused(steady: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker with another version would give other results without a word."""
    assert fingerprint() == fingerprint()
    monkeypatch.setattr('antenna_drive.workers.cluster.fingerprint', lambda: 'another')
    with workers(1, steady.address) as pool:
        for _, result in pool.each(worker_tasks.square, [(2,)]):
            with pytest.raises(UserError, match='has another antenna_drive'):
                result()
