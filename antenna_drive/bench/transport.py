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
"""The exchange between five processes: the drive's and the bare one, in alternating runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import os
from pathlib import Path
import sys
import tempfile
import time
from typing import Any

from antenna_drive.bench import measuring
from antenna_drive.bench.stamps import read, Stamped, WARM_STEPS
from antenna_drive.emulator.wiring import TEST_SIGNAL, UNITS
from antenna_drive.errors import UserError
from antenna_drive.lockstep.processes import DriveProcesses, Parameter
import numpy as np

STEP_S = 1e-3
# Time limits for the start of five processes and for a step [s].
_BEGIN_PATIENCE_S = 60.0
_STEP_PATIENCE_S = 0.05

# The type of `own` and `bare`.
Run = Callable[..., 'Exchange']

_PERCENTILES = (50.0, 99.0, 99.9)


@dataclass(frozen=True)
class Exchange:
    """
    The records of five processes in one run.

    Attributes
    ----------
    step_s : macro-step [s]
    pace : times real time, 0 for as fast as possible
    nodes : by unit
    began_s : from the start of the first process to the conductor's first step [s]

    """

    step_s: float
    pace: float
    nodes: dict[str, Stamped]
    began_s: float

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
    def delays(self) -> Any:
        """Return the delay of each of the conductor's steps from step 1 on [s]."""
        conductor = self.nodes[TEST_SIGNAL]
        due = conductor.due_s + np.arange(conductor.times.size) * (self.step_s / self.pace)
        return (conductor.times - due)[1:]

    def late(self) -> Any:
        """Return for each step whether it was late by more than one step."""
        return self.delays > self.step_s / self.pace


def own(steps: int, step_s: float = STEP_S, pace: float = 0.0, publish_rate: float = 0.0,
        ) -> Exchange:
    """Run the drive's five nodes for some steps; publish_rate is that of their readings [Hz]."""
    parameters: dict[str, dict[str, Parameter]] = {
        unit: {'publish_rate': publish_rate} for unit in UNITS}
    parameters[TEST_SIGNAL].update({
        'run.step': step_s, 'run.pace': pace, 'run.duration': steps * step_s})
    return _run('antenna_drive.bench.measured_node', steps, step_s, pace, parameters, ())


def bare(steps: int, step_s: float = STEP_S, pace: float = 0.0) -> Exchange:
    """Run the bare exchange for some steps."""
    return _run('antenna_drive.bench.bare_node', steps, step_s, pace,
                {TEST_SIGNAL: {'run.pace': pace}}, (repr(step_s), repr(pace)))


def _run(module: str, steps: int, step_s: float, pace: float,
         parameters: dict[str, dict[str, Parameter]], more: tuple[str, ...]) -> Exchange:
    with tempfile.TemporaryDirectory() as folder:
        files = {unit: Path(folder, f'{unit}.npz') for unit in UNITS}
        commands = {unit: (sys.executable, '-m', module, unit, str(path), str(steps), *more)
                    for unit, path in files.items()}
        patience = _BEGIN_PATIENCE_S + steps * max(
            _STEP_PATIENCE_S, 2.0 * step_s / pace if pace else 0.0)
        began = time.monotonic()
        # An own namespace keeps other drives on this machine apart.
        with DriveProcesses(parameters, commands=commands,
                            namespace=f'/bench_{os.getpid()}') as processes:
            while not all(path.exists() for path in files.values()):
                processes.check()
                if time.monotonic() - began > patience:
                    raise UserError(f'{module}: {steps} steps take more than {patience:.0f} s')
                time.sleep(0.05)
        nodes = {unit: read(path) for unit, path in files.items()}
    return Exchange(step_s, pace, nodes, float(nodes[TEST_SIGNAL].times[1] - began))


