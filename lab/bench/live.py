# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The live page in a real browser: how soon it shows the drive, turns it, and what it costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any

from antenna_drive.emulator.wiring import TEST_SIGNAL
from lab.bench import measuring
from lab.bench.chromium import EXECUTABLE, Page
from lab.campaign.domains import claimed_domain
from simgap.errors import UserError

_PATIENCE_S = 120.0
_END_S = 20.0
# Half of the parameter's range, there and back.
_SLIDE = """
window.took = null;
(async () => {
  const slider = document.querySelector('[data-name="bias_pot"] input[type="range"]');
  const took = [];
  for (let n = 0; n < %d; n++) {
    const began = performance.now();
    slider.value = n %% 2 ? 0.8 : 0.6;
    slider.dispatchEvent(new Event('input'));
    await antennaDrive.link.answers();
    took.push(performance.now() - began);
  }
  window.took = took;
})();
"""


def measure(repetitions: int, quick: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """
    Measure with a headless Chromium; raise UserError where there is none.

    first_curve_s: from the command to the first moving curve; slider_ms: from a slider to the
    answer that its change is in force; rate_share and rate_share_paced: rate of the drive with the
    page over that without, as fast as possible and at real time; lost_steps, server_growth_MB and
    page_growth_MB: during open_s, at real time.
    """
    if EXECUTABLE is None:
        raise UserError('chromium is not installed')
    with claimed_domain() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        progress('start')
        result: dict[str, Any] = {'first_curve_s': measuring.figure(
            [_first_curve() for _ in range(2 if quick else repetitions)], 's')}
        progress('slider, memory')
        # the charts fill in the first minute
        result |= _open_for(20.0, 20, 1.0) if quick else _open_for(600.0, 100, 65.0)
        for name, pace in (('rate_share_paced', 1.0), ('rate_share', 0.0)):
            progress(f'rate at pace {pace:g}')
            result[name] = _rate_share(pace, 5.0 if quick else 20.0, 2 if quick else repetitions)
    return result


@contextmanager
def _command(*arguments: str) -> Iterator[tuple[str, int]]:
    """Run the command; give its address and the number of its process."""
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [sys.executable, '-m', 'antenna_drive', 'live', '--port', '0', *arguments],
            cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert process.stdout is not None
        try:
            said = process.stdout.readline().split()
            if not said:
                raise UserError('antenna-drive live has not started')
            yield said[0], process.pid
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(_END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            process.stdout.close()


@contextmanager
def _page(url: str) -> Iterator[Page]:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, \
            Page(Path(profile), 1400, 900) as page:
        page.open(url)
        page.until('antennaDrive.samples.time > 0.1', _PATIENCE_S)
        yield page


def _first_curve() -> float:
    began = time.monotonic()
    with _command() as (url, _), _page(url):
        return time.monotonic() - began


def _open_for(open_s: float, slides: int, after_s: float) -> dict[str, Any]:
    with _command() as (url, number), _page(url) as page:
        page.until('document.querySelector(\'[data-name="bias_pot"] input\')', _PATIENCE_S)
        page.tell(_SLIDE % slides)
        took = page.until('window.took', _PATIENCE_S)
        page.until(f'antennaDrive.samples.time > {after_s}', _PATIENCE_S)
        server, heap = _resident_MB(number), page.heap_MB()
        pictures = page.tell('antennaDrive.samples.arrived')
        time.sleep(open_s)
        pictures = page.tell('antennaDrive.samples.arrived') - pictures
        return {
            'slider_ms': measuring.figure(took, 'ms'),
            'open_s': open_s,
            'pictures_per_s': measuring.figure([pictures / open_s], '1/s'),
            'server_growth_MB': measuring.figure([_resident_MB(number) - server], 'MB'),
            'page_growth_MB': measuring.figure([page.heap_MB() - heap], 'MB'),
            'lost_steps': measuring.figure([page.tell('antennaDrive.run.lost')]),
        }


def _rate_share(pace: float, window_s: float, repetitions: int) -> measuring.Figure:
    from antenna_drive.lockstep.processes import DriveProcesses
    with_page, without = [], []
    with DriveProcesses({TEST_SIGNAL: {'run.pace': pace}}, placed=False), _Steps() as steps:
        steps.rate(1.0)
        for _ in range(repetitions):
            without.append(steps.rate(window_s))
            with _command('--join') as (url, _), _page(url):
                with_page.append(steps.rate(window_s))
    return measuring.ratio(with_page, without)


class _Steps:
    """How fast a drive makes steps, as its conductor says once a second in /diagnostics."""

    def __init__(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        context = Context()
        context.init(args=[])
        self._node = Node('bench_live', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._said: list[tuple[float, int]] = []
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 50)

    def _hear(self, message: Any) -> None:
        for status in message.status:
            values = {item.key: item.value for item in status.values}
            if status.name == f'/{TEST_SIGNAL}' and int(values.get('step', 0)) > 0:
                stamp = message.header.stamp
                self._said.append((stamp.sec + 1e-9 * stamp.nanosec, int(values['step'])))

    def rate(self, window_s: float) -> float:
        """Return the steps per second of wall time over at least `window_s` [s]."""
        self._said.clear()
        end = time.monotonic() + window_s + _PATIENCE_S
        while len(self._said) < 2 or self._said[-1][0] - self._said[0][0] < window_s:
            if time.monotonic() > end:
                raise UserError('the drive makes no steps')
            self._executor.spin_once(timeout_sec=0.2)
        (began, first), (ended, last) = self._said[0], self._said[-1]
        return (last - first) / (ended - began)

    def __enter__(self) -> _Steps:
        return self

    def __exit__(self, *error: object) -> None:
        from antenna_drive.lockstep.leaving import leave
        self._executor.shutdown()
        leave(self._node)


def _resident_MB(number: int) -> float:
    """Return the memory of a process (Linux)."""
    pages = int(Path(f'/proc/{number}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 2**20
