# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A servo's diagnosis against refits of BAM's friction models, on withheld tests.

For each pair of gains, and each pair of trajectories, the tests with these are fitted and the
others withheld. The diagnosis searches the fitted tests for the effects that a motor with Coulomb
and viscous friction lacks. The diagnosed model and the six models of BAM's ladder are then fitted
to the same tests with the same number of runs, and simulated in open loop over the withheld ones.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
import hashlib
from itertools import combinations
import json
from pathlib import Path
import time
from typing import Any

from antenna_drive.workers import workers
from lab.servo import refit as servo_refit
from lab.servo.catalogue import catalogue, vector
from lab.servo.log import ServoLog
from lab.servo.refit import Fit, LADDER, PARENTS
from lab.servo.rounds import FitEffort, lacking, plain
import numpy as np
import simgap
from simgap.errors import UserError

Progress = Callable[[float, str], None]
DIAGNOSED = 'diagnosed'
SPLITS = {'gain': 'kp', 'trajectory': 'trajectory'}


@dataclass(frozen=True)
class Direction:
    """A choice of the tests that are fitted; the others are withheld."""

    split: str                  # 'gain' or 'trajectory'
    fitted: tuple[Any, ...]     # the two gains or trajectories that are fitted

    def split_tests(self, tests: Sequence[ServoLog]) -> tuple[list[ServoLog], list[ServoLog]]:
        """Return the fitted and the withheld tests."""
        key = SPLITS[self.split]
        chosen = [test for test in tests if getattr(test, key) in self.fitted]
        return chosen, [test for test in tests if getattr(test, key) not in self.fitted]


def directions(tests: Sequence[ServoLog], splits: Iterable[str] = tuple(SPLITS),
               ) -> list[Direction]:
    """
    Return every choice of two gains and of two trajectories that withholds some tests.

    Raise UserError where there are fewer than three gains and fewer than three trajectories.
    """
    found = []
    for split in splits:
        levels = sorted({getattr(test, SPLITS[split]) for test in tests})
        if len(levels) > 2:
            found += [Direction(split, pair) for pair in combinations(levels, 2)]
    if not found:
        raise UserError(f'nothing can be withheld: at least three values of '
                        f'{" or ".join(splits)} are needed')
    return found


def compared(tests: Sequence[ServoLog], direction: Direction, effort: FitEffort,
             without: Sequence[str] = ()) -> dict[str, Any]:
    """Compare the models in one direction; the diagnosis leaves out the effects in `without`."""
    began = time.monotonic()
    fitted, withheld = direction.split_tests(tests)
    found = lacking(fitted, effort, without)
    diagnosed = servo_refit.refit(fitted, found.names, [found.fit.values], effort.runs)
    fits: dict[str, Fit] = {}
    for name, names in LADDER.items():
        # the ladder may also start from the diagnosed values
        begins = [*(fits[parent].values for parent in PARENTS[name]), diagnosed.values]
        fits[name] = servo_refit.refit(fitted, names, begins, effort.runs)
    fits[DIAGNOSED] = diagnosed
    return {
        'split': direction.split,
        'fitted': list(direction.fitted),
        'models': {name: _model(fit, fitted, withheld) for name, fit in fits.items()},
        'found': list(found.effects),
        'rounds': found.rounds,
        'seconds': time.monotonic() - began,
    }


def _model(fit: Fit, fitted: Sequence[ServoLog], withheld: Sequence[ServoLog]) -> dict[str, Any]:
    row = vector(fit.values)
    errors = {test.name: 1e3 * test.error(row) for test in withheld}
    return {'fitted_mrad': 1e3 * servo_refit.error(fitted, fit.values),
            'withheld_mrad': float(np.mean(list(errors.values()))),
            'per_recording_mrad': errors, 'values': plain(fit.values)}


def study(tests: Sequence[ServoLog], chosen: Sequence[Direction], effort: FitEffort,
          without: Sequence[str] = (), jobs: int = 1, keep: Path | None = None,
          progress: Progress = lambda share, doing: None,
          scheduler: str | None = None) -> dict[str, Any]:
    """
    Compare in several directions and summarise; return plain data.

    The diagnosis leaves out the effects in `without`. Results of directions that are found in the
    folder `keep` are used again. `scheduler` is the address of a dask.distributed scheduler whose
    workers compare instead of `jobs` processes. `progress` gets the share that is done, 0 to 1,
    and a description. Raise UserError for an unknown effect or a scheduler without workers.
    """
    for name in without:
        if name not in catalogue():
            raise UserError(f'--without: {name}: no such effect; known are '
                            f'{", ".join(catalogue())}')
    began = time.monotonic()
    results: dict[int, dict[str, Any]] = {}
    kept = _KeptResults(keep, tests, effort, without)
    for i, direction in enumerate(chosen):
        known = kept.find(direction)
        if known is not None:
            results[i] = known
    wanted = [i for i in range(len(chosen)) if i not in results]
    progress(len(results) / len(chosen), 'directions')
    if wanted:
        with workers(jobs, scheduler) as pool:
            for number, result in pool.each(compared, (
                    (tests, chosen[i], effort, without) for i in wanted)):
                i = wanted[number]
                results[i] = result()
                kept.put(chosen[i], results[i])
                progress(len(results) / len(chosen), 'directions')
    progress(1.0, 'directions')
    ordered = [results[i] for i in range(len(chosen))]
    return {'recordings': [test.name for test in tests],
            'runs_per_fit': effort.runs,
            'without': list(without),
            'summary': summed(ordered),
            'directions': ordered,
            'seconds': time.monotonic() - began}


