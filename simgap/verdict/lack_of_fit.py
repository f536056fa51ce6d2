# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a hypothesis leaves: how far that is from noise, in which signal, what it depends on."""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np
from simgap.fit import residual_statistics as statistics
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState
from simgap.machine.contract import FloatArray
from simgap.search.hypothesis import Hypothesis
from simgap.settings import Settings
from simgap.verdict.intervals import covariance
from simgap.verdict.verdict import LackOfFit


def lack_of_fit(problem: LeastSquares, raw: FloatArray, best: Hypothesis,
                explained: float | None) -> LackOfFit:
    """
    Return what the best hypothesis leaves of the whole tests, after a fit that has converged.

    `raw` has the residuals of the model as configured, shape (n,); `explained` is the upper end of
    the explained share of withheld data, None without effects.
    """
    loudest, fast, fast_left = _fast(problem, raw, best)
    signal, regular = _regular(problem, best.state)
    implausible = max(implausibility(best, problem.settings).values(), default=0.0)
    return LackOfFit(_slow_excess(problem, best.state), _left(problem, raw, best), fast,
                     fast_left, implausible, explained, loudest, _enough(problem),
                     bool(best.named), regular, signal)


def implausibility(hypothesis: Hypothesis, settings: Settings) -> dict[str, float]:
    """Return how little the values of each effect look like it; above 1 is implausible."""
    state = hypothesis.state
    deviations = {}
    if hypothesis.has_course and state.has_hessian:
        variances = np.diag(covariance(state, 1.0, settings.interval))
        deviations = {p.name: math.sqrt(variance)
                      for p, variance in zip(state.parameters, variances.tolist(), strict=True)}
    return {effect: form.implausibility(state.point(), deviations)
            for effect, form in zip(hypothesis.effects, hypothesis.forms, strict=True)}


def _slow_excess(problem: LeastSquares, state: FitState) -> float:
    """Return the slow excess of the residual, averaged over tests and signals."""
    # It is relative to white noise with the same fast part, so that a sensor that is noisier than
    # its sheet says raises no alarm.
    settings = problem.settings.lack_of_fit
    found = []
    for k, experiment in enumerate(problem.experiments):
        z = np.clip(problem.residuals_of(state, k), -settings.clip, settings.clip)
        for c, channel in enumerate(experiment.channels):
            count = np.isfinite(z[:, c]).sum()
            # at rest the residual of a quantised reading is a fraction of a digit, and not noise
            if channel in experiment.quantised or not count:
                continue
            # few samples have no slow part: their size alone speaks
            found.append(statistics.slow_excess(z[:, c], settings)
                         if count > settings.least_samples
                         else statistics.power(z[:, c], settings) - 1.0)
    return float(np.mean(np.maximum(found, settings.least_excess))) if found else 0.0


def _regular(problem: LeastSquares, state: FitState) -> tuple[str, float]:
    """Return the signal whose residual repeats itself most in a test, and by how much."""
    # A hum, a ripple or a resonance may be no louder than a sensor's noise may be. But what is
    # left of noise is white, because its colour is known. What is quieter than noise counts less.
    settings = problem.settings.lack_of_fit
    signal, greatest = '', 0.0
    for k, experiment in enumerate(problem.experiments):
        z = problem.residuals_of(state, k)
        for c, channel in enumerate(experiment.channels):
            if channel in experiment.quantised or (
                    np.isfinite(z[:, c]).sum() <= settings.least_samples):
                continue
            found = statistics.autocorrelation(z[:, c], settings) * min(
                1.0, statistics.power(z[:, c], settings))
            if found > greatest:
                signal, greatest = channel, found
    return signal, greatest


def _enough(problem: LeastSquares) -> bool:
    least = problem.settings.lack_of_fit.least_samples
    return any((np.isfinite(e.measured).sum(axis=0) > least).any() for e in problem.experiments)


def _left(problem: LeastSquares, raw: FloatArray, best: Hypothesis) -> float:
    """Return the share of the raw gap above the noise that the best hypothesis leaves."""
    settings = problem.settings.lack_of_fit
    noise = 0.0
    energy = np.zeros(2)
    for k, experiment in enumerate(problem.experiments):
        z = problem.residuals_of(best.state, k)
        first = raw[problem.rows(k)].reshape(experiment.measured.shape)
        for c, channel in enumerate(experiment.channels):
            there = np.isfinite(z[:, c])
            if channel in experiment.quantised or there.sum() < 2:
                continue
            white = 0.5 * float(np.mean(np.diff(z[there, c]) ** 2))
            greatest = settings.greatest_energy
            energy += [min(float(np.nanmean(z[:, c] ** 2)), greatest) - white,
                       min(float(np.mean(first[:, c] ** 2)), greatest) - white]
            noise += white
    # where all signals are quantised, there is nothing to judge
    gap = max(energy[1], settings.least_gap * noise, 1e-30)
    return float(np.clip(energy[0] / gap, 0.0, 1.0))