def measure(repetitions: int, quick: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """
    Measure the exchange.

    Returns
    -------
    ratio_to_bare (as fast as possible, no readings), ratio_to_bare_with_readings, rates, real-time
    factors, step and paced latencies, processor time per step and node, late_fraction

    Raises
    ------
    ModuleNotFoundError : ROS 2 is not installed

    """
    import rclpy  # noqa: F401  fail here and not in five processes

    steps = 1500 if quick else 5000
    result: dict[str, Any] = {'steps': steps, 'step_s': STEP_S}
    plain: dict[str, list[Exchange]] = {'own': [], 'bare': [], 'readings': []}
    for turn in range(repetitions):
        progress(f'as fast as possible, turn {turn + 1} of {repetitions}')
        plain['own'].append(own(steps))
        plain['bare'].append(bare(steps))
        plain['readings'].append(own(steps, publish_rate=100.0))
    rates = {name: [run.rate for run in runs] for name, runs in plain.items()}
    result['steps_per_s'] = {name: measuring.figure(values, '1/s')
                             for name, values in rates.items()}
    result['ratio_to_bare'] = measuring.ratio(rates['own'], rates['bare'])
    result['ratio_to_bare_with_readings'] = measuring.ratio(rates['readings'], rates['bare'])
    result['rtf_1ms'] = measuring.figure([rate * STEP_S for rate in rates['readings']])
    result['step_s_as_fast_as_possible'] = {
        name: _percentiles([run.intervals for run in runs]) for name, runs in plain.items()}
    result['cpu_per_step_s'] = {name: _cpu(runs) for name, runs in plain.items()}
    result['first_step_s'] = measuring.figure([run.began_s for run in plain['own']], 's')
    if not quick:
        for name, step_s in (('rtf_2ms', 2e-3), ('rtf_0.5ms', 5e-4)):
            progress(f'macro-step of {1e3 * step_s:g} ms')
            runs = [own(steps, step_s, publish_rate=100.0) for _ in range(repetitions)]
            result[name] = measuring.figure([run.rate * step_s for run in runs])
    if not quick:
        result |= _paced(repetitions, steps, progress)
    duration = 15.0 if quick else 600.0
    progress(f'{duration:g} s at real-time pace')
    long = own(round(duration / STEP_S), pace=1.0, publish_rate=100.0)
    late = long.late()
    parts = np.array_split(late, 5 if quick else 10)
    result['late_fraction'] = measuring.figure([float(part.mean()) for part in parts]) | {
        'total': float(late.mean()), 'late_steps': int(late.sum()), 'duration_s': duration}
    result['late_run_latency_s'] = _percentiles([long.latencies])
    return result


def _paced(repetitions: int, steps: int, progress: Callable[[str], None]) -> dict[str, Any]:
    """Measure the latency of both exchanges at real-time pace."""
    paced: dict[str, list[Exchange]] = {'own': [], 'bare': []}
    for turn in range(repetitions):
        progress(f'at real-time pace, turn {turn + 1} of {repetitions}')
        paced['own'].append(own(steps, pace=1.0))
        paced['bare'].append(bare(steps, pace=1.0))
    return {
        'paced_latency_s': {name: _percentiles([run.latencies for run in runs])
                            for name, runs in paced.items()},
        'paced_latency_over_bare': measuring.ratio(
            [float(np.median(run.latencies)) for run in paced['own']],
            [float(np.median(run.latencies)) for run in paced['bare']]),
        'paced_cpu_per_step_s': {name: _cpu(runs) for name, runs in paced.items()}}


def _percentiles(runs: list[Any]) -> dict[str, Any]:
    return {f'p{percent:g}': measuring.figure([float(np.percentile(run, percent))
                                               for run in runs], 's')
            for percent in _PERCENTILES}


def _cpu(runs: list[Exchange]) -> dict[str, Any]:
    by_unit = {unit: [run.cpu_per_step(unit) for run in runs] for unit in UNITS}
    return {**{unit: measuring.figure(values, 's') for unit, values in by_unit.items()},
            'all': measuring.figure(np.sum(list(by_unit.values()), axis=0).tolist(), 's')}
