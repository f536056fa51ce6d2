# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Run a drive at real time for long: memory, file handles, lost and late steps."""

from collections.abc import Mapping, Sequence
import math
from pathlib import Path
import random
import tempfile
import time
from typing import Any

from lab.campaign.rig import handles, memory_bytes, OBSERVER, random_settings, Rig
from lab.campaign.starts import check_bags
from lab.campaign.trials import Outcome
import numpy as np

SAMPLES = 300
# What grows while a process warms up says nothing of an hour: this part is left out.
WARM_UP = 0.25
BLOCKS = 20
# A slope is a fault if it is above this at 95 percent, and has come to this much [MB/h, MB].
SLOPE, GROWN = 1.0, 2.0
# Student's t, 97.5 percent, for so many degrees of freedom (tables)
T_18 = 2.101


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Watch one drive with recorder, reader of /diagnostics and two observers."""
    outcome = Outcome()
    duration_s = float(options['duration_s'])
    every_s = max(0.5, duration_s / SAMPLES)
    samples: list[tuple[float, dict[str, int], dict[str, int]]] = []
    with tempfile.TemporaryDirectory() as folder:
        with Rig(outcome, Path(folder), recorder=True, exchange=rng.choice(['python', 'auto']),
                 observers=[f'{OBSERVER}_1', f'{OBSERVER}_2'], settings=random_settings(rng),
                 pace=1.0) as rig:
            rig.start()
            rig.until_step(100)
            began, first = time.monotonic(), rig.watcher.step
            while (now := time.monotonic() - began) < duration_s:
                samples.append((now, {n: memory_bytes(rig.pid(n)) for n in rig.names},
                                {n: handles(rig.pid(n)) for n in rig.names}))
                rig.until(lambda: time.monotonic() > began + now + every_s, '')  # noqa: B023
                rig.processes.check()
                if time.monotonic() - rig.watcher.moved_s > 30.0:
                    outcome.find(f'no step for 30 s; {rig.state()}', 'hangs')
                    break
            steps, wall_s = rig.watcher.step - first, time.monotonic() - began
            outcome.count('soak_s', round(wall_s))
            said = rig.said.last('test_signal')
            outcome.figures.update(
                steps=steps, times_real_time=round(1e-3 * steps / wall_s, 4),
                late_steps=int(said.values.get('late steps', 0)) if said else None,
                reports=rig.said.count, runs=len(rig.watcher.runs))
            if len(rig.watcher.runs) != 1:
                outcome.find(f'{len(rig.watcher.runs)} runs in one soak', 'new_runs')
            rig.compare()
        outcome.count('lost_steps', 0)
        check_bags(outcome, Path(folder))
    _judge(outcome, samples)
    return outcome


def _judge(outcome: Outcome, samples: Sequence[tuple[float, dict[str, int], dict[str, int]]],
           ) -> None:
    kept = samples[int(WARM_UP * len(samples)):]
    if len(kept) < 2 * BLOCKS:
        return
    hours = np.array([at for at, _, _ in kept]) / 3600.0
    for key, scale, rows in (
            ('memory_slope_MB_per_h', 1e6, [memory for _, memory, _ in kept]),
            ('handles_slope_per_h', 1.0, [opened for _, _, opened in kept])):
        own = {name: slope(hours, [row[name] / scale for row in rows]) for name in rows[0]}
        whole = slope(hours, [sum(row.values()) / scale for row in rows])
        outcome.figures[key] = [round(number, 3) for number in whole]
        outcome.figures[f'{key}_by_process'] = {
            name: [round(number, 3) for number in numbers] for name, numbers in own.items()}
        for name, (_, low, _) in own.items():
            if low > SLOPE and low * (hours[-1] - hours[0]) > GROWN:
                outcome.find(f'{key} of {name} is at least {low:.3g}', 'slopes')


def slope(x: Any, y: Sequence[float]) -> tuple[float, float, float]:
    """
    Return the slope of y over x and its 95 percent interval.

    It is fitted to the means of 20 blocks, whose errors depend on each other far less than those
    of single samples.
    """
    blocks = [part for part in np.array_split(np.arange(len(y)), BLOCKS) if len(part)]
    at = np.array([np.mean(np.asarray(x)[part]) for part in blocks])
    mean = np.array([np.mean(np.asarray(y)[part]) for part in blocks])
    centred = at - at.mean()
    value = float(centred @ mean / (centred @ centred))
    rest = mean - mean.mean() - value * centred
    error = math.sqrt(float(rest @ rest) / (len(blocks) - 2) / float(centred @ centred))
    return value, value - T_18 * error, value + T_18 * error
