# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The exchange between five processes: the drive's and the bare ones, in alternating runs."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any

from antenna_drive.emulator.wiring import MOTORS, TEST_SIGNAL, UNITS
from antenna_drive.lockstep.pace import LEAD_S
from antenna_drive.lockstep.processes import DriveProcesses, Parameter
from lab.bench import measuring
from lab.bench.stamps import read, Stamped, WARM_STEPS
from lab.bench.stolen import Steal
import numpy as np
from simgap.errors import UserError

STEP_S = 1e-3
# Time limits for the start of five processes and for a step [s].
_BEGIN_PATIENCE_S = 60.0
_STEP_PATIENCE_S = 0.05
# After this all nodes but the last one are there [s]; they take two to four seconds.
_OTHERS_READY_S = 8.0

# The type of `own` and `bare`.
Run = Callable[..., 'ExchangeRun']

_PERCENTILES = (50.0, 99.0, 99.9)
_RATIOS = (
    ('ratio_to_bare_compiled', 'own', 'bare_compiled'),
    ('ratio_to_bare_compiled_placed', 'own_placed', 'bare_compiled_placed'),
    ('ratio_to_bare_compiled_with_readings', 'readings', 'bare_compiled'),
    ('ratio_to_bare', 'own_placed', 'bare_placed'))


@dataclass(frozen=True)
class ExchangeRun:
    """The records of five processes in one run."""

    step_s: float               # macro-step
    pace: float                 # times real time, 0 for as fast as possible
    nodes: dict[str, Stamped]   # by unit
    began_s: float              # from the first start or a late one to the conductor's first step
    steal: Steal                # the machine's steal time during the run

    @property
    def rate(self) -> float:
        """Return the steps per second after the warm-up."""
        times = self.nodes[TEST_SIGNAL].times[WARM_STEPS:]
        return float((times.size - 1) / (times[-1] - times[0]))

    @property
    def intervals(self) -> Any:
        """Return the time from each step of the conductor to the next [s]."""
        return np.diff(self.nodes[TEST_SIGNAL].times[WARM_STEPS:])

    @property
    def latencies(self) -> Any:
        """Return the time from each step of the conductor until all others made their next [s]."""
        others = [node.times for unit, node in self.nodes.items() if unit != TEST_SIGNAL]
        done = np.max([times[WARM_STEPS + 1:] for times in others], axis=0)
        return done - self.nodes[TEST_SIGNAL].times[WARM_STEPS:-1]

    def cpu_per_step(self, unit: str) -> float:
        """Return the processor time of a node for one step [s]."""
        node = self.nodes[unit]
        return node.cpu_s / (node.times.size - 1 - WARM_STEPS)

    @property
    def cpu_per_step_of_all(self) -> float:
        """Return the processor time of all nodes together for one step [s]."""
        return sum(self.cpu_per_step(unit) for unit in self.nodes)

    @property
    def delays(self) -> Any:
        """Return the delay of each of the conductor's steps from step 1 on [s]."""
        conductor = self.nodes[TEST_SIGNAL]
        due = conductor.due_s + np.arange(conductor.times.size) * (self.step_s / self.pace)
        return (conductor.times - due)[1:]

    def late(self) -> Any:
        """Return for each step whether it was late by more than one step."""
        return self.delays > self.step_s / self.pace


def own(steps: int, step_s: float = STEP_S, pace: float = 0.0, publish_rate: float = 0.0,
        placed: bool | None = None) -> ExchangeRun:
    """Run the drive's five nodes for some steps; publish_rate is that of their readings [Hz]."""
    return _run('lab.bench.measured_node', steps, step_s, pace,
                _parameters(steps, step_s, pace, publish_rate), (), placed)


def bare(steps: int, kind: str = 'python', placed: bool | None = None) -> ExchangeRun:
    """Run the bare exchange for some steps, in Python or compiled."""
    return _run('lab.bench.bare_node', steps, STEP_S, 0.0,
                {TEST_SIGNAL: {'run.pace': 0.0}}, (kind,), placed)


