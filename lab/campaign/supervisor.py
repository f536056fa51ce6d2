# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Does the trials of a campaign, each in a process of its own.

They are done one after the other, but for those that may run beside one another.
Each outcome is a line of OUT/outcomes.jsonl. A campaign that is started again with the same OUT
leaves out the trials that are there already.
"""

from collections.abc import Callable, Sequence
from itertools import groupby
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any

from antenna_drive.workers import workers
from lab.campaign import leftovers
from lab.campaign.domains import claimed_domain
from lab.campaign.trials import Outcome, SIDE_BY_SIDE, Trial
from simgap.errors import UserError

OUTCOMES, SETTINGS = 'outcomes.jsonl', 'campaign.json'
# How long what a trial has started may take to end with it [s].
END_S = 8.0


class Campaign:
    """A campaign and its folder; `outcomes` has what is done, by the id of the trial."""

    def __init__(self, folder: Path, settings: dict[str, Any]) -> None:
        """Open a folder, or make it; UserError if it has other settings or cannot be written."""
        self.folder = folder
        self.settings = settings
        self.outcomes: dict[str, dict[str, Any]] = {}
        path = folder / SETTINGS
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                path.write_text(json.dumps(settings) + '\n', encoding='utf-8')
            known = json.loads(path.read_text(encoding='utf-8'))
        except OSError as error:
            raise UserError(f'{folder}: cannot be written, {error.strerror}') from error
        except (ValueError, RecursionError) as error:
            raise UserError(f'{path}: no JSON, {error}; choose another folder') from None
        if known != settings:
            raise UserError(f'{folder}: holds a campaign with {json.dumps(known)}; continue it '
                            'with these settings, or choose another folder')
        log = folder / OUTCOMES
        for line in log.read_text(encoding='utf-8').splitlines() if log.exists() else ():
            try:
                entry = json.loads(line)
                self.outcomes[entry['id']] = entry
            except (ValueError, KeyError, TypeError):
                continue  # cut short when the campaign was interrupted: the trial is done again

    def do(self, trials: Sequence[Trial], told: Callable[[Trial, dict[str, Any]], None],
           jobs: int = 1) -> None:
        """
        Do the trials that are not done in their order; `told` gets the outcome of each.

        `jobs` of those of a part in SIDE_BY_SIDE are done at once.
        """
        ahead = [trial for trial in trials if trial.label not in self.outcomes]
        for together, group in groupby(ahead, lambda trial: trial.part in SIDE_BY_SIDE):
            if together:
                part = list(group)
                with workers(jobs, threads=True) as pool:
                    for number, outcome in pool.each(self.one, ((trial,) for trial in part)):
                        self._keep(part[number], outcome(), told)
            else:
                for trial in group:
                    self._keep(trial, self.one(trial), told)

    def _keep(self, trial: Trial, entry: dict[str, Any],
              told: Callable[[Trial, dict[str, Any]], None]) -> None:
        self.outcomes[trial.label] = entry
        with (self.folder / OUTCOMES).open('a', encoding='utf-8') as log:
            # a line of its own, whatever an interruption has left
            log.write(('\n' if log.tell() else '') + json.dumps(entry))
        told(trial, entry)

    def one(self, trial: Trial) -> dict[str, Any]:
        """Do one trial; return its outcome with its id, seed, options, load and duration."""
        seed = trial.seed(self.settings['seed'])
        token = f'{os.getpid()}-{time.time_ns()}'
        began = time.monotonic()
        with claimed_domain() as domain, tempfile.TemporaryDirectory() as folder:
            target = Path(folder, 'outcome.json')
            process = subprocess.Popen(
                [sys.executable, '-W', 'ignore', '-m', 'lab.campaign', trial.part,
                 trial.name, str(seed), json.dumps(dict(trial.options)), str(target)],
                env={**os.environ, leftovers.TOKEN: token, 'ROS_DOMAIN_ID': str(domain)},
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                start_new_session=True)
            outcome = Outcome()
            try:
                _, said = process.communicate(timeout=trial.patience_s)
                outcome = _read(target, process.returncode, said)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                outcome.find(f'the trial does not end within {trial.patience_s:g} s', 'hangs')
            finally:
                if process.poll() is None:
                    process.send_signal(signal.SIGTERM)
                left = leftovers.wait_for_none(token, END_S)
                commands = leftovers.commands(left)
                leftovers.end(left)
            for pid, command in commands.items():
                outcome.find(f'a process is left: {pid}: {command}', 'orphans')
        return {'id': trial.label, 'seed': seed, 'options': dict(trial.options),
                'wall_s': round(time.monotonic() - began, 1),
                'load': round(os.getloadavg()[0], 1), 'counts': outcome.counts,
                'figures': outcome.figures, 'findings': outcome.findings,
                'skipped': outcome.skipped}


def _read(target: Path, code: int, said: bytes) -> Outcome:
    try:
        return Outcome(**json.loads(target.read_text(encoding='utf-8')))
    except (OSError, ValueError):
        outcome = Outcome()
        outcome.find(f'the trial ended with {code} without an outcome', 'tracebacks',
                     said=said.decode(errors='replace')[-3000:])
        return outcome
