# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What is said of a case without its true effect in the catalogue: the answer must become 'unknown'.

Of a diagnosed trial the cases with a single effect that was named first are diagnosed again, each
with that effect left out, its entries for other places, and what becomes it at an end of its
range. The catalogue is then wrong on purpose, as it is for a machine whose fault nobody listed.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from lab.antenna.programme import RECORDINGS
from lab.trials.batch import diagnose_recordings, model_options
from lab.trials.driver import Arm, complete, Done, Row
from lab.trials.scorecard import Case, OVERCONFIDENT, rate, read_cases
from lab.trials.scored_cases import read_scored_of
from lab.trials.verdict import read_verdict, UNKNOWN, VerdictError
import numpy as np
from simgap.errors import UserError

WITHOUT = 'without.json'
RISE = 0.5                  # of the probability of 'unknown', in a case that counts as recognised


def run_trial(folder: Path, wanted: int, jobs: int, limit: float, options: Sequence[str] = (),
              done: Done = lambda part, total: None,
              scored: Path | None = None) -> dict[str, Any]:
    """
    Diagnose the first `wanted` cases of a trial again without their true effects.

    The trial is diagnosed at least in part, or drawn again; first answers are those in its folder
    or in `scored`, a file of `lab score --cases`. Each diagnosis may take `limit` [s]. `done` gets
    the number of complete cases, and their total.

    Return `cases`, one entry each with `case`, `effect`, `unknown_before`, `unknown_after`, and
    `named` with its `probability`, the first answer without the effect; `failures`; `median_rise`
    and `mean_rise` of the probability of 'unknown'; `recognised` with `ci95`, the share of cases
    in which it rises by RISE or more; `named_wrongly` with its interval, the share in which
    something else is named above OVERCONFIDENT.

    Raise UserError where no case has a single effect that was named first, or the file is of other
    cases; SealError where a truth is missing or was changed.
    """
    answered = read_cases(folder)[0] if scored is None else read_scored_of(scored, folder)
    cases = [case for case in answered if case.truth['kind'] == 'single' and case.right][:wanted]
    if not cases:
        raise UserError(f'{folder}: no case with a single effect that was named first; '
                        'lab trial --diagnose makes a trial')
    named = {case.truth['case']: case for case in cases}
    complete(list(named), named.__getitem__,
             [Arm(lambda name, row: not (folder / name / WITHOUT).exists(),
                  partial(_diagnosed, folder, limit, options))],
             jobs=jobs, threads=True, done=done)
    rows = [row for case in cases for row in _rows(folder, case)]
    rises = [row['unknown_after'] - row['unknown_before'] for row in rows]
    recognised = rate(rise >= RISE for rise in rises)
    wrongly = rate(row['named'] != [UNKNOWN] and row['probability'] > OVERCONFIDENT
                   for row in rows)
    return {'cases': rows, 'failures': len(cases) - len(rows),
            'median_rise': float(np.median(rises)) if rises else None,
            'mean_rise': float(np.mean(rises)) if rises else None,
            'recognised': recognised.value, 'recognised_ci95': [recognised.low, recognised.high],
            'named_wrongly': wrongly.value, 'named_wrongly_ci95': [wrongly.low, wrongly.high]}


def _diagnosed(folder: Path, limit: float, options: Sequence[str], case: Case) -> Row:
    effect, = case.effects
    diagnose_recordings(
        folder / case.truth['case'], RECORDINGS, WITHOUT, limit,
        [*model_options(case.truth.get('machine')), '--without', effect, *options])
    return {}


def _rows(folder: Path, case: Case) -> list[dict[str, Any]]:
    """Return a case with its two answers; nothing if the second diagnosis failed."""
    assert case.verdict is not None
    try:
        without = read_verdict(folder / case.truth['case'] / WITHOUT)
    except VerdictError:
        return []
    return [{'case': case.truth['case'], 'effect': min(case.effects),
             'unknown_before': case.verdict.probability_of(UNKNOWN),
             'unknown_after': without.probability_of(UNKNOWN),
             'named': sorted(without.which[0].effects),
             'probability': without.which[0].probability}]