def _parameters(steps: int, step_s: float, pace: float, publish_rate: float,
                ) -> dict[str, dict[str, Parameter]]:
    parameters: dict[str, dict[str, Parameter]] = {
        unit: {'publish_rate': publish_rate} for unit in UNITS}
    parameters[TEST_SIGNAL].update({
        'run.step': step_s, 'run.pace': pace, 'run.duration': steps * step_s})
    return parameters


def _run(module: str, steps: int, step_s: float, pace: float,
         parameters: dict[str, dict[str, Parameter]], more: tuple[str, ...],
         placed: bool | None = None, last_to_start: str = '') -> ExchangeRun:
    """Run five processes; `last_to_start` is started when the others have long been there."""
    with tempfile.TemporaryDirectory() as folder:
        files = {unit: Path(folder, f'{unit}.npz') for unit in UNITS}
        commands = {unit: (sys.executable, '-m', module, unit, str(path), str(steps), *more)
                    for unit, path in files.items()}
        patience = _BEGIN_PATIENCE_S + steps * max(
            _STEP_PATIENCE_S, 2.0 * step_s / pace if pace else 0.0)
        steal = Steal()
        # An own namespace keeps other drives on this machine apart.
        drive = DriveProcesses(parameters, commands=commands, placed=placed,
                               namespace=f'/bench_{os.getpid()}',
                               order=[unit for unit in UNITS if unit != last_to_start])
        began = time.monotonic()

        def wait_until(true: Callable[[], bool]) -> None:
            while not true():
                steal.note()
                drive.check()
                if time.monotonic() - began > patience:
                    raise UserError(f'{module}: {steps} steps take more than {patience:.0f} s')
                time.sleep(0.05)

        with drive as processes:
            if last_to_start:
                time.sleep(_OTHERS_READY_S)
                began = time.monotonic()
                processes.start(last_to_start)
            wait_until(lambda: all(path.exists() for path in files.values()))
        nodes = {unit: read(path) for unit, path in files.items()}
    return ExchangeRun(step_s, pace, nodes, float(nodes[TEST_SIGNAL].times[1] - began), steal)


def measure(repetitions: int, quick: bool, progress: Callable[[str], None],
            paced_s: float | None = None) -> dict[str, Any]:
    """
    Measure the exchange; raise ModuleNotFoundError where ROS 2 is not installed.

    `paced_s` is how long the drive runs at real-time pace with a macro-step of 1 ms, and a tenth
    of it with 0.5 ms; None for 600 s, 15 s if quick. Return real-time factors (rtf_...) with
    readings at 100 Hz; ratios to the bare exchange, without readings; rates, intervals between
    steps, processor time per step; first_step_s of the node that is started last; late_fraction of
    paced runs by tenths, and the machine's steal time. What ends in `_placed` has its processes
    placed for speed.
    """
    import rclpy  # noqa: F401  fail here and not in five processes

    steps = 1500 if quick else 5000
    result: dict[str, Any] = {'steps': steps, 'step_s': STEP_S}
    kinds = _kinds(steps)
    runs: dict[str, list[ExchangeRun]] = {name: [] for name in kinds}
    for turn in range(repetitions):
        for name, run in kinds.items():
            progress(f'as fast as possible, turn {turn + 1} of {repetitions}: {name}')
            runs[name].append(run())
    first = runs.pop('first')
    rates = {name: [run.rate for run in of_kind] for name, of_kind in runs.items()}
    result['steps_per_s'] = {name: measuring.figure(values, '1/s')
                             for name, values in rates.items()}
    for ratio, above, below in _RATIOS:
        result[ratio] = measuring.ratio(rates[above], rates[below])
    for factor, name, step_s in (
            ('rtf_1ms', 'readings', STEP_S), ('rtf_1ms_placed', 'readings_placed', STEP_S),
            ('rtf_1ms_busy', 'busy', STEP_S), ('rtf_05ms', 'half_step', STEP_S / 2.0)):
        result[factor] = measuring.figure([rate * step_s for rate in rates[name]])
    result['cpu_per_step_us'] = measuring.figure(
        [1e6 * run.cpu_per_step_of_all / len(UNITS) for run in runs['readings']], 'us')
    result['cpu_per_step_s'] = {name: _cpu(of_kind) for name, of_kind in runs.items()}
    result['step_s_as_fast_as_possible'] = {
        name: _percentiles([run.intervals for run in of_kind]) for name, of_kind in runs.items()}
    result['first_step_s'] = measuring.figure([run.began_s for run in first], 's')
    result['first_step_all_started_at_once_s'] = measuring.figure(
        [run.began_s for run in runs['own']], 's')
    duration = paced_s or (15.0 if quick else 600.0)
    for name, step_s, duration_s in (('late_fraction', STEP_S, duration),
                                     ('late_fraction_05ms', STEP_S / 2.0, duration / 10.0)):
        progress(f'{duration_s:g} s at real-time pace with steps of {1e3 * step_s:g} ms')
        result |= _paced(name, step_s, duration_s)
    return result


