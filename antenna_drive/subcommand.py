# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""An antenna-drive command in a process of its own, with limits on its time and memory."""

from collections.abc import Sequence
import math
import os
import subprocess
import sys

from simgap.command.programs import PARENT


def run_command(words: Sequence[str], limit_s: float = math.inf, memory_MB: float = math.inf,
                program: str = 'antenna_drive') -> str:
    """
    Run a command of this installation; return what it said, for the case that it failed.

    The process ends with this one.

    words : the command and its arguments
    limit_s : time after which it is ended [s]
    memory_MB : what it may ask for; if it asks for more, it fails (Linux)
    program : the module that has the command

    Returns its exit code and what it wrote to standard error, or that its time was up.
    """
    with subprocess.Popen(
            [sys.executable, '-m', program, *words], stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            env={**os.environ, PARENT: str(os.getpid())}) as process:
        if math.isfinite(memory_MB) and sys.platform.startswith('linux'):
            import resource
            most = int(memory_MB * 2**20)
            resource.prlimit(process.pid, resource.RLIMIT_DATA, (most, most))
        try:
            _, said = process.communicate(
                timeout=limit_s if math.isfinite(limit_s) else None)
        except subprocess.TimeoutExpired:
            process.kill()
            return f'no result after {limit_s:g} s'
        except BaseException:
            process.kill()
            raise
    return f'exit code {process.returncode}\n' + said.decode(errors='replace')
