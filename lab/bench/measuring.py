# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Interleaved measurements, so that other load on the machine affects all of them equally."""

from collections.abc import Callable, Mapping, Sequence
import gc
import os
from pathlib import Path
import platform
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np
from simgap.errors import UserError

Figure = dict[str, Any]


def figure(values: Sequence[float], unit: str = '1') -> Figure:
    """Return median, minimum, maximum and the single values of a measurement."""
    return {'median': float(np.median(values)), 'min': float(min(values)),
            'max': float(max(values)), 'unit': unit, 'values': [float(v) for v in values]}


def ratio(above: Sequence[float], below: Sequence[float]) -> Figure:
    """Return the figure of the ratios of two values from the same turn."""
    return figure([a / b for a, b in zip(above, below, strict=True)])


def in_turn(work: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, list[float]]:
    """
    Time each piece of work once per turn, A B A B, after one warm-up turn.

    Return the wall times [s] by name, one for each of `repetitions` turns.
    """
    for piece in work.values():
        piece()
    times: dict[str, list[float]] = {name: [] for name in work}
    gc.collect()
    for _ in range(repetitions):
        for name, piece in work.items():
            began = time.perf_counter()
            piece()
            times[name].append(time.perf_counter() - began)
    return times


def process(module: str, *arguments: str) -> tuple[float, float, float]:
    """
    Run a module; return its wall time [s], processor time [s] and peak memory [MB].

    Raise UserError, with the module's last line, where it fails.
    """
    began = time.monotonic()
    with tempfile.TemporaryFile() as log:
        child = subprocess.Popen([sys.executable, '-m', module, *arguments],
                                 stdout=log, stderr=log, stdin=subprocess.DEVNULL)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        wall_s = time.monotonic() - began
        if child.returncode:
            log.seek(0)
            said = log.read().decode(errors='replace').strip().splitlines() or ['nothing said']
            raise UserError(f'{module} {" ".join(arguments[:1])}: {said[-1]}')
    return wall_s, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0


def machine() -> dict[str, Any]:
    """Return processor, system, versions and present load of the machine."""
    from importlib import metadata

    versions = {}
    for name in ('numpy', 'numba', 'scipy', 'control', 'pathsim', 'drake', 'distributed',
                 'ros-rclpy'):
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return {'processor': _processor(), 'cores': os.cpu_count(),
            'system': platform.platform(terse=True), 'python': platform.python_version(),
            'versions': versions, 'load_average': list(os.getloadavg())}


def _processor() -> str:
    try:
        lines = Path('/proc/cpuinfo').read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(':')[2].strip() for line in lines
                 if line.startswith('model name')), platform.machine())
