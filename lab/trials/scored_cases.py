# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Cases with their answers in one small file: what the scorecard needs, and who answered what.

A wild trial takes gigabytes. This file of JSON lines takes a few kilobytes a case. It can be
published, and anybody can score it again. Everything else about a case follows from its seed.
"""

from collections.abc import Iterable, Iterator
import json
import math
from pathlib import Path
from typing import Any

from lab.antenna.cases import Truth
from lab.trials import sealing
from lab.trials.scorecard import Case
from lab.trials.verdict import content_of, parse_verdict
from simgap.errors import one_line, UserError

SUFFIX = '.jsonl'
KINDS = ('single', 'pair', 'none', 'outside')
_KEPT = ('case', 'seed', 'kind', 'effects', 'machine', 'family', 'tolerance', 'sample_rate_hz',
         'durations_s')


def identity(truth: Truth) -> Truth:
    """Return a truth without what follows from its seed: no two cases have the same."""
    return {key: truth[key] for key in _KEPT if key in truth}


def case_lines(cases: Iterable[Case]) -> Iterator[str]:
    """Yield one line of JSON for each case: whose it is, and the answer."""
    for case in cases:
        yield json.dumps({
            'truth': identity(case.truth), 'verdict': case.verdict and content_of(case.verdict),
            'closed': case.closed if math.isfinite(case.closed) else None}, allow_nan=False) + '\n'


def read_scored(path: Path) -> list[Case]:
    """Read a file of `case_lines`; UserError where it or a line of it cannot be read."""
    cases = []
    try:
        with path.open(encoding='utf-8') as stream:
            for number, line in enumerate(stream, 1):
                try:
                    cases.append(_case(json.loads(line)))
                except (ValueError, RecursionError) as error:
                    raise UserError(f'{path}: line {number}: no case of a trial, '
                                    f'{one_line(error, 200)}; lab score DIR --cases '
                                    'FILE writes such a file') from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f'{path}: cannot be read, {one_line(error, 200)}') from error
    return cases


def read_scored_of(path: Path, folder: Path) -> list[Case]:
    """
    Read the cases of a file, and check that they are cases of a trial.

    Raise UserError where the file cannot be read or has another case, SealError where a truth of
    the trial is missing or was changed.
    """
    manifest = sealing.read_manifest(folder)
    here = {name: identity(sealing.open_truth(folder, name, manifest))
            for name in manifest['seals']}
    cases = read_scored(path)
    for case in cases:
        name = case.truth.get('case', '')
        if identity(case.truth) != here.get(name):
            raise UserError(f'{path}: {name}: is no case of this trial; give the cases, the seed '
                            'and the options with which the file was made')
    return cases


def _case(content: Any) -> Case:
    """Return the case of a line; raises ValueError where it is none."""
    truth = content.get('truth') if isinstance(content, dict) else None
    if not isinstance(truth, dict) or truth.get('kind') not in KINDS:
        raise ValueError(f'truth: kind: not one of {", ".join(KINDS)}')
    effects = truth.get('effects')
    if not isinstance(effects, list) or not all(
            isinstance(entry, dict) and isinstance(entry.get('id'), str)
            and _is_share(entry.get('size'))
            and isinstance(entry.get('parameters'), dict) for entry in effects):
        raise ValueError('truth: effects: not a list of effects with id, size and parameters')
    closed, verdict = content.get('closed'), content.get('verdict')
    if closed is not None and not _is_share(abs(closed) if _is_number(closed) else None):
        raise ValueError(f'closed: {closed!r}, not a number from -1 to 1')
    case = Case(truth, None if verdict is None else parse_verdict(verdict),
                math.nan if closed is None else float(closed))
    try:
        all(size.relative_error for size in case.sizes)
    except (LookupError, TypeError, ArithmeticError) as error:
        raise ValueError(f'truth: effects: {error!r}') from None
    return case


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_share(value: Any) -> bool:
    return _is_number(value) and 0.0 <= value <= 1.0