def _kinds(steps: int) -> dict[str, Callable[[], ExchangeRun]]:
    """Return what runs in turn, by name."""
    return {
        'own': partial(own, steps, placed=False),
        'bare_compiled': partial(bare, steps, 'compiled', placed=False),
        'readings': partial(own, steps, publish_rate=100.0, placed=False),
        'own_placed': partial(own, steps, placed=True),
        'bare_compiled_placed': partial(bare, steps, 'compiled', placed=True),
        'readings_placed': partial(own, steps, publish_rate=100.0, placed=True),
        'bare_placed': partial(bare, steps, placed=True),
        'half_step': partial(own, steps, STEP_S / 2.0, publish_rate=100.0, placed=False),
        'busy': partial(_beside_a_busy_process, steps),
        'first': _first_step}


def _first_step() -> ExchangeRun:
    """Start the node with the largest physics when all others wait for it."""
    steps = WARM_STEPS + 1
    return _run('lab.bench.measured_node', steps, STEP_S, 0.0,
                _parameters(steps, STEP_S, 0.0, 0.0), (), False, MOTORS[0])


def _beside_a_busy_process(steps: int) -> ExchangeRun:
    busy = subprocess.Popen([sys.executable, '-c', 'while True: pass'])
    try:
        return own(steps, publish_rate=100.0, placed=False)
    finally:
        busy.kill()
        busy.wait()


def _paced(name: str, step_s: float, duration_s: float) -> dict[str, Any]:
    """Return how a run at real-time pace kept its timetable, in tenths of its time."""
    run = own(max(round(duration_s / step_s), WARM_STEPS + 100), step_s, 1.0, publish_rate=100.0)
    late, delays = run.late(), run.delays
    times = run.nodes[TEST_SIGNAL].times[1:]
    tenths = np.array_split(np.arange(late.size), 10)
    return {
        name: measuring.figure([float(late[part].mean()) for part in tenths]) | {
            'total': float(late.mean()), 'late_steps': int(late.sum()), 'duration_s': duration_s,
            'latest_s': float(delays.max()),
            'steal': [run.steal.share(times[part[0]], times[part[-1]]) for part in tenths]},
        f'{name}_latency_s': _percentiles([run.latencies]),
        # after the moment from which a step may be made
        f'{name}_delay_s': _percentiles([delays + LEAD_S])}


def _percentiles(runs: list[Any]) -> dict[str, Any]:
    return {f'p{percent:g}': measuring.figure([float(np.percentile(run, percent))
                                               for run in runs], 's')
            for percent in _PERCENTILES}


def _cpu(runs: list[ExchangeRun]) -> dict[str, Any]:
    by_unit = {unit: [run.cpu_per_step(unit) for run in runs] for unit in UNITS}
    return {**{unit: measuring.figure(values, 's') for unit, values in by_unit.items()},
            'all': measuring.figure(np.sum(list(by_unit.values()), axis=0).tolist(), 's')}
