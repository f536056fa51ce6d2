# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How far the gap shrinks on withheld data: what all tests, each withheld, say together."""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.machine.contract import FloatArray
from simgap.search.hypothesis import Hypothesis
from simgap.verdict.judge import Judge, Withheld

FITTED = 'offsets within the tolerance were fitted to it, with the effect and without'
_TURNS = f'each recording in turn, with the effect as the others have it; {FITTED}'
_NO_GAP = 'each recording alone shows no gap: offsets within the tolerance account for it'
_HALVES = f'the second half of the recording, with the effect as the first has it; {FITTED}'
_INTERVAL = ("a bootstrap over blocks of time, each with a draw of the effect's numbers from "
             'their Gaussian posterior in the training data')
BOUNDS = (-1.0, 1.0)


def held_out(problem: LeastSquares, none: Hypothesis, best: Hypothesis, threads: int = 1,
             groups: Sequence[str] | None = None, what: str = _TURNS) -> dict[str, Any]:
    """Return the gap before and after, where each group's effect is withheld, for the JSON."""
    single = len(problem.experiments) == 1
    judge = Judge(problem, none, best, groups or [e.name for e in problem.experiments])
    with ThreadPoolExecutor(threads) as pool:
        folds = list(pool.map(judge.withheld, range(len(problem.experiments))))
    counted = [fold for fold in folds if fold.after is not None] or folds
    known = counted[0].after is not None
    before = [fold.before for fold in counted]
    after = [_after(fold) for fold in counted]
    gap, left, harmless = _rms(before), _rms(after), 1.0 + problem.settings.held_out.no_harm
    reason = (_reason(folds) if not known else
              _NO_GAP if gap ** 2 < harmless and left ** 2 < harmless else None)
    fraction: float | None = None
    interval: list[float | None] = [None, None]
    if reason is None:
        fraction, interval = _bootstrapped(counted, problem)
    return {
        'before': gap, 'noise_floor': 1.0, 'after': left if known or not best.effects else None,
        'explained_fraction': {
            'value': fraction, 'ci95': interval, 'bounds': list(BOUNDS),
            'reason': reason, 'interval': _INTERVAL},
        'per_signal': _per_signal(problem, counted, known or not best.effects),
        **_judged(best.effects, counted),
        'held_out': _HALVES if single else what,
        'folds': [{'withheld': fold.name, 'judged': list(fold.judged),
                   'values': dict(zip(fold.names, fold.values.tolist(), strict=True)),
                   'cannot_be_judged': dict(fold.reasons)} for fold in folds]}


def _judged(effects: Sequence[str], folds: Sequence[Withheld]) -> dict[str, Any]:
    """Return the effects that were judged in some test, and why each other was in none."""
    reasons = {effect: fold.reasons[effect] for fold in folds for effect in fold.reasons}
    judged = [effect for effect in effects if any(effect in fold.judged for fold in folds)]
    return {'judged': judged, 'cannot_be_judged': {
        effect: reasons[effect] for effect in effects if effect not in judged}}


def _reason(folds: Sequence[Withheld]) -> str:
    reasons = dict.fromkeys(f'{effect}: {reason}' for fold in folds
                            for effect, reason in fold.reasons.items())
    return '; '.join(reasons) or 'no effect was found'


def _rms(residuals: Iterable[FloatArray]) -> float:
    return float(np.sqrt(np.nanmean(np.concatenate([np.ravel(z) for z in residuals]) ** 2)))


def _per_signal(problem: LeastSquares, folds: Sequence[Withheld], known: bool) -> dict[str, Any]:
    """Return the rms of each signal, in standard deviations and in its own unit."""
    found = {}
    first = problem.experiments[0]
    parts = {'before': [fold.before for fold in folds], 'after': list(map(_after, folds)),
             'before_in_unit': [fold.gap_before for fold in folds],
             'after_in_unit': [fold.gap_before if fold.gap_after is None else fold.gap_after
                               for fold in folds]}
    for c, (channel, unit) in enumerate(zip(first.channels, first.units, strict=True)):
        if any(np.isfinite(fold.before[:, c]).any() for fold in folds):
            found[channel] = {'unit': unit, **{
                name: _rms(z[:, c] for z in zs) if known or name.startswith('before') else None
                for name, zs in parts.items()}}
    return found


def block_sums(time_s: FloatArray, before: FloatArray, after: FloatArray,
               block_s: float) -> FloatArray:
    """Return the energy before, after and of the noise in each block, shape (blocks, 3)."""
    block = (time_s / block_s).astype(int)
    return np.column_stack([
        np.bincount(block, energy, minlength=int(block[-1]) + 1)
        for energy in (np.nansum(before ** 2, axis=1), np.nansum(after ** 2, axis=1),
                       np.isfinite(before).sum(axis=1))])


def _bootstrapped(folds: Sequence[Withheld],
                  problem: LeastSquares) -> tuple[float, list[float | None]]:
    """Return the explained fraction with its 95 percent interval, see `_INTERVAL`."""
    settings, block_s = problem.settings.held_out, problem.machine.time_scales.block_s
    random = np.random.default_rng(0)

    def blocks(draw: int | None) -> FloatArray:
        return np.concatenate([block_sums(
            fold.time, fold.before,
            _after(fold) if draw is None or fold.drawn is None else fold.drawn[draw], block_s)
            for fold in folds])

    drawn = [blocks(draw) for draw in range(settings.draws)]
    count = len(drawn[0])
    fractions = [
        explained_fraction(drawn[number % settings.draws][
            random.integers(0, count, count)].sum(axis=0))
        for number in range(settings.resamples)]
    return (explained_fraction(blocks(None).sum(axis=0)),
            [float(np.quantile(fractions, 0.025)), float(np.quantile(fractions, 0.975))])


def _after(fold: Withheld) -> FloatArray:
    """Return the rest, which is everything if nothing can be judged."""
    return fold.before if fold.after is None else fold.after


def explained_fraction(sums: FloatArray) -> float:
    """Return the explained share, -1 to 1, of energy above noise, from (before, after, noise)."""
    before, after, noise = sums
    # with a floor above the energy that is left, more than all would be explained
    gap = before - min(noise, after)
    share = float((before - after) / gap) if gap > 0.0 else 0.0
    return min(max(share, BOUNDS[0]), BOUNDS[1])
