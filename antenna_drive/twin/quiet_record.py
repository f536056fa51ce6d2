# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Learns from a quiet record what a healthy drive's residuals are like: see `baseline`.

The coefficients of the regressors and the shifts of the blocks depend on each other, and are found
in turn. Mean and scatter of scores are known from n blocks only. The scatter is therefore taken at
the upper end of its 95 percent interval, and the reference value of the chart is raised by two
standard errors of the mean.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.readings import READINGS, SIGNALS
from antenna_drive.twin.baseline import (
    Baseline, BLOCK_S, block_scores, CUT, DRIFT_S, interpolated, LEAST_SAMPLES, motion_of,
    regressors, residual_of, SCORES, shift_of, SignalBaseline, SignalBlock, SLOPES, standardised,
    WashOut, WAY,
)
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

# A ridge that keeps coefficients of columns that are alike from growing, as a share of a sample.
_RIDGE = 1e-3
# A score that moves by less than this share of the residual's size is no gap, however steady it
# was in the quiet record; and the quiet record's worst block is no gap either.
_LEAST_DEVIATION, _WORST = 0.1, 3.0
# The greatest correlation of neighbouring blocks that is reckoned with.
_MOST_ALIKE = 0.95
# How often the record is fitted with the shifts that the last fit found, and before that with
# their course over time.
_SHIFT_PASSES, _DRIFT_PASSES = 3, 2
# Lags that are tried [s].
_MOST_LAG_S, _LAG_STEP_S = 0.3, 0.005


@dataclass(frozen=True)
class Track:
    """A stretch of the twin's course on an even grid, and a real drive's readings beside it."""

    time: FloatArray  # of the twin, ascending, shape (n,) [s]
    course: FloatArray  # the twin's readings, shape (n, 6), in the order of `SIGNALS`
    washed: FloatArray  # the same with the encoder behind its high-pass
    command: FloatArray  # axis rate command, shape (n,) [rad/s]
    spacing: float  # of the samples of the command that the twin was driven with [s]
    # times [s] and values of each measured signal
    samples: Mapping[str, tuple[FloatArray, FloatArray]]


def learn(track: Track, begin: float) -> Baseline:
    """
    Return the baseline of a quiet record.

    track : of a healthy drive, a minute or more
    begin : what is earlier is not learned from: high-passes have to settle [s]
    """
    table = regressors(track.time, track.washed)
    edges = np.arange(begin, track.time[-1] - 0.5 * BLOCK_S, BLOCK_S)
    motions = [motion_of(track.time[part], track.command[part])
               for part in _parts(track.time, edges)]
    envelope = (max(m[0] for m in motions), max(m[1] for m in motions))
    lags = {name: lag_of(track, name) for name in track.samples}
    late = np.zeros(len(edges))
    prepared = _all_prepared(track, table, edges, lags, late)
    for _ in range(_DRIFT_PASSES if prepared else 0):
        signals = {name: _fitted_to(item, [0.0] * len(edges)) for name, item in prepared.items()}
        late = late - _smooth(*_shifts(prepared, signals))
        prepared = _all_prepared(track, table, edges, lags, late)
    signals, shifts = {}, [0.0] * len(edges)
    for _ in range(_SHIFT_PASSES):
        signals = {name: _fitted_to(item, shifts) for name, item in prepared.items()}
        shifts = np.clip(_shifts(prepared, signals)[0], -track.spacing, track.spacing).tolist()
    return Baseline({name: _with_scores(signals[name], item.parts, shifts)
                     for name, item in prepared.items()}, envelope, track.spacing, len(edges))


def lag_of(track: Track, name: str) -> float:
    """
    Return by how much a reading is late, from its correlation with the twin [s].

    The lag of the greatest correlation of both, refined by a parabola; 0 where nothing moves.
    """
    times, values = track.samples[name]
    column = track.course[:, SIGNALS.index(name)]
    if times.size < 3 * LEAST_SAMPLES or np.ptp(column) == 0.0 or np.ptp(values) == 0.0:
        return 0.0
    lags = np.arange(-_MOST_LAG_S, _MOST_LAG_S + 0.5 * _LAG_STEP_S, _LAG_STEP_S)
    inside = (times > track.time[0] + _MOST_LAG_S) & (times < track.time[-1] - _MOST_LAG_S)
    if np.count_nonzero(inside) < 3 * LEAST_SAMPLES:
        return 0.0
    bound = np.percentile(values[inside], [0.5, 99.5])
    reading = np.clip(values[inside], *bound)
    found = np.array([_correlation(np.interp(times[inside] - lag, track.time, column), reading)
                      for lag in lags])
    best = int(np.argmax(found))
    if not 0 < best < lags.size - 1 or found[best] < 0.5:
        return 0.0
    low, middle, high = found[best - 1:best + 2]
    bend = low - 2.0 * middle + high
    return float(lags[best] + (0.5 * _LAG_STEP_S * (low - high) / bend if bend < 0.0 else 0.0))


def _correlation(one: FloatArray, other: FloatArray) -> float:
    scale = float(one.std() * other.std())
    return float(((one - one.mean()) * (other - other.mean())).mean()) / scale if scale else 0.0


@dataclass(frozen=True)
class _Prepared:
    """One signal of a quiet record: its name, its lag at the end [s], and its blocks."""

    name: str
    lag: float
    parts: Sequence[SignalBlock]


def _all_prepared(track: Track, table: FloatArray, edges: FloatArray, lags: Mapping[str, float],
                  late: FloatArray) -> dict[str, _Prepared]:
    """Return the signals that have enough samples, each later by `late` in each block [s]."""
    return {name: found for name, lag in lags.items() if (
        found := _prepared(track, name, table, edges, lag + late)) is not None}


