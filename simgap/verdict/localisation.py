# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where a gap lies: parts (of the effects, or of an unknown input), signals and regimes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import FloatArray
from simgap.verdict import unknown_input
from simgap.verdict.verdict import Answer, LackOfFit

Located = dict[str, Any]


def of_effects(problem: LeastSquares, answers: Sequence[Answer], none: FitState,
               best: FitState) -> list[Located]:
    """Return where the effects of a verdict lie, the largest share first."""
    parts: dict[str, float] = {}
    for answer in answers:
        for effect in answer.effects:
            part = problem.machine.catalogue[effect].component
            share = answer.probability / len(answer.effects)
            parts[part] = parts.get(part, 0.0) + share
    return _located(problem, parts, lambda k: problem.residuals_of(none, k) ** 2
                    - problem.residuals_of(best, k) ** 2)


def parts_of_the_unknown(problem: LeastSquares, none: FitState, lack: LackOfFit,
                         ) -> tuple[dict[str, float], list[unknown_input.Place]]:
    """Return how likely something unnamed acts in each part, and its places, likeliest first."""
    # what is too fast for a pulse, or repeats itself, shows in one reading, and is put there
    settings = problem.settings
    truncated = LeastSquares(problem.machine.truncated(), settings=settings)
    found = unknown_input.places(truncated, none.point())
    if found[0].evidence > settings.localisation.least_evidence:
        parts = unknown_input.components(found, settings.localisation.caution)
    elif lack.fast > settings.verdict.fast:
        parts = {lack.loudest: 1.0}
    elif lack.regular > settings.verdict.regular:
        parts = {lack.most_regular: 1.0}
    else:
        parts = {}
    return parts, found


def of_the_unknown(problem: LeastSquares, none: FitState,
                   parts: Mapping[str, float]) -> list[Located]:
    """Return where something lies that no effect names, given how likely each part is."""
    return _located(problem, parts, lambda k: problem.residuals_of(none, k) ** 2 - 1.0)


def _located(problem: LeastSquares, parts: Mapping[str, float],
             energy: Callable[[int], FloatArray]) -> list[Located]:
    """Return the shares of parts, signals and regimes, given the energy of each sample."""
    total = sum(parts.values())
    if not total:
        return []
    settings = problem.settings.localisation
    shares: dict[tuple[str, str], float] = {}
    for k, experiment in enumerate(problem.experiments):
        regimes = problem.machine.motion(k).regimes()
        sample = np.nan_to_num(energy(k))
        for c, channel in enumerate(experiment.channels):
            for r, name in enumerate(regimes.names):
                key = (channel, name)
                shares[key] = shares.get(key, 0.0) + float(sample[regimes.labels == r, c].sum())
    positive = {key: max(value, 0.0) for key, value in shares.items()}
    whole = sum(positive.values()) or 1.0
    found: list[Located] = [
        {'component': part, 'signal': signal, 'regime': regime,
         'share': weight / total * share / whole}
        for part, weight in parts.items() for (signal, regime), share in positive.items()]
    found.sort(key=lambda item: -float(item['share']))
    return [item for item in found[:settings.entries]
            if float(item['share']) > settings.least_share]
