# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Kill, stop and end the members of a drive at random moments.

The others must name the one that is missing within two seconds. When it is started again, the next
run begins without a restart of the others, and its bits are those of one process.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
import random
import re
import signal
import sys
import tempfile
import time
from typing import Any
import warnings

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.recording.bag import METADATA
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import FLUSH_S
from antenna_drive.recording.csv_format import read_csv, write_csv
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.replay import twin
from lab.campaign.rig import OBSERVER, random_settings, RECORDER, Rig
from lab.campaign.starts import check_bag
from lab.campaign.trials import Outcome
import numpy as np
from simgap.logs.channel import RecordingError, RecordingWarning

COMMAND = 'test_signal/rate_command'
KILL, STOP, END = 'kill', 'stop', 'end'
NAMED_WITHIN_S = 2.0
# A process that is stopped for less than this need not be named.
NOTICED_S = NAMED_WITHIN_S + 0.5
# How far behind the watcher a recorder may be that the drive waits for [steps].
BEHIND = 500
# Steps that a recorder may lack at the end of a run whose node was killed.
LOST_WITH_NODE = 10
# What a step takes from the watcher to the recorder and back, on a busy machine [s].
DELAY_S = 0.2


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Kill the members of one drive, one after the other."""
    outcome = Outcome()
    pace, exchange = rng.choice([0.0, 1.0]), rng.choice(['python', 'auto'])
    player = rng.random() < 0.3
    settings = random_settings(rng)
    outcome.figures.update(pace=pace, exchange=exchange, player=player)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place, 'bags')
        conductor: tuple[str, ...] = ()
        expected: Callable[[int], FloatArray] | None = None
        if player:
            field = Path(place, 'field.csv')
            expected = _field(field, rng)
            conductor = (sys.executable, '-m', 'antenna_drive.nodes.command_player', str(field))
        with Rig(outcome, folder, recorder=True, observers=[OBSERVER], conductor=conductor,
                 exchange=exchange, settings=settings, nodes_are_killed=True, pace=pace) as rig:
            session = _Session(rig, outcome, rng, folder, expected)
            rig.start()
            rig.until_step(300)
            for number in range(options['kills']):
                session.strike(number, options['longest_stop_s'])
        session.check_bags()
    return outcome


def _field(path: Path, rng: random.Random) -> Callable[[int], FloatArray]:
    """Write a recorded command; return what the drive does with it in one process."""
    at = np.arange(0.0, 4.0, 0.013)
    write_csv(Recording.from_arrays(at, {COMMAND: rng.uniform(1e-4, 3e-3) * np.sign(
        np.sin(rng.uniform(1.0, 9.0) * at))}), path)
    again = twin(read_csv(path))
    values = np.stack([channel.values for channel in again.channels.values()], axis=1)

    def expected(steps: int) -> FloatArray:
        held = values[:steps]
        return np.stack([held, np.zeros_like(held)], axis=2)
    return expected


def _lost_steps(log: str) -> int:
    """Return how many steps the recorders of a log have said to lack."""
    # the first bag of a recorder has no number at its end; each says its total so far
    return sum(int([0, *re.findall(r'(\d+) steps lost', said)][-1])
               for said in re.split(r'/start_\d+\n', log))


class _Session:
    """Strikes against the members of a running drive."""

    def __init__(self, rig: Rig, outcome: Outcome, rng: random.Random, folder: Path,
                 expected: Callable[[int], FloatArray] | None) -> None:
        self._rig = rig
        self._outcome = outcome
        self._rng = rng
        self._folder = folder
        self._expected = expected
        # bags of recorders that were killed, and the step up to which each must be readable
        self._least: dict[str, int] = {}
        self._lost = 0

    def strike(self, number: int, longest_stop_s: float) -> None:
        """Strike one member at a random moment, and see the drive recover."""
        rig, rng, outcome = self._rig, self._rng, self._outcome
        victim = rng.choice(rig.names)
        way = rng.choice([KILL, STOP, END])
        lasts_s = rng.uniform(1.0, longest_stop_s)
        # one in six strikes hits a drive that is about to begin
        settled = rng.random() > 1.0 / 6.0
        moment = rng.uniform(0.0, 1.5)
        if settled:
            runs = len(rig.watcher.runs)
            rig.until_step(100, runs)
        time.sleep(moment)
        # a strike while the run has not begun is named by nobody
        runs, before = len(rig.watcher.runs), rig.watcher.step
        settled = settled and before >= 100
        pids = {name: rig.pid(name) for name in rig.names}
        detail = {'strike': number, 'victim': victim, 'way': way, 'lasts_s': lasts_s,
                  'settled': settled}
        at = time.monotonic()
        least = rig.watcher.step_at(at - FLUSH_S - DELAY_S) - BEHIND
        process = rig.processes.process(victim)
        process.send_signal({KILL: signal.SIGKILL, STOP: signal.SIGSTOP, END: signal.SIGTERM}[way])
        outcome.count('kills')
        outcome.count(f'kills_{way}')
        if way == STOP:
            self._await_name(victim, at, lasts_s, detail, settled and lasts_s >= NOTICED_S)
            time.sleep(max(0.0, at + lasts_s - time.monotonic()))
            process.send_signal(signal.SIGCONT)
            resumed = rig.watcher.step
            rig.until(lambda: len(rig.watcher.runs) > runs or rig.watcher.step > resumed + 100,
                      f'the drive to go on after {detail}')
        else:
            if way == END:
                code = process.wait(10.0)
                if not rig.ended_well(victim, code):
                    outcome.find(f'{victim} ended with {code} after SIGTERM', 'wrong_exits',
                                 log=rig.processes.log(victim)[-2000:], **detail)
            else:
                process.wait()
                if victim == RECORDER:
                    self._note_bag(least)
            self._await_name(victim, at, 10.0, detail, settled)
            rig.processes.start(victim)
            rig.until(lambda: len(rig.watcher.runs) > runs and rig.watcher.step >= 300,
                      f'a new run after {detail}')
        outcome.count('recovered')
        self._note_lost_steps(detail)
        for other in rig.names:
            if other != victim and rig.pid(other) != pids[other] or (
                    rig.processes.process(other).poll() is not None):
                outcome.find(f'{other} has ended too', 'ended_too', **detail)
        if self._expected is None:
            rig.compare()
        else:
            # the recorded command gives values, no derivatives
            rig.compare(self._expected, slice(0, 1))

    def _await_name(self, victim: str, at: float, patience_s: float, detail: Mapping[str, Any],
                    due: bool) -> None:
        if not due:
            return

        def stood_since() -> float:
            """Return when the drive began to wait: it goes on for 500 steps without observers."""
            return at if victim in UNITS else max(at, self._rig.watcher.moved_s)

        def named() -> float | None:
            return next((said.time_s for said in self._rig.said.since(at)
                         if said.node != victim and victim in said.values.get(
                             'waiting for', '').split(', ')), None)

        deadline = at + patience_s
        while (told := named()) is None and time.monotonic() < deadline:
            time.sleep(0.02)
        took = None if told is None else max(0.0, told - stood_since())
        if told is None and stood_since() > deadline - NAMED_WITHIN_S:
            return  # it has not waited long enough
        self._outcome.count('kills_to_name')
        if took is not None and took <= NAMED_WITHIN_S:
            self._outcome.count('kills_named_within_2s')
        else:
            self._outcome.find(
                f'{victim} was named after '
                f'{"never" if took is None else format(took, ".2f")} s', 'named_late',
                said={said.node: said.message for said in self._rig.said.since(at)}, **detail)
        if took is not None:
            worst = self._outcome.figures.get('longest_to_name_s', 0.0)
            self._outcome.figures['longest_to_name_s'] = max(worst, round(took, 3))

    def _note_lost_steps(self, detail: Mapping[str, Any]) -> None:
        """Count the steps that a recorder lacks because a node took its last frames along."""
        total = _lost_steps(self._rig.processes.log(RECORDER))
        lost, self._lost = total - self._lost, total
        self._outcome.count('steps_lost_with_nodes', lost)
        if lost > LOST_WITH_NODE:
            self._outcome.find(f'a recorder lacks {lost} steps of a run', 'lost_steps', **detail)

    def _note_bag(self, least: int) -> None:
        """Note the bag that a killed recorder has left open, and how long it must be."""
        cut = [path for path in self._folder.glob('start_*')
               if path.name not in self._least and not (path / METADATA).exists()]
        if len(cut) > 1:
            self._outcome.find(f'one kill has cut off {len(cut)} bags', 'bags_unreadable')
        for path in cut:
            self._least[path.name] = least

    def check_bags(self) -> None:
        """Read every bag; one of a recorder that was killed up to the last half second."""
        for bag in sorted(self._folder.iterdir()):
            if bag.name not in self._least:
                check_bag(self._outcome, bag)
                continue
            self._outcome.count('bags')
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter('ignore', RecordingWarning)
                    recording = read_bag(bag, partial=True)
            except RecordingError as error:
                self._outcome.find(f'a bag of a killed recorder cannot be read: {error}',
                                   'bags_unreadable')
                continue
            last = min((int(channel.time_ns[-1] // 1_000_000) if len(channel) else -1)
                       for channel in recording.channels.values())
            if last < self._least[bag.name]:
                self._outcome.find(
                    f'a bag ends at step {last}, half a second before the kill was step '
                    f'{self._least[bag.name]}', 'bags_short')
