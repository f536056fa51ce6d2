# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive in five real processes over real DDS, against the emulator in one process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
import math
from pathlib import Path
import random
import re
import signal
import subprocess
import sys
from typing import Any

from antenna_drive.emulator.run import simulate
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.emulator.units import build
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep.exchange import compile_ahead
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no processes to test')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from drive_watch import Recorder, Watch  # noqa: E402

NAME = 'watcher'
# The units whose exchange is compiled.
EXCHANGES = {'compiled': UNITS, 'mixed': ('test_signal', 'motor_2', 'torque_share'), 'python': ()}
# Faults are met by the protocol, which both exchanges share: the exchange in Python and mixed
# drives are tried by command, as each of these tests takes ten seconds of both cores or more.
IN_FAULTS = [pytest.param(exchange, marks=() if exchange == 'compiled' else pytest.mark.trial)
             for exchange in EXCHANGES]
ENDLESS: dict[str, Any] = {'run.pace': 0.0, 'run.observers': [NAME]}


def in_process(steps: int, step_s: float, config: tuple[str, ...] = (),
               changes: Mapping[int, Any] | None = None,
               given: Mapping[str, Any] | None = None) -> FloatArray:
    drive = changed(load(*config), dict(given or {}))
    samples = simulate(drive, steps * step_s, step_s, changes).samples
    assert samples.shape[0] == steps + 1
    return samples


@pytest.fixture
def exchange(request: pytest.FixtureRequest) -> str:
    """Return which exchange is tried; compile it first, or both motors would do so at once."""
    drive = load()
    for unit in EXCHANGES[request.param]:
        compile_ahead(build(unit, drive))
    return str(request.param)


