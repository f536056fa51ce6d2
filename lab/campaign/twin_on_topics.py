# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What the twin's node says of a simulated test that is played to it on topics, at real time.

`campaign.twin_proving.watched` gives the same test to the core of the twin, faster and without ROS
2. Here the player, the twin and whoever listens are processes in a ROS 2 domain of their own.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, ExitStack
import os
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import Any

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.lockstep.entry import choose_transport
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.csv_format import write_csv
from antenna_drive.twin.watch import GAP
from lab.campaign.domains import claimed_domain
from lab.campaign.rig import Diagnostics, PATIENCE_S, Said
from lab.campaign.twin_proving import recording_of
from simgap.logs.channel import NANOSECONDS
from std_msgs.msg import Float64
import yaml

REAL = 'real'
_LOOK_S = 0.1
_END_S = 20.0


def watched_on_topics(columns: Mapping[str, FloatArray], sheet: Mapping[str, Any],
                      onset_s: float, alarms_per_day: float) -> dict[str, Any]:
    """
    Return what the twin's node says of a test in which an effect is switched on.

    Columns are those of the recording by name, NaN where there is no sample; `sheet` is plain
    data. `onset_s` is the end of the test if no effect is switched on. The result is that of
    `twin_proving.watched`; its times are those at which the words came. Raise RuntimeError
    where the twin ended before its time, or nothing came of it or of the player.
    """
    with ExitStack() as stack:
        stack.enter_context(_own_domain())
        folder = Path(stack.enter_context(TemporaryDirectory()))
        write_csv(recording_of(columns, sheet), folder / 'real.csv')
        (folder / 'sheet.yaml').write_text(yaml.safe_dump(dict(sheet)), encoding='utf-8')
        said = Diagnostics()
        stack.callback(said.close)
        began: list[tuple[float, int]] = []

        def begin(message: Float64, info: Any) -> None:
            if not began:
                began.append((time.monotonic(), info['source_timestamp']))

        said.node.create_subscription(Float64, f'{REAL}/{RATE_COMMAND}', begin, 10)
        twin = stack.enter_context(_program(
            'twin', '--ros-args', '-p', f'real:={REAL}', '-p', f'sheet:={folder / "sheet.yaml"}',
            '-p', f'alarms_per_day:={alarms_per_day:f}'))
        _until(lambda: said.last('twin') is not None, twin, PATIENCE_S)
        player = stack.enter_context(_program(
            'recording_player', str(folder / 'real.csv'), '--ros-args', '-p', f'real:={REAL}'))
        _until(lambda: bool(began), twin, PATIENCE_S)
        zero_s, zero_ns = began[0]

        def heard() -> dict[str, Any]:
            return told(list(said.said), zero_s, zero_ns, onset_s)

        _until(lambda: player.poll() is not None or heard()['told_after_s'] is not None,
               twin, float(columns['time_s'][-1]) + PATIENCE_S)
        return heard()


def told(said: Sequence[Said], zero_s: float, zero_ns: int, onset_s: float) -> dict[str, Any]:
    """
    Return what a twin has said until the first gap after the onset, as `twin_proving.watched`.

    The test began at `zero_s` of time.monotonic() and at `zero_ns` by the stamps of its samples;
    the effect was switched on `onset_s` after that.
    """
    alarms: list[dict[str, Any]] = []
    first: dict[str, Any] = {'told_after_s': None, 'since_s': None, 'gaps': []}
    before = ''
    values: Mapping[str, str] = {}
    for item in said:
        if item.node != 'twin':
            continue
        values = item.values
        if values['state'] == GAP and before != GAP:
            gaps = [value for key, value in values.items() if key.startswith('gap ')]
            at_s = item.time_s - zero_s
            if at_s < onset_s:
                alarms.append({'time_s': at_s, 'gaps': gaps})
            else:
                since = min(float(gap.rpartition('since stamp ')[2].removesuffix(' s'))
                            for gap in gaps)
                first = {'told_after_s': at_s - onset_s, 'gaps': gaps,
                         'since_s': since - zero_ns / NANOSECONDS - onset_s}
                break
        before = values['state']
    return {'alarms': alarms, **first, 'tuning': values['tuning'],
            'judged': int(values['blocks judged']),
            'unjudged': int(values['blocks not judged'].split()[0])}


@contextmanager
def _own_domain() -> Iterator[None]:
    """Put this process, and what it starts, into a ROS 2 domain that nobody else uses."""
    before = dict(os.environ)
    choose_transport(os.environ)
    with claimed_domain() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)


@contextmanager
def _program(module: str, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run one of the package's nodes; end it in the end."""
    process = subprocess.Popen(
        [sys.executable, '-m', f'antenna_drive.nodes.{module}', *arguments],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _until(reached: Callable[[], bool], twin: subprocess.Popen[bytes], patience_s: float) -> None:
    end = time.monotonic() + patience_s
    while not reached():
        if twin.poll() is not None:
            raise RuntimeError(f'the twin ended with exit code {twin.returncode}')
        if time.monotonic() > end:
            raise RuntimeError(f'in vain for {patience_s:.0f} s: the twin or the player')
        time.sleep(_LOOK_S)
