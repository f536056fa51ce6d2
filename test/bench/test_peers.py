# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The peers solve the same problem as the emulator, and the loop in C is the same loop."""

from __future__ import annotations

from dataclasses import replace
import shutil

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import FINE_STEP, simulate
from lab.bench import c_loop, equations, peers
from lab.bench.peers import Problem, Setting
from lab.bench.simulation import distance, plan, run_lockstep, run_whole
import numpy as np
import pytest


@pytest.fixture(scope='module', params=['T1', 'T3a', 'T4a'])
def problem(request: pytest.FixtureRequest) -> Problem:
    """Return two seconds of an experiment: teeth meet, rotors stop, the bias settles."""
    return Problem(replace(experiments()[request.param], duration=2.0))


# Installed as: module to import, function, setting, greatest distance from the converged run
PEERS = {
    'solve_ivp, LSODA': ('scipy', peers.solve_ivp, Setting('LSODA', 1e-5), 1e-3),
    'solve_ivp, Radau': ('scipy', peers.solve_ivp, Setting('Radau', 1e-5), 1e-2),
    'python-control': ('control', peers.python_control, Setting('LSODA', 1e-5, 1e-2), 5e-2),
    'PathSim': ('pathsim', peers.pathsim, Setting('RKBS32', 1e-3), 2e-3),
    'Drake': ('pydrake', peers.drake, Setting('runge_kutta3', 1e-3), 1e-3),
}


@pytest.mark.slow
@pytest.mark.parametrize('name', PEERS)
def test_peer_agrees_with_the_converged_run(name: str, problem: Problem) -> None:
    module, run, setting, bound = PEERS[name]
    pytest.importorskip(module, reason=f'{module} is not installed, see the bench extra')
    assert distance(run(problem, setting), run_lockstep(problem, FINE_STEP)) <= bound


@pytest.mark.slow
def test_both_schemes_of_the_emulator_agree(problem: Problem) -> None:
    assert distance(run_whole(problem, 1e-3), run_lockstep(problem, FINE_STEP)) <= 1e-3


@pytest.mark.slow
def test_plan_follows_the_command(problem: Problem) -> None:
    steps = plan(problem, 2.5e-3).steps
    ends = np.cumsum(steps[:, 0])
    assert ends[-1] == pytest.approx(problem.experiment.duration)
    commanded = simulate(problem.drive, 2.0)['test_signal/rate_command']
    middle = ends - 0.5 * steps[:, 0]
    planned = steps[:, 1] + 0.5 * steps[:, 0] * steps[:, 2]
    at_samples = np.interp(middle, np.arange(commanded.size) * 1e-3, commanded)
    assert np.abs(planned - at_samples).max() <= 1e-9


@pytest.mark.slow
def test_python_and_compiled_equations_are_the_same() -> None:
    plain = Problem(experiments()['T3a'], compile_equations=False)
    compiled = Problem(experiments()['T3a'])
    random = np.random.default_rng(5)
    for _ in range(200):
        x = random.normal(0.0, 1.0, equations.STATES)
        x[equations.HUB_ANGLE:] *= 1e-4
        slip = random.integers(-1, 3, equations.BODIES)
        one, other = np.zeros_like(x), np.zeros_like(x)
        plain.rates(x, 0.01, slip, 1e-3, plain.p, one)
        compiled.rates(x, 0.01, slip, 1e-3, compiled.p, other)
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


@pytest.mark.skipif(shutil.which(c_loop.COMPILER) is None, reason='there is no C compiler')
@pytest.mark.parametrize('name', ['T1', 'T2', 'T3a', 'T3b', 'T4a', 'T4e'])
@pytest.mark.parametrize('step_s', [5e-4, 1e-3, 4e-3])
@pytest.mark.slow
def test_loop_in_c_gives_the_same_bits(name: str, step_s: float) -> None:
    drive = experiments()[name].drive()
    with c_loop.compiled() as library:
        in_c = c_loop.CDrive(library, drive).prepared(4.0, step_s, 1)()
    assert in_c.tobytes() == simulate(drive, 4.0, step_s).samples.tobytes()


def test_distance_is_that_of_the_worst_signal() -> None:
    reference = np.column_stack((np.full(4, 2.0), [1.0, -1.0, 1.0, -1.0], np.zeros(4)))
    signals = reference + np.array([0.02, 0.05, 0.0])
    assert distance(signals, reference) == pytest.approx(0.05)