def on(exchange: str, parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return parameters of nodes with those of an exchange."""
    return {unit: {'exchange': 'auto' if unit in EXCHANGES[exchange] else 'python',
                   **parameters.get(unit, {})} for unit in UNITS}


def assert_exchange(watch: Watch, exchange: str) -> None:
    """Make sure that each node's exchange is the one that it was told, and makes steps."""
    for unit in UNITS:
        if unit not in EXCHANGES[exchange]:
            watch.until(lambda unit=unit: watch.value(  # type: ignore[misc]
                unit, 'exchange') == 'Python', f'the exchange of {unit}')
        else:
            watch.until(lambda unit=unit: int(watch.value(  # type: ignore[misc]
                unit, 'compiled steps') or 0) > 100, f'compiled steps of {unit}')


def assert_same_bits(got: FloatArray, want: FloatArray) -> None:
    assert got.shape == want.shape
    different = np.nonzero((got != want).any(axis=(1, 2)))[0]
    assert different.size == 0, f'first difference at step {different[0]}'
    assert got.tobytes() == want.tobytes()


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_random_start_order_and_a_busy_machine_change_no_bit() -> None:
    seed = random.randrange(1000)
    order = random.Random(seed).sample(UNITS, len(UNITS))
    print(f'seed {seed}: {order}')
    busy = subprocess.Popen([sys.executable, '-c', 'while True: pass'])
    try:
        with Watch() as watch, Recorder(NAME) as recorder, DriveProcesses(
                {'test_signal': ENDLESS}, order=order) as processes:
            watch.until(lambda: _at_step(recorder, processes, 2000), 'step 2000')
            samples = recorder.array()
            codes = processes.stop(signal.SIGTERM)
    finally:
        busy.kill()
        busy.wait()
    assert_same_bits(samples, in_process(samples.shape[0] - 1, 1e-3))
    assert codes == dict.fromkeys(UNITS, 0)


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize('exchange', EXCHANGES, indirect=True)
@pytest.mark.slow
def test_changes_refusals_and_foreign_frames_in_one_run(exchange: str) -> None:
    parameters = {'test_signal': {**ENDLESS, 'waveform': 'external', 'run.step': 2e-3}}
    with Watch() as watch, Recorder(NAME) as recorder, DriveProcesses(
            on(exchange, parameters)) as processes:
        watch.until(lambda: _at_step(recorder, processes, 50), 'step 50')
        command = watch.float_publisher('test_signal/external')
        for value in (1e-4, -2e-4, 3e-4):
            command(value)
            watch.until(lambda value=value: _has_stepped_with(  # type: ignore[misc]
                recorder, value), f'a step with the command {value}')
        assert_exchange(watch, exchange)
        _change_live(watch)
        _attack(watch, recorder)
        _invent_runs(watch, recorder)
        target = recorder.steps + 500
        watch.until(lambda: _at_step(recorder, processes, target), f'step {target}')
        told = watch.get('torque_share', 'bias_pot', 'fade_out_voltage')
        samples, schedule = recorder.array(), recorder.schedule()
        runs = list(recorder.runs)
        codes = processes.stop(signal.SIGINT)
        logs = {unit: processes.log(unit) for unit in UNITS}
    assert len(runs) == 1, 'nothing of this begins a new run'
    commands = [change['test_signal']['external'] for change in schedule.values()
                if 'test_signal' in change]
    assert commands == [1e-4, -2e-4, 3e-4]
    shared = [change['torque_share'] for change in schedule.values() if 'torque_share' in change]
    assert shared == [{'bias_pot': told[0], 'fade_out_voltage': told[1]}]
    steps = samples.shape[0] - 1
    want = in_process(steps, 2e-3, changes=schedule,
                      given={'test_signal.rate.waveform': 'external'})
    assert_same_bits(samples, want)
    assert not np.array_equal(want, in_process(
        steps, 2e-3, given={'test_signal.rate.waveform': 'external'})), 'the changes must count'
    assert codes == dict.fromkeys(UNITS, 0), logs
    assert not any('Traceback' in log for log in logs.values()), logs


def _has_stepped_with(recorder: Recorder, command: float) -> bool:
    """Tell whether the drive has gone on with a command: the next is in force later than it."""
    return any(unit == 'test_signal' and record.get('changes') == {'external': command}
               and recorder.steps > record['step'] for unit, record in recorder.changes)


def _change_live(watch: Watch) -> None:
    pot, fade_out = watch.get('torque_share', 'bias_pot', 'fade_out_voltage')
    constant, unknown, beyond, bad_pair = (
        watch.set_together('motor_1', {'armature.resistance': 2.0}),
        watch.set_together('torque_share', {'bias_pod': 0.5}),
        watch.set_together('torque_share', {'bias_pot': 1e9}),
        watch.set_together('torque_share', {'bias_pot': pot * 0.5, 'fade_out_voltage': math.nan}))
    assert not constant.successful
    assert 'read-only' in constant.reason
    assert not unknown.successful
    assert 'bias_pod' in unknown.reason
    assert not beyond.successful
    assert 'bias_pot' in beyond.reason
    assert not bad_pair.successful
    assert 'fade_out_voltage' in bad_pair.reason
    assert watch.get('torque_share', 'bias_pot', 'fade_out_voltage') == [pot, fade_out]
    good = watch.set_together(
        'torque_share', {'bias_pot': pot * 0.75, 'fade_out_voltage': fade_out * 0.5})
    assert good.successful, good.reason
    assert watch.get('torque_share', 'bias_pot', 'fade_out_voltage') == [
        pot * 0.75, fade_out * 0.5]
    [pot_described, resistance] = [*watch.describe('torque_share', 'bias_pot'),
                                   *watch.describe('motor_1', 'armature.resistance')]
    assert not pot_described.read_only
    assert pot_described.floating_point_range
    assert resistance.read_only
    assert '[ohm]' in resistance.description


def _attack(watch: Watch, recorder: Recorder) -> None:
    sender = recorder.observer.senders['plant']
    rest = [sender, *[0.5] * (2 * sum(
        name.startswith('plant/') for name in recorder.observer.names))]
    run = float(recorder.runs[-1])
    soon = float(recorder.steps)
    watch.publish_frames('plant/frame', [
        [run, soon, 2e-3, sender, math.nan, *rest[2:]],
        [run, soon, 2e-3, *rest[1:], math.inf],
        [run, soon, 2e-3, *rest[1:]],
        [3.0, soon, 2e-3, *rest],
        [run + 5.0, soon, 2e-3, *rest],
        [run, 0.0, 2e-3, *rest],
    ], readers=4)
    reasons = ('NaN', 'infinite', 'wrong length', 'wrong run', 'too old')
    for reader in ('motor_1', 'motor_2', 'test_signal'):
        watch.until(lambda reader=reader: all(  # type: ignore[misc]
            watch.value(reader, f'refused: plant, {reason}') not in ('', '0')
            for reason in reasons) and watch.value(reader, 'refused: plant, wrong run') == '2',
            f'the refusals of {reader}: {watch.reports.get(reader)}')


def _invent_runs(watch: Watch, recorder: Recorder) -> None:
    runs = (recorder.runs[-1] + 5.0, 2.0**51, 2.0**52 - 1.0)
    watch.publish_frames('test_signal/frame', [_announcement(recorder, run) for run in runs],
                         readers=5)
    for reader in UNITS[1:]:
        watch.until(lambda reader=reader: watch.value(  # type: ignore[misc]
            reader, 'refused: test_signal, wrong run') not in ('', '0'), f'{reader} to refuse')


def _announcement(recorder: Recorder, run: float) -> list[float]:
    """Return frame 0 of a run, as if from test_signal."""
    signals = sum(name.startswith('test_signal/') for name in recorder.observer.names)
    return [run, 0.0, 1e-3, recorder.observer.senders['test_signal'], *[0.5] * (2 * signals)]


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize('exchange', IN_FAULTS, indirect=True)
@pytest.mark.slow
def test_each_node_killed_is_missed_and_started_again_begins_a_new_run(
        exchange: str) -> None:
    with Watch() as watch, Recorder(NAME) as recorder, DriveProcesses(
            on(exchange, {'test_signal': ENDLESS})) as processes:
        watch.until(lambda: _at_step(recorder, processes, 100), 'step 100')
        pids = {unit: processes.process(unit).pid for unit in UNITS}
        for victim in UNITS:
            neighbour = 'motor_1' if victim == 'test_signal' else 'test_signal'
            said = len(processes.log(neighbour))
            processes.kill(victim)
            # The last that was said, for an earlier wait may name it too: a drive that has just
            # begun may wait for the recorder of this test.
            watch.until(lambda: _misses(_named(processes.log(neighbour)), recorder, victim),
                        f'{neighbour} to say that it waits for {victim}')
            watch.until(lambda: _misses(_reported(watch, neighbour), recorder, victim),
                        f'{neighbour} to report that it waits for {victim}')
            runs = len(recorder.runs)
            processes.start(victim)
            watch.until(lambda: _in_a_new_run(watch, recorder, processes, runs),
                        f'a new run with {victim}')
            assert 'going on at step' in processes.log(neighbour)[said:]
        samples = recorder.array()
        assert recorder.runs == sorted(set(recorder.runs))
        survivors = {unit for unit in UNITS if processes.process(unit).pid == pids[unit]}
        codes = processes.stop(signal.SIGTERM)
    assert survivors == set(), 'each was killed once'
    assert_same_bits(samples, in_process(samples.shape[0] - 1, 1e-3))
    assert codes == dict.fromkeys(UNITS, 0)


def _in_a_new_run(watch: Watch, recorder: Recorder, processes: DriveProcesses,
                  runs: int) -> bool:
    """
    Return whether there are more than so many runs, and step 300 of the last one.

    A node that a busy machine has held for a second may not hear the others any more. It says so,
    and is started again as it asks.
    """
    for name, words in watch.told().items():
        if name in UNITS and 'Start this node again' in words:
            del watch.reports[name]
            processes.kill(name)
            processes.start(name)
    return len(recorder.runs) > runs and _at_step(recorder, processes, 300)


# No step of 1 ms is due at this pace for eleven days.
STANDSTILL = 1e-9
INVENTED = 2**52 - 1


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize('exchange', IN_FAULTS, indirect=True)
@pytest.mark.slow
def test_a_run_that_is_invented_while_nothing_moves_is_overruled(exchange: str) -> None:
    """A drive that stands still cannot tell an invention from an announcement, and recovers."""
    with Watch() as watch, Recorder(NAME) as recorder, DriveProcesses(
            on(exchange, {'test_signal': {**ENDLESS, 'run.pace': 1e3}})) as processes:
        watch.until(lambda: _at_step(recorder, processes, 100), 'step 100')
        assert watch.set_together('test_signal', {'run.pace': STANDSTILL}).successful
        watch.until(lambda: _stands_still(watch), 'the last step of all')
        watch.publish_frames('test_signal/frame', [_announcement(recorder, INVENTED)], readers=5)
        watch.until(lambda: watch.value('plant', 'run') == str(INVENTED), 'the invention')
        assert watch.set_together('test_signal', {'run.pace': 0.0}).successful
        watch.until(lambda: recorder.runs[-1] not in (recorder.runs[0], INVENTED)
                    and _at_step(recorder, processes, 300), 'a run of the conductor')
        again = recorder.array()
        codes = processes.stop(signal.SIGTERM)
    assert_same_bits(again, in_process(again.shape[0] - 1, 1e-3))
    assert codes == dict.fromkeys(UNITS, 0)


def _stands_still(watch: Watch) -> bool:
    """Tell whether every unit has made the one step that it makes ahead of the conductor."""
    step = watch.value('test_signal', 'step')
    return watch.value('test_signal', 'pace') == repr(STANDSTILL) and all(
        watch.value(unit, 'step') == str(int(step) + 1) for unit in UNITS[1:])


def _named(log: str) -> list[str]:
    """Return whom a node's log says that it waits for."""
    said = re.findall(
        r'going on at|run \d+ begins|waiting for ([a-z_0-9, ]+) (?:at step|to begin)', log)
    return said[-1].split(', ') if said else []


def _reported(watch: Watch, neighbour: str) -> list[str]:
    """Return whom a node reports that it waits for."""
    status = watch.reports.get(neighbour)
    return (watch.value(neighbour, 'waiting for').split(', ')
            if status is not None and 'at step' in status.message else [])


def _misses(named: Sequence[str], recorder: Recorder, victim: str) -> bool:
    """
    Return whether who waits for these waits for a victim.

    A frame sent while its sender dies reaches some peers only. Those it did not reach stand still
    as well, and the others wait for them: for the recorder of the test perhaps, and for it alone.
    """
    return victim in named or NAME in named and victim in recorder.observer.missing


def _at_step(recorder: Recorder, processes: DriveProcesses, step: int) -> bool:
    processes.check()
    return recorder.steps >= step


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_a_guest_joins_late_at_real_time_pace_and_loses_nothing() -> None:
    with Watch() as watch, DriveProcesses(
            {'test_signal': {'run.pace': 0.5, 'run.step': 2e-3}}) as processes:
        watch.until(lambda: int(watch.value('plant', 'step') or 0) > 1200, 'step 1200')
        with Recorder('guest') as recorder:
            watch.until(lambda: _at_step(recorder, processes, 1500), '1500 steps')
            lost, first, samples = recorder.observer.lost, recorder.first, recorder.array()
    assert not lost
    assert first > 0, 'frame 0 was forgotten long ago'
    assert_same_bits(samples, in_process(first + samples.shape[0] - 1, 2e-3)[first:])


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_two_drives_in_two_namespaces_do_not_meet() -> None:
    circuits = {'/east': ('old_circuit',), '/west': ('new_circuit',)}
    with Watch() as watch, Recorder(NAME, '/east') as east, Recorder(
            NAME, '/west') as west, DriveProcesses(
            {'test_signal': ENDLESS}, config=circuits['/east'],
            namespace='/east') as east_processes, DriveProcesses(
            {'test_signal': ENDLESS}, config=circuits['/west'],
            namespace='/west') as west_processes:
        watch.until(lambda: _at_step(east, east_processes, 1000)
                    and _at_step(west, west_processes, 1000), 'step 1000 of both')
        samples = {'/east': east.array(), '/west': west.array()}
        topics = dict(watch.node.get_topic_names_and_types())
    for namespace, config in circuits.items():
        got = samples[namespace]
        assert_same_bits(got, in_process(got.shape[0] - 1, 1e-3, config))
    for topic in ('clock', 'motor_2/current', 'motor_1/armature_current', 'plant/encoder'):
        assert f'/east/{topic}' in topics
        assert f'/{topic}' not in topics


@pytest.mark.usefixtures('fresh_domain')
def test_the_nodes_end_with_the_process_that_started_them() -> None:
    program = ('from antenna_drive.lockstep.processes import DriveProcesses\n'
               'import sys\n'
               'with DriveProcesses() as processes:\n'
               '    print(*(processes.process(unit).pid for unit in processes.order))\n'
               '    sys.stdout.flush()\n'
               '    sys.stdin.read()\n')
    parent = subprocess.Popen([sys.executable, '-c', program], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pids = [int(word) for word in parent.stdout.readline().split()]
    assert len(pids) == len(UNITS)
    parent.kill()
    parent.wait()
    with Watch() as watch:
        watch.until(lambda: not any(_alive(pid) for pid in pids), 'the end of all')


def _alive(pid: int) -> bool:
    try:
        state = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0]
    except OSError:
        return False
    return state not in 'ZX'


@pytest.mark.slow
def test_the_check_command_finds_no_difference(fresh_domain: int) -> None:
    done = subprocess.run(
        [sys.executable, '-m', 'antenna_drive', 'lockstep-check', '--duration', '0.5',
         '--step', '0.004', '--json', '-'], capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result['processes'] == 5
    assert result['max_abs_difference'] == 0.0
    assert result['samples'] == 126 * 2 * in_process(1, 4e-3).shape[1]
