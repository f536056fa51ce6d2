# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Publish invented and nearly right frames at 1 kHz beside a running drive."""

from collections.abc import Mapping
import random
import re
import sys
import time
from typing import Any

from antenna_drive.emulator.wiring import UNITS
from lab.campaign.rig import memory_bytes, random_settings, Rig
from lab.campaign.trials import Outcome
import numpy as np

WINDOWS = 3
QUIET_S = 5.0
# A node may hold this much more afterwards: what the middleware keeps of a late publisher [B].
GROWTH = 30e6


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Take turns of quiet and of garbage beside one drive; compare every bit of it."""
    outcome = Outcome()
    exchange = rng.choice(['python', 'auto'])
    count = options['frames'] // WINDOWS
    speakers = {f'impostor_{turn}': (
        sys.executable, '-m', 'lab.campaign.impostor', 'garbage',
        str(rng.randrange(2**32)), str(count)) for turn in range(WINDOWS)}
    quiet, loud, longest_s = [], [], 60.0 + count * 3e-3
    with Rig(outcome, commands=speakers, exchange=exchange, settings=random_settings(rng),
             pace=0.0, keep=10**7) as rig:
        for unit in UNITS:
            rig.processes.start(unit)
        rig.until_step(300)
        before: dict[str, int] = {}
        for turn, speaker in enumerate(speakers):
            quiet.append(_rate(rig, QUIET_S))
            rig.processes.start(speaker)
            rig.until(lambda speaker=speaker: 'started' in rig.processes.log(  # type: ignore[misc]
                speaker), 'an impostor')
            at, step = time.monotonic(), rig.watcher.step
            process = rig.processes.process(speaker)
            rig.until(lambda process=process: process.poll() is not None,  # type: ignore[misc]
                      'the end of the garbage', longest_s)
            loud.append((rig.watcher.step - step) / (time.monotonic() - at))
            took = re.search(r'done ([\d.]+)', rig.processes.log(speaker))
            outcome.count('garbage_frames', count if took else 0)
            outcome.figures['frames_per_s'] = round(count / float(took[1])) if took else None
            if turn == 0:
                before = {unit: memory_bytes(rig.pid(unit)) for unit in UNITS}
        quiet.append(_rate(rig, QUIET_S))
        held = {unit: memory_bytes(rig.pid(unit)) - before[unit] for unit in UNITS}
        refused = {unit: int(said.values.get('refused frames', 0)) for unit in UNITS
                   if (said := rig.said.last(unit)) is not None}
        _judge(rig, outcome)
    if not loud:
        return outcome
    ratio = float(np.mean(loud) / np.mean(quiet))
    outcome.figures.update(
        exchange=exchange, quiet_steps_per_s=[round(rate) for rate in quiet],
        loud_steps_per_s=[round(rate) for rate in loud], rate_ratio=round(ratio, 3),
        refused=refused, growth_MB={unit: round(grown / 1e6, 2) for unit, grown in held.items()})
    if ratio < 0.5:
        outcome.find(f'garbage slows the drive to {ratio:.2f} of its rate', 'slowed')
    for unit, grown in held.items():
        if grown > GROWTH:
            outcome.find(f'garbage makes {unit} hold {grown / 1e6:.1f} MB more', 'memory_grew')
    return outcome


def _rate(rig: Rig, seconds: float) -> float:
    step = rig.watcher.step
    time.sleep(seconds)
    return (rig.watcher.step - step) / seconds


def _judge(rig: Rig, outcome: Outcome) -> None:
    outcome.count('garbage_stepped_on', 0)
    if len(rig.watcher.runs) != 1:
        outcome.find(f'garbage began {len(rig.watcher.runs) - 1} runs', 'garbage_stepped_on')
        return
    if not rig.compare():
        outcome.count('garbage_stepped_on')
