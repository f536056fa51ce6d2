# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The noise of a channel as a recording shows it: its level and its colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np
from scipy.signal import lfilter
from simgap.fit.process_noise import without_process
from simgap.machine.by_label import REPEAT
from simgap.machine.contract import Colour, Experiment, FloatArray, Machine, Point
from simgap.settings import NoiseSettings

_CORNERS_HZ = (0.15, 0.3, 0.6, 1.2, 2.5, 5.0, 10.0, 20.0)
_GAINS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9)


@dataclass(frozen=True)
class Process:
    """White noise and a slow part, as variances, and the slow part's pole for one sample."""

    white: float
    slow: float
    pole: float

    @classmethod
    def of(cls, colour: Colour) -> Process:
        """Return the process that has a colour; the inverse of `colour`."""
        innovation, decay = colour.level ** 2, 1.0 - colour.pole ** 2
        slow = (colour.gain * innovation * (1.0 - colour.pole ** 2 * (1.0 - colour.gain)) / decay
                if colour.gain else 0.0)
        return cls((1.0 - colour.gain) * innovation, slow, colour.pole)

    @property
    def colour(self) -> Colour:
        """Return the filter whose output is white, by the steady Kalman filter of the process."""
        drive = self.slow * (1.0 - self.pole ** 2)
        half = 0.5 * (self.white * (1.0 - self.pole ** 2) - drive)
        predicted = math.sqrt(half ** 2 + drive * self.white) - half
        innovation = predicted + self.white
        return Colour(self.pole, predicted / innovation, math.sqrt(innovation))


def whitened(z: FloatArray, colour: Colour) -> FloatArray:
    """Return the innovations of a residual at even times, shape (n,), with variance 1, or NaN."""
    found = np.full(z.size, np.nan)
    there = np.isfinite(z)
    if there.all():
        return innovations(z, colour)
    if not there.any():
        return found
    places = np.arange(z.size)
    # a short gap is bridged; what is bridged is not judged
    bridged = np.interp(places, places[there], z[there])
    found[there] = innovations(bridged, colour)[there]
    return found


def innovations(z: FloatArray, colour: Colour) -> FloatArray:
    """Return the innovations of gapless residuals, shape (..., n), with variance 1."""
    pole, gain = colour.pole, colour.gain
    return np.asarray(lfilter([1.0, -pole], [1.0, -pole * (1.0 - gain)], z)) / colour.level


def estimated(residuals: Sequence[FloatArray], interval_s: float, slow_limit: float,
              settings: NoiseSettings) -> Process:
    """
    Return the noise process of a channel from the residuals of each experiment.

    These are in standard deviations of the stated noise, shape (n,), NaN where there is none, at
    an interval [s]. The slow part has the variance `slow_limit` at most: more is not noise.
    """
    usable = [z for z in residuals if np.isfinite(z).sum() >= settings.least_samples]
    if not usable:
        return Process(1.0, 0.0, 0.0)
    sizes = np.concatenate([np.abs(z[np.isfinite(z)]) for z in usable])
    # an outlier is not noise: the loss of the fits copes with it
    bound = settings.clip * max(float(np.median(sizes)) / 0.6745, 1.0 / settings.greatest_level)
    clipped = [np.clip(z, -bound, bound) for z in usable]

    def power(pole: float, gain: float) -> float:
        energy = [whitened(z, Colour(pole, gain, 1.0)) for z in clipped]
        return float(np.nanmean(np.concatenate(energy) ** 2))

    white = max(power(0.0, 0.0), 1e-12)
    poles = [math.exp(-2.0 * math.pi * corner * interval_s) for corner in _CORNERS_HZ]
    best, pole, gain = min((power(pole, gain), pole, gain) for pole in poles for gain in _GAINS)
    if 0.5 * sizes.size * math.log(white / max(best, 1e-12)) < settings.worth_a_colour:
        best, pole, gain = white, 0.0, 0.0
    slow = gain * best * (1.0 - pole ** 2 * (1.0 - gain)) / (1.0 - pole ** 2)
    most = settings.greatest_level ** 2
    level = np.clip((1.0 - gain) * best, 1.0 / most, most)
    return Process(float(level), min(slow, slow_limit), pole)


def with_noise_left(machine: Machine, point: Point, settings: NoiseSettings,
                    greatest_level: float) -> Machine:
    """Return a machine with the noise that is left at a point, in stated noise at most this."""
    predicted = machine.simulate([point])[0]
    return machine.with_experiments(with_estimated_noise(
        machine.experiments, [without_process(e, e.measured - p, settings.clip) for e, p in zip(
            machine.experiments, predicted, strict=True) if p is not None],
        replace(settings, greatest_level=greatest_level)))


