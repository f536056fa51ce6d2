# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark runs, and its result is complete; how fast anything is, no test says."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
import json
import multiprocessing
from pathlib import Path
import shutil
import time

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import simulate
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep.pace import LEAD_S
from lab.bench import batches, c_loop, measuring, peers, simulation, stolen, suite, transport
from lab.bench.batches import Task
from lab.bench.peers import Setting
from lab.bench.stamps import WARM_STEPS
from lab.cli import main
import numpy as np
import pytest
from simgap.command.programs import BAD_INPUT


def test_work_is_done_in_turn() -> None:
    done: list[str] = []
    times = measuring.in_turn({'a': lambda: done.append('a'), 'b': lambda: done.append('b')}, 3)
    assert done == ['a', 'b'] * 4
    assert [len(values) for values in times.values()] == [3, 3]


def test_ratio_pairs_values_of_one_turn() -> None:
    found = measuring.ratio([2.0, 9.0, 4.0], [1.0, 3.0, 4.0])
    assert (found['median'], found['min'], found['max']) == (2.0, 1.0, 3.0)
    assert found['values'] == [2.0, 3.0, 1.0]


@pytest.mark.trial
def test_simulation_is_complete(monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
                                capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(simulation, 'EXPERIMENTS', ('T4a',))
    monkeypatch.setattr(simulation, 'QUICK_DURATIONS', {'T4a': 0.2})
    monkeypatch.setattr(simulation, 'QUICK_PEERS', {
        'solve_ivp': (peers.solve_ivp, (Setting('LSODA', 1e-5),))})
    target = tmp_path / 'bench.json'
    assert main(['bench', '--quick', '--only', 'simulation', '--repetitions', '2',
                 '--json', str(target)]) == 0
    result = json.loads(target.read_text())
    figures = dict(suite.figures(result))
    wanted = {'simulation.speedup.solve_ivp'}
    if shutil.which(c_loop.COMPILER):
        wanted.add('simulation.ratio_to_c')
    assert wanted <= set(figures)
    for item in figures.values():
        assert 0.0 < item['min'] <= item['median'] <= item['max']
        assert item['median'] == pytest.approx(np.median(item['values']))
    against = result['simulation']['experiments']['T4a']['equal_accuracy']['solve_ivp']
    assert max(against['own']['error'], against['peer']['error']) <= against['level']
    assert result['machine']['cores'] and result['machine']['versions']['numpy']
    assert 'simulation.speedup.solve_ivp' in capsys.readouterr().out


def test_wrong_repetitions_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['bench', '--repetitions', '0']) == BAD_INPUT
    assert '--repetitions' in capsys.readouterr().err


def test_batch_does_not_depend_on_the_executor() -> None:
    work = batches.tasks(12, 0.4)
    with ThreadPoolExecutor(2) as threads:
        found = batches.run(work, threads)
    assert found.shape[0] == 12
    unit_scale = Task([[1.0] * 4], 0.4)
    values = simulate(experiments()['T3a'].drive(), 0.4, every=4).samples[:, :, 0]
    np.testing.assert_allclose(batches.statistics(unit_scale)[0], np.column_stack((
        values.min(axis=0), values.max(axis=0), values.mean(axis=0),
        np.sqrt(np.mean(values ** 2, axis=0)))), rtol=1e-9, atol=1e-12)
    assert np.unique(found[:, 2, 1]).size == 12  # no variant is another's
    with ProcessPoolExecutor(1, multiprocessing.get_context('spawn')) as processes:
        assert np.array_equal(batches.run(work, processes), found)


@pytest.mark.slow
def test_batch_through_dask() -> None:
    distributed = pytest.importorskip('distributed', reason='see the bench extra')
    work = batches.tasks(12, 0.4)
    with distributed.Client(n_workers=1, threads_per_worker=1, dashboard_address=None,
                            processes=False) as client, ThreadPoolExecutor(1) as thread:
        assert np.array_equal(batches.run(work, client.get_executor()),
                              batches.run(work, thread))


@pytest.mark.slow
@pytest.mark.parametrize('exchange', [
    transport.own, partial(transport.own, pace=1.0), transport.bare,
    partial(transport.bare, kind='compiled')])
def test_five_processes_note_every_step(exchange: transport.Run, fresh_domain: int) -> None:
    pytest.importorskip('rclpy', reason='there is no ROS 2')
    last = WARM_STEPS + 200
    run = exchange(last)
    assert set(run.nodes) == set(UNITS)
    for unit, node in run.nodes.items():
        assert node.times.shape == (last + 1,)
        assert np.all(np.diff(node.times) > 0.0)
        assert run.cpu_per_step(unit) > 0.0
    assert np.all(run.latencies > 0.0)  # nobody makes a step before the conductor's is there
    if run.pace:
        # step k is never made before it may be
        assert np.all(run.delays > -LEAD_S - 1e-6)
    assert run.began_s > 0.0


def test_steal_is_a_share_of_the_time_of_all_cores(
        monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    # user nice system idle iowait irq softirq steal guest guest_nice
    lines = iter(['cpu 10 0 10 80 0 0 0 0 0 0', 'cpu 60 0 20 180 0 0 0 40 0 0'])
    monkeypatch.setattr(time, 'monotonic', lambda: now[0])
    monkeypatch.setattr(Path, 'read_text', lambda path: next(lines) + '\ncpu0 1 2 3')
    steal = stolen.Steal()
    assert np.isnan(steal.share(100.0, 101.0)), 'nothing was noted'
    steal.note()
    now[0] = 100.5
    steal.note()
    now[0] = 102.0
    steal.note()
    assert steal.share(100.0, 102.0) == pytest.approx(40 / 200)


@pytest.mark.parametrize(('value', 'goal'), [(0.9, 'reached'), (0.7, 'not reached')])
def test_table_tells_whether_a_goal_is_reached(value: float, goal: str) -> None:
    text = suite.table({'transport': {'ratio_to_bare': measuring.figure([value]),
                                      'left_out': {'thing': 'it is not here'}}})
    assert text.splitlines()[1].endswith(f'at least 0.8, {goal}')
    assert 'transport: thing left out, it is not here' in text