def _fast(problem: LeastSquares, raw: FloatArray, best: Hypothesis) -> tuple[str, float, float]:
    """Return the signal with the loudest fast part, its variance over noise, and its share."""
    settings = problem.settings.lack_of_fit
    signal, loudest, share = '', 0.0, 1.0
    for c, channel in enumerate(problem.experiments[0].channels):
        pairs = []
        for k, experiment in enumerate(problem.experiments):
            z = problem.residuals_of(best.state, k)[:, c]
            if np.isfinite(z).sum() < settings.least_samples:
                continue
            first = raw[problem.rows(k)].reshape(experiment.measured.shape)[:, c]
            # a quantised reading at rest is off by a fraction of a digit, slow or fast
            loud = statistics.power if channel in experiment.quantised else statistics.fast_power
            pairs.append([loud(z, settings), loud(first, settings)])
        if pairs:
            now, before = np.mean(pairs, axis=0)
            if now > loudest:
                signal, loudest = channel, float(now)
                share = float(np.clip((now - 1.0) / max(before - 1.0, 1e-3), 0.0, 1.0))
    return signal, loudest, share


def remainders(problem: LeastSquares, state: FitState,
               limits: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    """Return what a hypothesis leaves of each signal, for the JSON; `limits` say what matters."""
    predicted = problem.machine.simulate([state.point()])[0]
    found: dict[str, dict[str, Any]] = {}
    first = problem.experiments[0]
    for c, (channel, unit) in enumerate(zip(first.channels, first.units, strict=True)):
        gaps, noises = [], []
        for experiment, values in zip(problem.experiments, predicted, strict=True):
            assert values is not None
            there = np.isfinite(experiment.measured[:, c]) & np.isfinite(values[:, c])
            gaps.append((experiment.measured[:, c] - values[:, c])[there])
            level = experiment.colours[c].level if experiment.colours else 1.0
            noises.append(level * experiment.noise[there, c])
        gap, noise = np.concatenate(gaps), np.concatenate(noises)
        if gap.size < problem.settings.lack_of_fit.least_samples:
            found[channel] = {'unit': unit, 'too_few_to_judge': int(gap.size)}
            continue
        # a spike is not part of what a model leaves
        bound = problem.settings.lack_of_fit.clip_fast * max(
            1.4826 * float(np.median(np.abs(gap))), float(np.median(noise)))
        rms = float(np.sqrt(np.mean(np.clip(gap, -bound, bound) ** 2)))
        usual = float(np.sqrt(np.mean(noise ** 2)))
        beyond = float(np.sqrt(max(rms ** 2 - usual ** 2, 0.0)))
        found[channel] = {'unit': unit, 'rms': rms, 'noise': usual, 'beyond_noise': beyond,
                          'matters': (beyond > limits[channel] if channel in limits else None)}
    return found


def residual_tests(problem: LeastSquares, state: FitState, lack: LackOfFit) -> dict[str, Any]:
    """Return the residual of every signal and what it depends on, for the JSON."""
    settings = problem.settings.lack_of_fit
    signals: dict[str, Any] = {}
    count = len(problem.experiments)
    zs = [problem.residuals_of(state, k) for k in range(count)]
    channels = problem.experiments[0].channels
    for c, channel in enumerate(channels):
        z = np.concatenate([part[:, c] for part in zs])
        if np.isfinite(z).any():
            signals[channel] = {
                'rms': float(np.sqrt(np.nanmean(z ** 2))),
                'slow_excess': float(np.mean([
                    statistics.slow_excess(part[:, c], settings) for part in zs])),
                'greatest_correlation': max(
                    statistics.autocorrelation(part[:, c], settings) for part in zs),
            }
    covariates = [problem.machine.motion(k).covariates() for k in range(count)]
    return {'excess_over_noise': lack.slow_excess, 'share_left': lack.left, 'signals': signals,
            'depends_on': statistics.dependences(channels, covariates, zs, settings)}