def with_estimated_noise(experiments: Sequence[Experiment], residuals: Sequence[FloatArray],
                         settings: NoiseSettings) -> tuple[Experiment, ...]:
    """Return experiments with the noise of residuals, measured minus predicted, shape (n, c)."""
    colours: list[Colour] = []
    repeated = _differences(experiments, residuals)
    for c, channel in enumerate(experiments[0].channels):
        zs = [r[:, c] / e.noise[:, c] for e, r in zip(experiments, residuals, strict=True)]
        there = [np.isfinite(z) for z in zs]
        if channel in experiments[0].quantised or not any(item.any() for item in there):
            colours.append(Colour())
            continue
        most, slow = settings.greatest_level, settings.greatest_level ** 2
        interval = float(np.median(np.diff(experiments[0].time)))
        if repeated:  # noise is what differs between them and no more
            seen = estimated([z[:, c] for z in repeated], interval, math.inf,
                             replace(settings, greatest_level=math.inf))
            most, slow = max(math.sqrt(seen.white), 1.0), seen.slow
        limit = slow + max(_model_error(e, c, settings) for e in experiments)
        colours.append(estimated(zs, interval, limit, replace(
            settings, greatest_level=most)).colour)
    return tuple(replace(e, colours=tuple(colours)) for e in experiments)


def _differences(experiments: Sequence[Experiment],
                 residuals: Sequence[FloatArray]) -> list[FloatArray]:
    """Return what repeated tests have for themselves, in stated noise, with its variance."""
    alike: dict[Any, list[FloatArray]] = {}
    for e, r in zip(experiments, residuals, strict=True):
        if REPEAT in e.labels:
            others = frozenset(item for item in e.labels.items() if item[0] != REPEAT)
            alike.setdefault((e.time.size, others), []).append(r / e.noise)
    return [(z - np.mean(same, axis=0)) * math.sqrt(len(same) / (len(same) - 1))
            for same in alike.values() if len(same) > 1 for z in same]


def found_noise(experiments: Sequence[Experiment]) -> dict[str, dict[str, float]]:
    """Return the noise found, by signal: variances of the stated noise, and a corner [Hz]."""
    first = experiments[0]
    interval = float(np.median(np.diff(first.time)))
    found = {}
    for channel, colour in zip(first.channels, first.colours, strict=False):
        process = Process.of(colour)
        found[channel] = {
            'white': process.white, 'slow': process.slow,
            'corner_hz': (-math.log(process.pole) / (2.0 * math.pi * interval)
                          if process.slow else 0.0)}
    return found


def with_found_noise(experiments: Sequence[Experiment],
                     found: Mapping[str, Mapping[str, float]]) -> tuple[Experiment, ...]:
    """Return planned experiments with the noise of `found_noise`, or that which is stated."""
    def colour(channel: str, interval: float) -> Colour:
        if channel not in found:
            return Colour()
        item = found[channel]
        pole = math.exp(-2.0 * math.pi * item['corner_hz'] * interval) if item['slow'] else 0.0
        return Process(item['white'], item['slow'], pole).colour

    return tuple(replace(e, colours=tuple(
        colour(channel, float(np.median(np.diff(e.time)))) for channel in e.channels))
        for e in experiments)


def with_model_error(experiments: Sequence[Experiment],
                     settings: NoiseSettings) -> tuple[Experiment, ...]:
    """Return planned experiments with their noise and the error that every model has."""
    pole = math.exp(-2.0 * math.pi * settings.model_error_hz
                    * float(np.median(np.diff(experiments[0].time))))
    slow = [max(_model_error(e, c, settings) for e in experiments)
            for c, channel in enumerate(experiments[0].channels)]
    known = [Process.of(colour) for colour in experiments[0].colours] or (
        [Process(1.0, 0.0, 0.0)] * len(slow))
    # of the two slow parts the larger one counts, with its own pole
    colours = tuple(
        Colour() if channel in experiments[0].quantised else
        (replace(noise, slow=error, pole=pole) if error > noise.slow else noise).colour
        for channel, error, noise in zip(experiments[0].channels, slow, known, strict=True))
    return tuple(replace(e, colours=colours) for e in experiments)


def _model_error(experiment: Experiment, channel: int, settings: NoiseSettings) -> float:
    """Return the variance of the model's error in a signal, in variances of the stated noise."""
    there = np.isfinite(experiment.measured[:, channel])
    if not there.any():
        return 0.0
    noise = float(np.median(experiment.noise[there, channel]))
    return (experiment.model_error_of(channel, settings.model_error) / noise) ** 2
