# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Simulation at equal accuracy: the emulator's schemes, the peers, and the loop in C.

Accuracy is the rms distance of the worst sensor signal from the converged run (`FINE_STEP`), as
a share of that signal's rms, at 200 Hz. Two runs are equally accurate when both reach the
same level; each side then uses the fastest of its settings that does.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, partial
import signal
import threading
import time
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator import batch
from antenna_drive.emulator.run import Emulator, FINE_STEP, MACRO_STEP
from antenna_drive.physics.arrays import FloatArray
from lab.bench import c_loop, measuring, peers
from lab.bench.equations import SIGNALS
from lab.bench.peers import GRID_S, Problem, Setting
import numpy as np
from scipy.interpolate import CubicHermiteSpline
from simgap.errors import UserError

EXPERIMENTS = ('T1', 'T3a', 'T4a')
# Greatest error of what counts as equally accurate; the first that a peer reaches is used.
LEVELS = (1e-3, 1e-2, 1e-1)
# A setting that takes longer than this is given up [s].
PATIENCE_S = 30.0
# This many runs of a few milliseconds are timed together as one.
_IN_A_ROW = 5
# A setting is tried until it has taken this long [s], or so often.
_LEAST_S = 0.3
_TRIES = 50

Run = Callable[[], FloatArray]

PEERS: dict[str, tuple[Callable[[Problem, Setting], FloatArray], tuple[Setting, ...]]] = {
    'solve_ivp': (peers.solve_ivp, tuple(
        Setting(method, tolerance) for method, tolerances in (
            ('LSODA', (1e-2, 1e-3, 3e-4, 1e-4, 1e-5)),
            ('Radau', (1e-3, 1e-4)),
            ('RK45', (1e-4, 1e-5))) for tolerance in tolerances)),
    'python_control': (peers.python_control, tuple(
        Setting(method, tolerance, threshold) for method in ('LSODA', 'RK45')
        for threshold in (1e-2, 1e-3) for tolerance in (1e-3, 1e-5))),
    'pathsim': (peers.pathsim, tuple(
        Setting(method, tolerance) for method in ('RKBS32', 'RKCK54')
        for tolerance in (1e-2, 1e-3, 1e-4))),
    'drake': (peers.drake, tuple(
        Setting(method, tolerance)
        for method in ('runge_kutta3', 'bogacki_shampine3', 'runge_kutta5')
        for tolerance in (1e-2, 1e-3))),
}
# For each peer the settings that usually win, for a quick look.
QUICK_PEERS = {
    'solve_ivp': (peers.solve_ivp, (Setting('LSODA', 1e-3), Setting('LSODA', 1e-4))),
    'python_control': (peers.python_control, (
        Setting('LSODA', 1e-3, 1e-2), Setting('LSODA', 1e-5, 1e-2))),
    'pathsim': (peers.pathsim, (Setting('RKBS32', 1e-3),)),
    'drake': (peers.drake, (Setting('runge_kutta3', 1e-2), Setting('runge_kutta3', 1e-3))),
}
QUICK_DURATIONS = {'T1': 6.3, 'T3a': 7.5, 'T4a': 4.0}


@dataclass(frozen=True)
class Candidate:
    """A setting of one side: what it is called, what runs it, and what it gave when tried."""

    name: str
    run: Run
    error: float
    wall_s: float

    def plain(self) -> dict[str, Any]:
        """Return all but the function."""
        return {'setting': self.name, 'error': self.error, 'wall_s': self.wall_s}