class _KeptResults:
    """Results of directions, each in a file with a digest of the data and code it came from."""

    def __init__(self, folder: Path | None, tests: Sequence[ServoLog], effort: FitEffort,
                 without: Sequence[str]) -> None:
        self._folder = folder
        digest = hashlib.sha256(repr((effort, sorted(without))).encode())
        for test in tests:
            for part in (test.time, test.goal, test.measured):
                digest.update(part.tobytes())
        # the results depend on this room and on the engine
        for room in (Path(__file__).parent, Path(simgap.__file__).parent):
            for source in sorted(room.rglob('*.py')):
                digest.update(source.read_bytes())
        self._key = digest.hexdigest()

    def _path(self, direction: Direction) -> Path | None:
        if self._folder is None:
            return None
        values = '-'.join(str(value) for value in direction.fitted)
        return self._folder / f'{direction.split}-{values}.json'

    def find(self, direction: Direction) -> dict[str, Any] | None:
        path = self._path(direction)
        try:
            stored = json.loads(path.read_text()) if path is not None else None
        except (OSError, ValueError):
            return None
        if not isinstance(stored, dict) or stored.get('key') != self._key:
            return None
        result: dict[str, Any] = stored['result']
        return result

    def put(self, direction: Direction, result: dict[str, Any]) -> None:
        path = self._path(direction)
        if path is None:
            return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            draft = path.with_suffix('.draft')
            draft.write_text(json.dumps({'key': self._key, 'result': result}))
            draft.replace(path)
        except OSError as failed:
            raise UserError(f'{path}: cannot be written, {failed.strerror}') from failed


def summed(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return for each split the mean withheld errors and how often each effect was found."""
    summary: dict[str, Any] = {}
    for split in SPLITS:
        part = [r for r in results if r['split'] == split]
        if not part:
            continue
        errors = {name: float(np.mean([r['models'][name]['withheld_mrad'] for r in part]))
                  for name in part[0]['models']}
        ladder = {name: value for name, value in errors.items() if name != DIAGNOSED}
        best = min(ladder, key=lambda name: ladder[name])
        summary[split] = {
            'withheld_mrad': errors,
            'fitted_mrad': {name: float(np.mean([r['models'][name]['fitted_mrad']
                                                 for r in part])) for name in errors},
            'best_of_ladder': best,
            'lower_than_best_of_ladder': errors[DIAGNOSED] < errors[best],
            'directions_lower_than_all_of_ladder': sum(
                r['models'][DIAGNOSED]['withheld_mrad']
                < min(r['models'][name]['withheld_mrad'] for name in ladder) for r in part),
            'directions': len(part),
            'found_in': dict(Counter(e for r in part for e in dict.fromkeys(r['found'])
                                     ).most_common()),
        }
    return summary


def text(result: dict[str, Any]) -> str:
    """Return the comparison as text for a terminal."""
    lines = []
    for split, part in result['summary'].items():
        names = list(part['withheld_mrad'])
        lines.append(f'two values of {split} fitted, the others withheld: '
                     f'mean absolute position error in open loop [mrad]')
        lines.append('  ' + ' ' * 34 + ''.join(f'{name:>10}' for name in names))
        for direction in result['directions']:
            if direction['split'] == split:
                label = ' and '.join(f'{v:g}' if isinstance(v, float) else str(v)
                                     for v in direction['fitted'])
                lines.append(f'  {label:<34}' + ''.join(
                    f'{direction["models"][name]["withheld_mrad"]:10.1f}' for name in names))
        lines.append(f'  {"mean":<34}' + ''.join(
            f'{part["withheld_mrad"][name]:10.1f}' for name in names))
        lines.append(f'  {"mean on what was fitted":<34}' + ''.join(
            f'{part["fitted_mrad"][name]:10.1f}' for name in names))
        lines.append('  found: ' + ', '.join(
            f'{effect} ({count} of {part["directions"]})'
            for effect, count in part['found_in'].items()))
    return '\n'.join(lines)
