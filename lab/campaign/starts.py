# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Start a drive with members that join in random order; step 1000 must be reached."""

from collections.abc import Mapping
from pathlib import Path
import random
import tempfile
from typing import Any

from antenna_drive.emulator.wiring import UNITS
from antenna_drive.recording.bag_reader import read_bag
from lab.campaign.rig import OBSERVER, random_settings, RECORDER, Rig
from lab.campaign.trials import Outcome
from simgap.logs.channel import RecordingError

STEP = 1000


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Start one drive; random are the members, their order, the waits, pace and exchange."""
    outcome = Outcome()
    recorder = rng.random() < 0.7
    observers = [f'{OBSERVER}_{number}' for number in range(rng.choice([0, 0, 1, 2]))]
    order = [*UNITS, *([RECORDER] if recorder else ()), *observers]
    rng.shuffle(order)
    pace, exchange = rng.choice([0.0, 1.0]), rng.choice(['python', 'auto'])
    outcome.figures.update(order=order, pace=pace, exchange=exchange)
    with tempfile.TemporaryDirectory() as folder:
        with Rig(outcome, Path(folder), recorder=recorder, observers=observers, order=order,
                 exchange=exchange, settings=random_settings(rng), pace=pace) as rig:
            outcome.count('starts')
            rig.start(rng, rng.choice([0.0, 0.5, 3.0]))
            outcome.figures['step_1000_s'] = rig.until(
                lambda: rig.watcher.step >= STEP, f'step {STEP}')
            outcome.count('starts_reached')
            rig.compare()
        check_bags(outcome, Path(folder))
    return outcome


def check_bags(outcome: Outcome, folder: Path) -> None:
    """Read every bag of a folder, all of which were completed."""
    for bag in sorted(folder.iterdir()):
        check_bag(outcome, bag)


def check_bag(outcome: Outcome, bag: Path) -> None:
    """Read a bag that was completed; every step must be there, from the first to the last."""
    outcome.count('bags')
    try:
        recording = read_bag(bag)
    except RecordingError as error:
        outcome.find(f'a completed bag cannot be read: {error}', 'bags_unreadable')
        return
    for signal, channel in recording.channels.items():
        steps = channel.time_ns // 1_000_000
        if len(steps) and len(steps) != steps[-1] - steps[0] + 1:
            outcome.find(f'{bag.name}: {signal} lacks steps', 'lost_steps')
            return
