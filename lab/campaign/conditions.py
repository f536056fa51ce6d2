# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Conditions that a drive meets in the field: no disk, a wrong clock, suspension, crowds."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
import os
from pathlib import Path
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any
import warnings

from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep.member import DECEIVED_STANDSTILL_S
from antenna_drive.lockstep.report import CUT_OFF
from antenna_drive.recording.bag_reader import read_bag
from lab.campaign.domains import claimed_domain
from lab.campaign.rig import (
    Diagnostics, InVainError, MEMBERS, OBSERVER, random_settings, RECORDER, Rig,
)
from lab.campaign.starts import check_bags
from lab.campaign.trials import Outcome
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from simgap.logs.channel import RecordingError, RecordingWarning

SUSPENDED_S = 5.0
# Of a domain on one machine, rmw_fastrtps lets the first 33 processes find each other. Five drives
# with their watchers, and the listener to /diagnostics, are 31.
DRIVES_PER_DOMAIN = 5
# Times real time, of each of many drives. A drive at 0.1 takes a third of a core, and ten of them
# must leave two cores the time to find those that begin.
CROWD_PACE = 0.03
CHANGES_PER_MINUTE = 1000
HOUR_S = 3600
# Frames of garbage, 1000 a second.
GARBAGE = 12_000
# Stops of a node while others join.
STOPS = 8
LISTENER = 'lab.campaign.listener'
# In a file system of its own, mounted in $0: the command that follows.
MOUNTED = 'mount -t tmpfs -o size={size} none "$0" && mkdir "$0/bags" && {then} exec "$@"'


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Put a drive into one condition."""
    outcome = Outcome()
    conditions: dict[str, Callable[[Outcome, Mapping[str, Any], random.Random, Path], None]] = {
        'full_disk': _full_disk, 'read_only_folder': _read_only_folder,
        'removed_folder': _removed_folder, 'full_disk_for_commands': _full_disk_for_commands,
        'clock_set': _clock_set, 'suspended': _suspended, 'many_drives': _many_drives,
        'slow_observer': _slow_observer, 'many_changes': _many_changes,
        'second_publishers': _second_publishers,
        'stopped_beside_garbage': _stopped_beside_garbage,
        'stopped_while_others_join': _stopped_while_others_join}
    with tempfile.TemporaryDirectory() as folder:
        conditions[name.rpartition('_')[0]](outcome, options, rng, Path(folder))
    return outcome


def mounting(size: str, then: str = '') -> list[str] | None:
    """Return how to start a command with a small file system, None where it is not allowed."""
    start = ['unshare', '-m'] if os.getuid() == 0 else ['unshare', '-rm']
    whole = [*start, 'sh', '-c', MOUNTED.format(size=size, then=then)]
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = subprocess.run([*whole, folder, 'true'], capture_output=True, timeout=20.0)
        except OSError:
            return None
    return whole if done.returncode == 0 else None


def _recorder_on(outcome: Outcome, rng: random.Random, folder: Path, size: str, then: str) -> None:
    """Record to a file system that cannot hold it: the drive goes on, the recorder says so."""
    start = mounting(size, then)
    if start is None:
        outcome.skipped = 'no file system can be mounted here (unshare -m)'
        return
    command = (*start, str(folder), sys.executable, '-m', MEMBERS, 'recorder', f'{folder}/bags')
    with Rig(outcome, commands={RECORDER: command}, waited_for=[RECORDER], pace=0.0,
             settings=random_settings(rng)) as rig:
        rig.start()
        rig.until(lambda: 'cannot be written' in rig.processes.log(RECORDER), 'a word of the disk')
        told = rig.watcher.step
        rig.until(lambda: rig.watcher.step > told + 500, 'the drive to go on')
        rig.compare()
        # the file system is seen by the recorder alone
        bags = Path(f'/proc/{rig.pid(RECORDER)}/root{folder}/bags')
        if not then:
            _read_part(outcome, bags)
        code = rig.end(RECORDER)
        if code != 1:
            outcome.find(f'a recorder without a disk ended with {code}', 'wrong_exits')


def _read_part(outcome: Outcome, bags: Path) -> None:
    outcome.count('bags')
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', RecordingWarning)
            held = [len(read_bag(bag, partial=True)['plant/encoder']) for bag in bags.iterdir()]
    except RecordingError as error:
        outcome.find(f'a bag on a full disk cannot be read: {error}', 'bags_unreadable')
        return
    if not held or max(held) < 100:
        outcome.find(f'bags on a full disk hold {held} steps', 'bags_unreadable')


def _full_disk(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
               folder: Path) -> None:
    _recorder_on(outcome, rng, folder, '2m', '')


def _read_only_folder(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                      folder: Path) -> None:
    _recorder_on(outcome, rng, folder, '2m', 'mount -o remount,ro "$0" &&')


def _removed_folder(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                    folder: Path) -> None:
    with Rig(outcome, folder / 'bags', recorder=True, pace=1.0,
             settings=random_settings(rng)) as rig:
        rig.start()
        rig.until_step(1000)
        shutil.rmtree(folder / 'bags')
        told = rig.watcher.step
        rig.until(lambda: rig.watcher.step > told + 2000, 'the drive to go on')
        rig.compare()
        code = rig.end(RECORDER)
        if code != 1:
            outcome.find(f'a recorder whose folder was removed ended with {code}', 'wrong_exits',
                         log=rig.processes.log(RECORDER)[-1000:])


def _full_disk_for_commands(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                            folder: Path) -> None:
    start = mounting('400k')
    if start is None:
        outcome.skipped = 'no file system can be mounted here (unshare -m)'
        return
    command = ' '.join([sys.executable, '-m', 'antenna_drive'])
    for words, out in (('run --duration 30', 'run.csv'), ('run --duration 30', 'run'),
                       ('record --quiet --duration 10', 'recorded')):
        # say what is left once the command has ended
        script = (f'{command} {words} --out "$0/{out}"; echo "code $?"; '
                  'find "$0" -mindepth 1 -not -path "$0/bags"')
        done = subprocess.run([*start, str(folder), 'sh', '-c', script, str(folder)],
                              capture_output=True, text=True, timeout=300.0)
        outcome.count('commands')
        detail = {'command': words, 'said': done.stderr[-1500:], 'left': done.stdout[-500:]}
        if 'Traceback' in done.stderr:
            outcome.find(f'{words} on a full disk: a traceback', 'tracebacks', **detail)
        elif 'code 2' not in done.stdout or len(done.stderr.strip().splitlines()) != 1:
            outcome.find(f'{words} on a full disk: no line with exit code 2', 'wrong_exits',
                         **detail)
        elif words.startswith('run') and len(done.stdout.strip().splitlines()) > 1:
            outcome.find(f'{words} on a full disk leaves something half written', 'half_written',
                         **detail)


def _clock_library(folder: Path) -> Path | None:
    """Compile what sets the clock of processes that load it first; None without a compiler."""
    compiler = next(filter(None, map(shutil.which, ('cc', 'gcc', 'clang'))), None)
    if compiler is None:
        return None
    library = folder / 'clock.so'
    done = subprocess.run([compiler, '-O1', '-shared', '-fPIC', '-o', str(library),
                           str(Path(__file__).with_name('clock.c')), '-ldl', '-lpthread'],
                          capture_output=True)
    return library if done.returncode == 0 else None


def _clock_set(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
               folder: Path) -> None:
    library = _clock_library(folder)
    if library is None:
        outcome.skipped = 'the clock can be set here by a C compiler alone, and there is none'
        return
    clock = folder / 'clock'
    clock.write_bytes(bytes(8))
    with Rig(outcome, folder / 'bags', recorder=True, observers=[OBSERVER], pace=1.0,
             environment={'LD_PRELOAD': str(library), 'CLOCK_OFFSET_FILE': str(clock)},
             settings=random_settings(rng), nodes_are_killed=True) as rig:
        rig.start()
        rig.until_step(500)
        for offset_s in (rng.choice([HOUR_S, -HOUR_S]), 0):
            with clock.open('r+b') as stream:
                stream.write((offset_s * 10**9).to_bytes(8, sys.byteorder, signed=True))
            outcome.count('clocks_set')
            told, runs = rig.watcher.step, len(rig.watcher.runs)
            rig.until(lambda: rig.watcher.step > told + 1000,  # noqa: B023
                      f'the drive to go on with its clock at {offset_s:+d} s')
            if len(rig.watcher.runs) != runs:
                outcome.find('a clock that was set began a new run', 'new_runs')
            victim = rng.choice(UNITS)
            rig.processes.kill(victim)
            rig.processes.start(victim)
            rig.until(lambda: len(rig.watcher.runs) > runs  # noqa: B023
                      and rig.watcher.step > 300, f'a new run of {victim} with the clock at '
                                                  f'{offset_s:+d} s')
            rig.compare()
    check_bags(outcome, folder / 'bags')


def _suspended(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
               folder: Path) -> None:
    with Rig(outcome, folder / 'bags', recorder=True, observers=[OBSERVER], pace=1.0,
             settings=random_settings(rng)) as rig:
        rig.start()
        rig.until_step(500)
        runs = len(rig.watcher.runs)
        for number in (signal.SIGSTOP, signal.SIGCONT):
            for name in rig.names:
                rig.processes.process(name).send_signal(number)
            if number == signal.SIGSTOP:
                time.sleep(SUSPENDED_S)
        told = rig.watcher.step
        rig.until(lambda: rig.watcher.step > told + 1000, 'the drive to go on')
        if len(rig.watcher.runs) != runs:
            outcome.find('a suspension began a new run', 'new_runs')
        rig.compare()
        said = rig.said.last('test_signal')
        outcome.figures['late_steps'] = said.values.get('late steps') if said else None
    check_bags(outcome, folder / 'bags')


def _many_drives(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                 folder: Path) -> None:
    """Have drives run at once, each in a namespace, with as many in a domain as it can hold."""
    with ExitStack() as ending:
        rigs: list[Rig] = []
        for number in range(options['drives']):
            if number % DRIVES_PER_DOMAIN == 0:
                os.environ['ROS_DOMAIN_ID'] = str(ending.enter_context(claimed_domain()))
                said = Diagnostics()
                ending.callback(said.close)
            rigs.append(ending.enter_context(Rig(
                outcome, namespace=f'/drive_{number}', settings=random_settings(rng), said=said,
                pace=CROWD_PACE)))
        began = time.monotonic()
        for rig in rigs:
            rig.start()
            rig.until(lambda rig=rig: rig.watcher.step >= 100,  # type: ignore[misc]
                      f'step 100 of {rig.namespace}')
        outcome.figures['begun_after_s'] = round(time.monotonic() - began, 1)
        told = [rig.watcher.step for rig in rigs]
        for rig, step in zip(rigs, told):
            rig.until(lambda rig=rig, step=step:  # type: ignore[misc]
                      rig.watcher.step > step + 500, f'{rig.namespace} to go on')
            rig.compare()
            outcome.count('drives')


def _slow_observer(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                   folder: Path) -> None:
    guest = (sys.executable, '-m', MEMBERS, 'observer', '0.05')
    with Rig(outcome, folder / 'bags', recorder=True, commands={'guest': guest}, pace=0.0,
             settings=random_settings(rng), nap_s=5e-3) as rig:
        rig.start()
        rig.until_step(1500)
        rig.compare()
    check_bags(outcome, folder / 'bags')


def _many_changes(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                  folder: Path) -> None:
    with Rig(outcome, folder / 'bags', recorder=True, pace=1.0, keep=10**6,
             settings=random_settings(rng)) as rig:
        rig.start()
        rig.until_step(300)
        client: Any = rig.said.node.create_client(SetParameters, 'torque_share/set_parameters')
        rig.until(client.service_is_ready, 'the parameter service')
        answers = []
        began = time.monotonic()
        for number in range(round(options['watch_s'] * CHANGES_PER_MINUTE / 60.0)):
            answers.append(client.call_async(SetParameters.Request(parameters=[Parameter(
                'bias_pot', value=rng.uniform(0.1, 0.9)).to_parameter_msg()])))
            time.sleep(max(0.0, began + (number + 1) * 60.0 / CHANGES_PER_MINUTE
                           - time.monotonic()))
        rig.until(lambda: all(answer.done() for answer in answers), 'every answer')
        told = rig.watcher.step
        rig.until(lambda: rig.watcher.step > told + 200, 'the drive to go on')
        outcome.count('changes', len(answers))
        reasons = [result.reason for answer in answers for result in answer.result().results
                   if not result.successful]
        if reasons:
            outcome.find(f'{len(reasons)} changes were refused: {reasons[0]}', 'changes_refused')
        noted = sum(len(units) for units in rig.schedule().values())
        outcome.figures['steps_with_changes'] = noted
        rig.compare()
    check_bags(outcome, folder / 'bags')


def _second_publishers(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                       folder: Path) -> None:
    speaker: Sequence[str] = (sys.executable, '-m', 'lab.campaign.impostor', 'echo')
    with Rig(outcome, folder / 'bags', recorder=True, commands={'echo': speaker}, pace=1.0,
             settings=random_settings(rng), keep=10**6) as rig:
        rig.start()
        rig.until(lambda: 'started' in rig.processes.log('echo'), 'the second publisher')
        told = rig.watcher.step
        rig.until(lambda: any('more than one publisher' in said.message
                              for said in rig.said.said.copy()), 'a warning', 60.0)
        rig.until(lambda: rig.watcher.step > told + 1000 * options['watch_s'] // 3,
                  'the drive to go on')
        rig.compare()
        if len(rig.watcher.runs) != 1:
            outcome.find('a second publisher began a new run', 'new_runs')
        rig.end('echo')
    check_bags(outcome, folder / 'bags')


def _stopped_beside_garbage(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                            folder: Path) -> None:
    """Stop a node beside garbage: a short stop costs no run, and no stop costs the drive."""
    speaker = (sys.executable, '-m', 'lab.campaign.impostor', 'garbage',
               str(rng.randrange(2**32)), str(GARBAGE))
    stop_s = rng.choice([rng.uniform(1.0, 3.0), rng.uniform(6.0, 8.0)])
    with Rig(outcome, commands={'impostor': speaker}, observers=[OBSERVER], pace=0.0,
             exchange=rng.choice(['python', 'auto']), settings=random_settings(rng),
             keep=10**6) as rig:
        rig.start()
        impostor, victim = rig.processes.process('impostor'), rng.choice(UNITS)
        rig.until(lambda: 'started' in rig.processes.log('impostor'), 'an impostor')
        time.sleep(1.0)
        rig.processes.process(victim).send_signal(signal.SIGSTOP)
        time.sleep(stop_s)
        rig.processes.process(victim).send_signal(signal.SIGCONT)
        rig.until(lambda: impostor.poll() is not None, 'the end of the garbage')
        over = time.monotonic()
        outcome.figures['went_on_after_s'] = rig.until(
            lambda: rig.watcher.moved_s > over and rig.watcher.step >= 300,
            'the drive to go on after the garbage', 20.0)
        runs = len(rig.watcher.runs)
        outcome.figures.update(victim=victim, stop_s=stop_s, runs=runs)
        if stop_s < DECEIVED_STANDSTILL_S and runs != 1:
            outcome.find(f'a stop of {stop_s:.1f} s beside garbage began {runs - 1} runs',
                         'new_runs')
        rig.compare()


def _stopped_while_others_join(outcome: Outcome, options: Mapping[str, Any], rng: random.Random,
                               folder: Path) -> None:
    """Stop nodes while others join: each goes on, or says that it was cut off from the others."""
    with Rig(outcome, pace=0.0, exchange=rng.choice(['python', 'auto']),
             settings=random_settings(rng), keep=10**6) as rig:
        rig.start()
        rig.until_step(300)
        cut_off = 0
        for _ in range(STOPS):
            victim = rng.choice(UNITS)
            rig.processes.process(victim).send_signal(signal.SIGSTOP)
            joining = [subprocess.Popen((sys.executable, '-m', LISTENER, '6'),
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                       for _ in range(2)]
            time.sleep(rng.uniform(2.5, 5.0))
            rig.processes.process(victim).send_signal(signal.SIGCONT)
            resumed, runs = time.monotonic(), len(rig.watcher.runs)

            def goes_on(since: float = resumed, run: int = runs) -> bool:
                return rig.watcher.moved_s > since and (
                    rig.watcher.step >= 300 or len(rig.watcher.runs) == run)

            def is_cut_off(name: str = victim) -> bool:
                said = rig.said.last(name)
                return said is not None and CUT_OFF in said.message

            try:
                rig.until(goes_on, 'the drive to go on', 10.0)
            except InVainError:
                rig.until(is_cut_off, f'{victim} to say that it is cut off', 10.0)
                cut_off += 1
                rig.processes.kill(victim)
                rig.processes.start(victim)
                rig.until_step(300, runs + 1)
            for process in joining:
                process.wait()
        outcome.figures.update(stops=STOPS, cut_off=cut_off)
        rig.compare()
