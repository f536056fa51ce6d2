# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Where a gap lies: the parts of the machine, the signals it shows in, and the regimes of motion.

With a verdict that names effects, the parts are theirs, and a signal's share is what the effects
explain of it. Without one, the parts are those by which something unknown may have entered.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from antenna_drive.diagnosis import residual_statistics as residuals, unknown_input
from antenna_drive.diagnosis.least_squares import Problem, State
from antenna_drive.diagnosis.machine import FloatArray
from antenna_drive.diagnosis.verdict import NOISIER, Ranked
import numpy as np

# How many entries are given, and what is left out below.
_ENTRIES = 12
_LEAST = 0.01
# Evidence below this is none at all.
_EVIDENCE = 20.0

Entry = dict[str, Any]


def of_effects(problem: Problem, ranked: Sequence[Ranked], none: State,
               best: State) -> list[Entry]:
    """
    Return where the effects of a verdict lie, the largest share first.

    Parameters
    ----------
    problem
        the model against its experiments
    ranked
        the candidates with their probabilities
    none, best
        where the fits ended without and with the likeliest effects

    """
    parts: dict[str, float] = {}
    for item in ranked:
        for effect in item.candidate.effects:
            part = problem.model.effects[effect].component
            parts[part] = parts.get(part, 0.0) + item.probability / len(item.candidate.effects)
    return _entries(problem, parts, lambda k: problem.shaped(none, k) ** 2
                    - problem.shaped(best, k) ** 2)


def of_the_unknown(problem: Problem, none: State, loudest: str,
                   loudness: float) -> tuple[list[Entry], list[unknown_input.Place]]:
    """
    Return where something lies that no effect names, and where it may have entered.

    Parameters
    ----------
    problem
        the model against its experiments
    none
        where the fit ended without any effect
    loudest, loudness
        the signal whose fast part is the loudest, and its variance in that of its noise: what is
        too fast for a pulse shows in one reading, and lies there

    """
    found = unknown_input.places(Problem(problem.model.brief()), none.point())
    if found[0].evidence > _EVIDENCE:
        parts = unknown_input.components(found)
    elif loudness > NOISIER:
        parts = {loudest: 1.0}
    else:
        return [], found
    return _entries(problem, parts, lambda k: problem.shaped(none, k) ** 2 - 1.0), found


def _entries(problem: Problem, parts: Mapping[str, float],
             energy: Callable[[int], FloatArray]) -> list[Entry]:
    """Return the shares of parts, signals and regimes, given the energy of each sample."""
    total = sum(parts.values())
    if not total:
        return []
    shares: dict[tuple[str, str], float] = {}
    for k, experiment in enumerate(problem.experiments):
        regime = residuals.regimes(experiment, problem.model.motion(k))
        sample = np.nan_to_num(energy(k))
        for c, channel in enumerate(experiment.channels):
            for r, name in enumerate(residuals.REGIMES):
                key = (channel, name)
                shares[key] = shares.get(key, 0.0) + float(sample[regime == r, c].sum())
    positive = {key: max(value, 0.0) for key, value in shares.items()}
    whole = sum(positive.values()) or 1.0
    found: list[Entry] = [
        {'component': part, 'signal': signal, 'regime': regime,
         'share': weight / total * share / whole}
        for part, weight in parts.items() for (signal, regime), share in positive.items()]
    found.sort(key=lambda entry: -float(entry['share']))
    return [entry for entry in found[:_ENTRIES] if float(entry['share']) > _LEAST]