def measure(repetitions: int, quick: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """
    Measure every experiment against every peer that is installed.

    Return speedup by peer and ratio_to_c, each of the experiment where it is least; by experiment
    the settings tried, those chosen and their figures; what was left out and why.
    """
    found: dict[str, Any] = {}
    left_out: dict[str, str] = {}
    for name in EXPERIMENTS:
        experiment = experiments()[name]
        if quick:
            experiment = replace(experiment, duration=QUICK_DURATIONS[name])
        found[name] = _one(Problem(experiment), repetitions, quick, progress, left_out)
    speedups = {peer: least for peer in PEERS if (least := _least(
        {name: item['equal_accuracy'][peer]['speedup'] for name, item in found.items()
         if peer in item['equal_accuracy']}))}
    result: dict[str, Any] = {'speedup': speedups, 'experiments': found, 'left_out': left_out}
    least = _least({name: item['ratio_to_c'] for name, item in found.items()
                    if 'ratio_to_c' in item})
    if least:
        result['ratio_to_c'] = least
    return result


def _least(figures: dict[str, Any]) -> dict[str, Any] | None:
    if not figures:
        return None
    name = min(figures, key=lambda key: figures[key]['median'])
    return {**figures[name], 'experiment': name}


def _one(problem: Problem, repetitions: int, quick: bool, progress: Callable[[str], None],
         left_out: dict[str, str]) -> dict[str, Any]:
    name = problem.experiment.name
    progress(f'{name}: converged run')
    reference = run_lockstep(problem, FINE_STEP)
    run_whole(problem, 2.0 * GRID_S)  # compiles
    own = [_tried(f'{scheme.__name__.removeprefix("run_")} at {step_s * 1e3:g} ms',
                  partial(scheme, problem, step_s), reference)
           for scheme, step_s in _OWN]
    result: dict[str, Any] = {
        'duration_s': problem.experiment.duration, 'reference_step_s': FINE_STEP,
        'own': [candidate.plain() for candidate in own], 'peers': {}, 'equal_accuracy': {}}
    chosen: dict[str, tuple[float, Candidate, Candidate]] = {}
    for peer, (function, settings) in (QUICK_PEERS if quick else PEERS).items():
        tried: list[Candidate] = []
        for setting in settings:
            progress(f'{name}: {peer}, {setting}')
            try:
                with _patience():
                    if setting is settings[0]:
                        function(problem, setting)  # imports
                    tried.append(_tried(str(setting), partial(function, problem, setting),
                                        reference))
            except ModuleNotFoundError as error:
                left_out[peer] = f'{error.name} is not installed'
                break
            except (TimeoutError, RuntimeError, ValueError, ArithmeticError) as error:
                tried.append(Candidate(f'{setting}: {error}', _nothing, np.nan, np.nan))
        result['peers'][peer] = [candidate.plain() for candidate in tried]
        for level in LEVELS:
            fit, ours = _fastest(tried, level), _fastest(own, level)
            if fit and ours:
                chosen[peer] = level, fit, ours
                break
    progress(f'{name}: in turn')
    _time_in_turn(chosen, repetitions, result)
    try:
        result['ratio_to_c'] = ratio_to_c(problem, repetitions)
    except UserError as error:
        left_out['c'] = str(error)
    return result


def _nothing() -> FloatArray:
    return np.zeros((0, len(SIGNALS)))


def _fastest(tried: list[Candidate], level: float) -> Candidate | None:
    good = [candidate for candidate in tried if candidate.error <= level]
    return min(good, key=lambda candidate: candidate.wall_s, default=None)


def _time_in_turn(chosen: dict[str, tuple[float, Candidate, Candidate]], repetitions: int,
                  result: dict[str, Any]) -> None:
    # the same scheme of ours may face several peers; it is timed anew for each of them
    work: dict[str, Callable[[], object]] = {}
    for peer, (_, theirs, ours) in chosen.items():
        work[f'{peer} own'] = _in_a_row(ours.run)
        work[peer] = theirs.run
    times = measuring.in_turn(work, repetitions) if work else {}
    for peer, (level, theirs, ours) in chosen.items():
        own_s = [value / _IN_A_ROW for value in times[f'{peer} own']]
        result['equal_accuracy'][peer] = {
            'level': level, 'peer': theirs.plain(), 'own': ours.plain(),
            'peer_s': measuring.figure(times[peer], 's'), 'own_s': measuring.figure(own_s, 's'),
            'speedup': measuring.ratio(times[peer], own_s)}


def _in_a_row(run: Run) -> Callable[[], None]:
    def several() -> None:
        for _ in range(_IN_A_ROW):
            run()

    return several


def ratio_to_c(problem: Problem, repetitions: int) -> dict[str, Any]:
    """
    Return the rate of the emulator's lock-step loop over that of the same loop in C.

    Both make every macro-step of 1 ms and keep the samples of every fifth. They give the same
    bits, which is checked first (AssertionError). Raise UserError where there is no C compiler.
    """
    duration, every = problem.experiment.duration, round(GRID_S / MACRO_STEP)
    emulator = Emulator(problem.drive)
    with c_loop.compiled() as library:
        in_c = c_loop.CDrive(library, problem.drive).prepared(duration, MACRO_STEP, every)
        own = emulator.run(duration, every=every).samples
        assert own.tobytes() == in_c().tobytes(), 'the loop in C does something else'
        times = measuring.in_turn({
            'own': _in_a_row(lambda: emulator.run(duration, every=every).samples),
            'c': _in_a_row(in_c)}, max(repetitions, 9))
    return measuring.ratio(times['c'], times['own']) | {
        'own_us_per_step': 1e6 * float(np.median(times['own'])) / _IN_A_ROW * MACRO_STEP
        / duration}


def run_lockstep(problem: Problem, step_s: float) -> FloatArray:
    """Run the units in lock-step as the nodes do; return the signals on the grid."""
    run = Emulator(problem.drive, step_s).run(
        problem.experiment.duration, every=round(GRID_S / step_s))
    return np.column_stack([run[name] for name in SIGNALS])


def run_whole(problem: Problem, step_s: float) -> FloatArray:
    """
    Run the whole drive as one system, as the diagnosis does; return the signals on the grid.

    Between steps longer than the grid's the signals are cubics of their values and derivatives:
    the peers too step over the grid where they can, and interpolate.
    """
    samples = batch.run(problem.record, plan(problem, step_s))
    if step_s <= GRID_S:
        return samples[:, :, 0]
    cubics = CubicHermiteSpline(_knots(problem, step_s), samples[:, :, 0], samples[:, :, 1])
    return np.asarray(cubics(problem.grid), np.float64)


@lru_cache(maxsize=16)
def _knots(problem: Problem, step_s: float) -> FloatArray:
    """Return the times of the grid, every other if the steps are longer, and of every corner."""
    grid = problem.grid[::max(1, round(step_s / GRID_S))]
    knots = np.union1d([*grid, problem.grid[-1]], [piece[0] for piece in problem.pieces])
    return knots[np.r_[True, np.diff(knots) > 1e-9]]


@lru_cache(maxsize=16)
def plan(problem: Problem, step_s: float) -> batch.Schedule:
    """Return the steps of `run_whole`, each of at most `step_s` [s]; made once for a test."""
    start, _, value, slope = (np.array(column) for column in zip(*problem.pieces, strict=True))
    knots = _knots(problem, step_s)
    parts = max(1, round(GRID_S / step_s))
    steps = np.zeros(((knots.size - 1) * parts, batch.COLUMNS))
    steps[:, batch.LENGTH] = np.repeat(np.diff(knots) / parts, parts)
    begins = np.r_[0.0, np.cumsum(steps[:, batch.LENGTH])[:-1]]
    piece = np.searchsorted(start, begins + 1e-9, side='right') - 1
    steps[:, batch.COMMAND] = value[piece] + slope[piece] * (begins - start[piece])
    steps[:, batch.SLOPE] = slope[piece]
    steps[:, batch.FIXED_BIAS] = problem.drive.torque_share.circuit.fixed_voltage
    if step_s > GRID_S:
        return batch.Schedule(steps, np.arange(knots.size))
    keep = np.full(steps.shape[0] + 1, -1)
    place = np.searchsorted(knots, problem.grid - 1e-9)
    keep[place * parts] = np.arange(problem.grid.size)
    return batch.Schedule(steps, keep)


def distance(signals: FloatArray, reference: FloatArray) -> float:
    """Return the rms distance of the worst signal as a share of its rms; shapes (n, signals)."""
    size = np.sqrt(np.mean(reference ** 2, axis=0))
    away = np.sqrt(np.mean((signals - reference) ** 2, axis=0))
    return float(np.max(np.divide(away, size, out=away, where=size > 0.0)))


# With twice the longest step the fastest states are no longer stable.
_OWN: tuple[tuple[Callable[[Problem, float], FloatArray], float], ...] = (
    (run_whole, 1e-2), (run_whole, 5e-3), (run_whole, 2.5e-3), (run_whole, 1e-3),
    (run_lockstep, 5e-3), (run_lockstep, 2.5e-3), (run_lockstep, 1e-3))


def _tried(name: str, run: Run, reference: FloatArray) -> Candidate:
    times: list[float] = []
    # the quick ones several times: one that was interrupted would not be chosen
    while not times or (sum(times) < _LEAST_S and len(times) < _TRIES):
        began = time.perf_counter()
        signals = run()
        times.append(time.perf_counter() - began)
    return Candidate(name, run, distance(signals, reference), min(times))


@contextmanager
def _patience() -> Iterator[None]:
    """Raise TimeoutError out of whatever takes too long, where there are signals for that."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def over(number: int, frame: object) -> None:
        raise TimeoutError(f'given up after {PATIENCE_S:g} s')

    before = signal.signal(signal.SIGALRM, over)
    signal.setitimer(signal.ITIMER_REAL, PATIENCE_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
