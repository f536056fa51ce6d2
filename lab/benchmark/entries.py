# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Run any command on the cases, one after the other, and score what it says beside other commands.

A command gets a copy of a case, in a folder of its own: neither truths nor what is kept back are
near it. What it said of a case is a line of the results, so a run that was stopped goes on.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations
import math
import os
from pathlib import Path
import shutil
import signal
import subprocess
from tempfile import TemporaryDirectory
from threading import Timer
from typing import Any

from lab.antenna.cases import Truth
from lab.antenna.wild_programme import KEPT_BACK
from lab.benchmark.cases import PRACTICE
from lab.trials import batch, sealing
from lab.trials.driver import Arm, complete, Done, Row
from lab.trials.held_back import closed_fraction, PredictionError
from lab.trials.results import TrialResults
from lab.trials.scorecard import auroc, Case, score
from lab.trials.verdict import content_of, parse_verdict, read_verdict, UNKNOWN, VerdictError
import numpy as np
from scipy.stats import binomtest
from simgap.errors import UserError

PREDICTED, TRUTH = 'predicted.csv', 'truth.json'    # the truth of a practice case
RESAMPLED = 1000            # times, for the interval of an AUROC


def make(folder: Path, count: int, seed: int, machines: Sequence[str], practice: bool, jobs: int,
         done: Done) -> dict[str, Any]:
    """Seal and record the cases; practice cases hold their truths. Return the manifest."""
    manifest = batch.prepare(folder, count, seed + PRACTICE * practice, 0.0, 0.0, 0.0,
                             machines=machines)
    batch.make_cases(folder, manifest, jobs, done)
    if practice:
        for name in manifest['seals']:
            shutil.copy(folder / sealing.TRUTHS / f'{name}.json', folder / name / TRUTH)
    return manifest


def enter(folder: Path, command: Sequence[str], out: Path, limit: float, jobs: int,
          done: Done) -> int:
    """Let a command, for `limit` [s], answer what `out` has no verdict of; return the failures."""
    manifest = sealing.read_manifest(folder)
    results = TrialResults(folder, manifest, out)
    complete(list(manifest['seals']), partial(sealing.open_truth, folder, manifest=manifest),
             [Arm(lambda name, row: 'verdict' not in row,
                  partial(_entered, folder, command, limit))],
             results, jobs=jobs, threads=True, done=done)
    return sum('verdict' not in results[name] for name in manifest['seals'])


def _entered(folder: Path, command: Sequence[str], limit: float, truth: Truth) -> Row:
    """Return what a command says of a case."""
    with TemporaryDirectory() as place:
        case, said = Path(place) / truth['case'], Path(place) / 'said.txt'
        shutil.copytree(folder / truth['case'], case, ignore=shutil.ignore_patterns(
            TRUTH, batch.VERDICT, PREDICTED))
        row: dict[str, Any] = {'closed': None, 'failure': ''}
        row['seconds'] = round(_run([*command, str(case)], said, limit), 2)
        try:
            row['verdict'] = content_of(read_verdict(case / batch.VERDICT))
            if (case / PREDICTED).exists():
                kept = folder / batch.KEPT / truth['case']
                closed = closed_fraction(kept / f'{KEPT_BACK}.csv',
                                         kept / batch.PREDICTIONS['before'], case / PREDICTED,
                                         truth)
                row['closed'] = closed if math.isfinite(closed) else None
        except (VerdictError, PredictionError) as error:
            told = said.read_text(encoding='utf-8', errors='replace').strip()
            row['failure'] = f'{str(error).replace(place, "")}\n{told[-2000:]}'
        return row


def _run(command: Sequence[str], said: Path, limit: float) -> float:
    """Run a command for `limit` [s] at most; return the seconds of processors that it took."""
    with open(said, 'wb') as stream:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=stream,
                                       stderr=stream, start_new_session=True)
        except OSError as error:
            raise UserError(f'--entry {command[0]}: cannot be started, {error}; give a command '
                            'that takes the folder of a case') from error
        # the command and its children are a group of their own
        late = Timer(limit, os.killpg, (process.pid, signal.SIGKILL))
        late.start()
        _, status, used = os.wait4(process.pid, 0)
        late.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime


def answered(folder: Path, results: Path) -> list[Case]:
    """Return the cases of which a file of results has a line; seals are checked."""
    if not results.exists():
        raise UserError(f'{results}: no such file; lab benchmark --entry CMD --out writes one')
    manifest = sealing.read_manifest(folder)
    found, cases = TrialResults(folder, manifest, results), []
    for name in found:
        row, verdict = found[name], None
        if 'verdict' in row:
            try:
                verdict = parse_verdict({**row['verdict'], 'seconds': row.get('seconds')})
            except VerdictError as error:
                raise UserError(f'{results}: {name}: {error}; remove the line') from None
        closed = row.get('closed')
        cases.append(Case(sealing.open_truth(folder, name, manifest), verdict,
                          math.nan if closed is None else float(closed)))
    return cases


def table(methods: Mapping[str, Sequence[Case]]) -> dict[str, Any]:
    """
    Return the scores of each method, with `auroc_ci95`, and `pairs`: two on the same cases.

    A pair has how many `both` have right, `first` alone and `second` alone, and `p`, of an exact
    test of McNemar (Psychometrika 12, 1947).
    """
    figures = {name: {**score(cases), 'auroc_ci95': _auroc_interval(cases)}
               for name, cases in methods.items()}
    pairs = []
    for one, other in combinations(methods, 2):
        right = {case.truth['case']: case.right for case in methods[one]}
        seen = [(right[case.truth['case']], case.right) for case in methods[other]
                if case.truth['case'] in right]
        both, first, second = map(seen.count, ((True, True), (True, False), (False, True)))
        p = float(binomtest(first, first + second).pvalue) if first + second else 1.0
        pairs.append({'names': [one, other], 'cases': len(seen), 'both': both, 'first': first,
                      'second': second, 'p': p})
    return {'methods': figures, 'pairs': pairs}


def _auroc_interval(cases: Sequence[Case]) -> tuple[float, float]:
    """Return the 95 percent interval of unknown's AUROC, by cases drawn again; or nan."""
    groups = [[case.verdict.probability_of(UNKNOWN) for case in cases
               if case.verdict and (case.kind == 'outside') == side] for side in (True, False)]
    if not all(groups):
        return math.nan, math.nan
    random = np.random.default_rng(0)
    drawn = [auroc(*(random.choice(group, len(group)).tolist() for group in groups))
             for _ in range(RESAMPLED)]
    low, high = np.quantile(drawn, (0.025, 0.975))
    return float(low), float(high)
