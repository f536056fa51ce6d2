# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Kill the commands that start nodes at random moments; no process may be left."""

from collections.abc import Mapping
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any

from lab.campaign import leftovers
from lab.campaign.trials import Outcome

WAYS = {signal.SIGKILL: -9, signal.SIGTERM: -15, signal.SIGINT: 130}
END_S = 10.0


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Start one command, strike it, and look for what it has left."""
    outcome = Outcome()
    number = rng.choice(list(WAYS))
    after_s = rng.uniform(0.2, 9.0)
    with tempfile.TemporaryDirectory() as folder:
        command = rng.choice([
            ['record', '--duration', '600', '--out', f'{folder}/run'],
            ['record', '--duration', '600', '--pace', '1', '--out', f'{folder}/run'],
            ['lockstep-check', '--duration', '600']])
        detail = {'command': command, 'signal': number.name, 'after_s': after_s}
        outcome.figures.update(detail)
        outcome.count('kills')
        outcome.count('kills_of_parents')
        token = f'{os.getpid()}-{time.time_ns()}'
        with (Path(folder) / 'said').open('w+') as said:
            parent = subprocess.Popen(
                [sys.executable, '-m', 'antenna_drive', *command], stdout=said, stderr=said,
                env={**os.environ, leftovers.TOKEN: token}, start_new_session=True)
            time.sleep(after_s)
            parent.send_signal(number)
            try:
                code: int | None = parent.wait(END_S + 10.0)
            except subprocess.TimeoutExpired:
                code = None
                outcome.find(f'{command[0]} does not end after {number.name}', 'hangs', **detail)
            found = leftovers.wait_for_none(token, END_S)
            if found:
                outcome.find(f'{len(found)} processes are left after {number.name} to '
                             f'{command[0]}', 'orphans',
                             processes=leftovers.commands(found), **detail)
                leftovers.end(found)
            said.seek(0)
            text = said.read()
        if 'Traceback' in text:
            outcome.find(f'a traceback of {command[0]}', 'tracebacks', text=text[-3000:], **detail)
        # before Python handles signals, they end the process as they end any
        if code is not None and code not in (WAYS[number], -int(number)):
            outcome.find(f'{command[0]} ended with {code} after {number.name}', 'wrong_exits',
                         text=text[-1000:], **detail)
    return outcome
