# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Two drives in one domain: each recording holds its own drive's bits, or is refused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, ExitStack
from pathlib import Path
import random
import re
import signal
import subprocess
import sys
import time
from typing import Any

from antenna_drive.cli import main
from antenna_drive.emulator.run import simulate
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import Drive
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drives to test')

from antenna_drive.cli import record  # noqa: E402, I100
from antenna_drive.lockstep import sampling  # noqa: E402
from antenna_drive.lockstep.leaving import leave  # noqa: E402
from antenna_drive.lockstep.namespaces import AnotherDrive, drive_namespace  # noqa: E402
from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402
from antenna_drive.recording.bag_reader import read_bag  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.node import Node  # noqa: E402

CIRCUITS = ('old_circuit', 'new_circuit')
# without a waveform both circuits give the same currents
SAW_TOOTH = ('test_signal.waveform=saw_tooth', 'test_signal.amplitude=0.01196',
             'test_signal.period=1')
OWN, REFUSED = 'its own bits', 'refused'


class Recording:
    """A run of `antenna-drive record` as a user of this machine types it."""

    def __init__(self, folder: Path, circuit: str, duration: float, *options: str) -> None:
        self.out, self._circuit, self._duration = folder / circuit, circuit, duration
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'antenna_drive', 'record', '--duration', f'{duration:g}',
             '--out', str(self.out), '--config', circuit, '--quiet', *options,
             '--set', *SAW_TOOTH], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def outcome(self) -> str:
        """Wait for its end; say what has come of it, which is OWN, REFUSED or a fault."""
        said, refusal = self._process.communicate()
        if self._process.returncode == 1 and refusal.count('\n') == 1:
            return REFUSED
        if self._process.returncode:
            return f'exit {self._process.returncode}: {refusal}'
        rows = round(self._duration / 1e-3) + 1
        recording = read_bag(self.out)
        own = simulate(_drive(self._circuit), self._duration)
        same = all(np.array_equal(recording[name].values, own[name]) for name in own.names)
        if not said.startswith(f'{rows} steps') or not same:
            return f'another drive: {said}'
        return OWN


def _drive(circuit: str) -> Drive:
    from antenna_drive.cli.options import parse_settings
    from antenna_drive.emulator.units import overridden
    return overridden(load(circuit), parse_settings(SAW_TOOTH))


def pair(folder: Path, duration: float, apart_s: float, *options: str) -> list[str]:
    """Return what comes of two recordings that are begun one after the other."""
    folder.mkdir()
    first = Recording(folder, CIRCUITS[0], duration, *options)
    time.sleep(apart_s)
    second = Recording(folder, CIRCUITS[1], duration, *options)
    return [first.outcome(), second.outcome()]


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_two_recordings_begun_together_hold_each_its_own_drive(tmp_path: Path) -> None:
    assert pair(tmp_path / 'pair', 1.0, 0.0) == [OWN, OWN]


@pytest.mark.trial
@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize('options', [(), ('--namespace', '/east')])
def test_twenty_pairs_begun_at_random_moments(tmp_path: Path, options: tuple[str, ...]) -> None:
    rng = random.Random(53)
    found: Counter[str] = Counter()
    for number in range(20):
        found.update(pair(tmp_path / f'{number}', 5.0, rng.uniform(0.0, 1.5), *options))
        print(dict(found), flush=True)
    assert set(found) <= {OWN, REFUSED}
    assert found[OWN] >= (20 if options else 40)


@contextmanager
def node_called(name: str, namespace: str) -> Iterator[None]:
    """Let a node be there that somebody has started by hand."""
    context = Context()
    context.init(args=[])
    node = Node(name, namespace=namespace, context=context)
    try:
        yield
    finally:
        leave(node)


@pytest.mark.usefixtures('fresh_domain')
def test_a_namespace_with_a_drive_is_refused_in_one_line(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / 'run'
    typed = ['record', '--duration', '1', '--out', str(out), '--namespace', 'east']
    # nodes that somebody has started by hand are seen; of a drive that has yet to start its nodes
    # nothing is to be seen
    for there in (node_called('plant', '/east'), drive_namespace('/east', 'record')):
        with there:
            assert main(typed) == 1
        said = capsys.readouterr().err
        assert said.startswith('antenna-drive record: a drive runs already in namespace /east of ')
        assert 'plant' in said
        assert said.endswith('end it, or choose another with --namespace\n')
        assert said.count('\n') == 1
    assert not out.exists()
    with node_called('plant', '/east'), drive_namespace('/', 'live') as space:
        assert space == ''
    with drive_namespace(None, 'record') as one, drive_namespace(None, 'record') as other:
        assert one != other
        assert one.startswith('/record_')


@pytest.mark.usefixtures('fresh_domain')
def test_a_live_page_beside_a_drive_names_the_way_to_join(
        capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('tornado', reason='tornado is not installed')
    with node_called('motor_1', ''):
        assert main(['live', '--port', '0']) == 1
    said = capsys.readouterr().err
    assert said.count('\n') == 1
    assert 'namespace / of ' in said
    assert said.endswith('or show it with --join\n')


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.slow
def test_a_recorder_of_two_drives_names_both_and_ends_with_1(tmp_path: Path) -> None:
    with ExitStack() as stack:
        for circuit in CIRCUITS:
            stack.enter_context(DriveProcesses(config=[circuit]))
        recorder = subprocess.Popen(
            [sys.executable, '-m', 'antenna_drive.nodes.recorder', '--ros-args', '-p',
             f'out:={tmp_path / "run"}'], stderr=subprocess.PIPE, text=True)
        assert recorder.stderr is not None
        lines = iter(recorder.stderr.readline, '')
        said = next(line for line in lines if 'two nodes are called ' in line)
        recorder.send_signal(signal.SIGINT)
        recorder.communicate()
    assert re.search(r'processes \d+ and \d+; end one of them', said)
    assert recorder.returncode == 1


@contextmanager
def no_look(given: str | None, *others: object) -> Iterator[str]:
    """Look for no other drive, as where it is on another machine, or comes later."""
    yield given or ''


@pytest.mark.usefixtures('fresh_domain')
@pytest.mark.parametrize('begun', ['before', 'after'])
@pytest.mark.slow
def test_who_meets_another_drive_all_the_same_is_told(
        tmp_path: Path, begun: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The frames tell: their senders are no processes of the drive, or two have one name."""
    monkeypatch.setattr('antenna_drive.lockstep.namespaces.drive_namespace', no_look)
    other = DriveProcesses({'test_signal': {'run.pace': 0.0}}, config=['new_circuit'])
    complete = sampling.RunWatch.complete

    def beside(watch: sampling.RunWatch, *arguments: Any) -> bool:
        if watch.done >= 0 and not there:
            there.append(stack.enter_context(other))
        return complete(watch, *arguments)

    with ExitStack() as stack:
        there = [stack.enter_context(other)] if begun == 'before' else []
        monkeypatch.setattr(sampling.RunWatch, 'complete', beside)
        with pytest.raises(AnotherDrive, match='processes? \\d+|nodes are called'):
            record.record_drive({}, ['old_circuit'], tmp_path / 'run', None, 1000.0, quiet=True)
    assert AnotherDrive.status == 1
