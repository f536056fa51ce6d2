# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a hypothesis leaves: how far that is from noise, in which signal."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.process_noise import without_process
from simgap.fit.state import FitState


def enough(problem: LeastSquares) -> bool:
    """Return whether some signal has samples enough to be judged."""
    least = problem.settings.noise.least_samples
    return any((np.isfinite(e.measured).sum(axis=0) > least).any() for e in problem.experiments)


def remainders(problem: LeastSquares, state: FitState,
               limits: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    """Return what a hypothesis leaves of each signal, for the JSON; `limits` say what matters."""
    left = [without_process(e, e.measured - values, problem.settings.noise.clip)
            for e, values in zip(problem.experiments, problem.machine.simulate(
                [state.point()])[0], strict=True) if values is not None]
    found: dict[str, dict[str, Any]] = {}
    first = problem.experiments[0]
    for c, (channel, unit) in enumerate(zip(first.channels, first.units, strict=True)):
        gaps, noises = [], []
        for experiment, rest in zip(problem.experiments, left, strict=True):
            there = np.isfinite(rest[:, c])
            gaps.append(rest[there, c])
            level = experiment.colours[c].level if experiment.colours else 1.0
            noises.append(level * experiment.noise[there, c])
        gap, noise = np.concatenate(gaps), np.concatenate(noises)
        if gap.size < problem.settings.noise.least_samples:
            found[channel] = {'unit': unit, 'too_few_to_judge': int(gap.size)}
            continue
        # a spike is not part of what a model leaves
        bound = problem.settings.noise.clip * max(
            1.4826 * float(np.median(np.abs(gap))), float(np.median(noise)))
        rms = float(np.sqrt(np.mean(np.clip(gap, -bound, bound) ** 2)))
        usual = float(np.sqrt(np.mean(noise ** 2)))
        beyond = float(np.sqrt(max(rms ** 2 - usual ** 2, 0.0)))
        found[channel] = {'unit': unit, 'rms': rms, 'noise': usual, 'beyond_noise': beyond,
                          'matters': (beyond > limits[channel] if channel in limits else None)}
    return found