def _prepared(track: Track, name: str, table: FloatArray, edges: FloatArray,
              lag: FloatArray) -> _Prepared | None:
    """Return one signal beside the twin, with its lag in each block; None if it has too little."""
    column = SIGNALS.index(name)
    times, values = track.samples[name]
    times = times - np.interp(times, edges + 0.5 * BLOCK_S, lag)
    inside = (times >= track.time[0]) & (times <= track.time[-1])
    times, values = times[inside], values[inside]
    if times.size < 10 * table.shape[1]:
        return None
    residual = residual_of(column, values, interpolated(times, track.time, track.course)[
        :, column], times, WashOut())
    rows = interpolated(times, track.time, table)
    return _Prepared(name, float(lag[-1]), [SignalBlock(column, residual[part], rows[part])
                                            for part in _parts(times, edges)])


def _parts(time: FloatArray, edges: FloatArray) -> list[slice]:
    places = np.searchsorted(time, [*edges, time[-1] + 1.0])
    return [slice(a, b) for a, b in zip(places[:-1], places[1:])]


def _fitted_to(item: _Prepared, shifts: Sequence[float]) -> SignalBaseline:
    """Return the baseline of one signal without its scores, fitted to its shifted blocks."""
    residual = np.concatenate([part.shifted(shift).residual
                               for part, shift in zip(item.parts, shifts, strict=True)])
    rows = np.concatenate([part.rows for part in item.parts])
    centre, scale = rows.mean(axis=0), rows.std(axis=0)
    scale = np.where(_moves(rows, scale), scale, 0.0)
    least = READINGS[SIGNALS.index(item.name)].sensor.least
    own = standardised(rows, centre, scale)
    coefficients = _fitted(own, residual, least)
    sigma = _robust(residual - own @ coefficients, least)
    return SignalBaseline(item.lag, centre, scale, coefficients, sigma,
                          *np.zeros((3, len(SCORES))))


def _moves(rows: FloatArray, scale: FloatArray) -> NDArray[np.bool_]:
    """Return which regressors more than rounding moves; the others have nothing to say."""
    size = np.abs(rows).max(axis=0)
    # the slope of a constant is what rounding makes of it, in a second
    of_signals, slopes = size[1:SLOPES], size[SLOPES:WAY]
    np.maximum(slopes, of_signals, out=slopes)
    return np.asarray(scale > 1e-9 * np.maximum(size, 1e-9))


def _robust(values: FloatArray, least: float) -> float:
    """Return a standard deviation that spikes do not raise, at least this one."""
    off = np.abs(values - np.median(values))
    sigma = max(1.4826 * float(np.median(off)), least)
    return max(sigma, float(values[off < CUT * sigma].std()))


def _fitted(rows: FloatArray, residual: FloatArray, least: float) -> FloatArray:
    """Return coefficients by least squares with a ridge, spikes left out."""
    keep = np.ones(residual.size, dtype=bool)
    found: FloatArray = np.zeros(rows.shape[1])
    for _ in range(3):
        kept = rows[keep]
        gram = kept.T @ kept + _RIDGE * len(kept) * np.eye(rows.shape[1])
        found = np.asarray(np.linalg.solve(gram, kept.T @ residual[keep]))
        left = residual - rows @ found
        keep = np.abs(left - np.median(left)) < CUT * _robust(left, least)
    return found


def _shifts(prepared: Mapping[str, _Prepared],
            signals: Mapping[str, SignalBaseline]) -> tuple[FloatArray, FloatArray]:
    """Return the shift of each block [s] and its weight, shape (n,)."""
    found = [shift_of([(signals[name], part) for name, part in zip(prepared, parts)])
             for parts in zip(*(item.parts for item in prepared.values()))]
    shifts, weights = np.array(found).reshape(-1, 2).T
    return shifts, weights


def _smooth(shifts: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the shifts of blocks as a course over time [s]."""
    blocks = np.arange(shifts.size)
    kernel = np.exp(-np.abs(blocks[:, np.newaxis] - blocks) * BLOCK_S / DRIFT_S)
    return np.asarray(kernel @ (weights * shifts) / np.maximum(kernel @ weights, 1e-30))


def _with_scores(bare: SignalBaseline, parts: Sequence[SignalBlock],
                 shifts: Sequence[float]) -> SignalBaseline:
    """Return a baseline with mean and scatter of its scores."""
    table = np.array([block_scores(bare, part.shifted(shift))[0]
                      for part, shift in zip(parts, shifts, strict=True)])
    mean, deviation, allowance = np.array([_standard(column) for column in table.T]).T
    return replace(bare, mean=mean, deviation=deviation, allowance=allowance)


def _standard(values: FloatArray) -> tuple[float, float, float]:
    """Return mean, deviation and allowance of a score's blocks."""
    there = values[np.isfinite(values)]
    n = there.size
    if n < 10 or np.ptp(there) < 1e-9:
        return 0.0, 0.0, 0.0
    centred = there - there.mean()
    variance = float((centred**2).mean()) * n / (n - 1)
    # of the long run, of a first-order autoregression; the estimate is low by so much (Kendall)
    alike = float((centred[1:] * centred[:-1]).sum() / (centred**2).sum())
    alike = min(max(alike + (1.0 + 3.0 * alike) / n, 0.0), _MOST_ALIKE)
    inflation = (1.0 + alike) / (1.0 - alike)
    upper = math.sqrt((n - 1) / chi2.ppf(0.025, n - 1))
    deviation = max(math.sqrt(variance * inflation) * upper, _LEAST_DEVIATION,
                    float(np.abs(centred).max()) / _WORST)
    allowance = 2.0 * math.sqrt(variance * inflation / n) / deviation
    return float(there.mean()), deviation, allowance
