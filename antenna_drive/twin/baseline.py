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
What a healthy drive's residuals are like: learned from its own quiet record.

A healthy machine differs from its configuration within tolerances, and each residual is then a
course over time that repeats with the motion. Three steps turn it into numbers of mean zero and
variance one, in which a change shows:

1. What a linear combination of the twin's own signals explains is taken out: errors of gains,
   zeros, delays and levels of friction. The coefficients are those of the quiet record.
   A jump of the command lies somewhere between two of its samples, so the whole twin may be early
   or late by up to that. In each block the shift that all signals have in common is taken out.
   What it is over many blocks, the clocks of command and readings have drifted apart by.
2. What is left is summed over blocks of a second: its mean, its products with the signal, with
   the signal's slope and with the direction of motion, and the logarithm of its size. These are
   the scores of the local approach (A. Benveniste, M. Basseville, G. Moustakides, IEEE Trans.
   Automatic Control 32 (1987) 583): a change of any number of the machine moves some of them.
3. Scores are standardised by their mean and scatter in the quiet record. Where neighbouring
   blocks are alike, the scatter is that of the long run of a first-order autoregression
   (R. A. Johnson, M. Bagshaw, Technometrics 16 (1974) 103; its bias after M. G. Kendall,
   Biometrika 41 (1954) 403). Both are known from n blocks only. The scatter is therefore taken
   at the upper end of its 95 percent interval, and the reference value of the chart is raised by
   two standard errors of the mean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any

from antenna_drive.emulator.batch import CHANNELS
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.recording.recording import unit_of
import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

BLOCK_S = 1.0
# A block with fewer samples of a signal says nothing of it.
LEAST_SAMPLES = 5
SCORES = ('mean', 'with the signal', 'with its slope', 'with the direction', 'size')
# Only a size that grows is a gap.
TWO_SIDED = np.array([True, True, True, True, False])
# The direction is told from the rate of motor 1 beyond this [rad/s].
_STANDS = 0.3
# The encoder counts on with every error of a rate: it is compared behind a high-pass of this
# time [s].
WASH_OUT_S = 3.0
ENCODER = CHANNELS.index('plant/encoder')
_RATE = CHANNELS.index('motor_1/tach_rate')
# Columns of the regressors: the first slope, and the direction.
_SLOPES, _WAY = 1 + len(CHANNELS), 1 + 2 * len(CHANNELS)
# Residuals beyond so many robust standard deviations are cut: one spike is no gap.
_CUT = 8.0
# A ridge that keeps coefficients of columns that are alike from growing, as a share of a sample.
_RIDGE = 1e-3
# Motion that leaves the quiet record by more than this factor is not judged.
_BEYOND = 1.25
# What the sensors of such a drive tell, by unit: a residual is never taken for quieter. Of angles
# it is two digits of an encoder with 21 bits.
_LEAST = {'A': 0.003, 'rad/s': 0.001, 'rad': 6e-6, 'V': 0.003}
# A score that moves by less than this share of the residual's size is no gap, however steady it
# was in the quiet record; and the quiet record's worst block is no gap either.
_LEAST_DEVIATION, _WORST = 0.1, 3.0
# The greatest correlation of neighbouring blocks that is reckoned with.
_MOST_ALIKE = 0.95
# Rounds in which the shift of a block is found; how often the quiet record is fitted with those
# that the last fit found, and before that with their course over time.
_SHIFT_ROUNDS, _SHIFT_PASSES, _DRIFT_PASSES = 5, 3, 2
# Shifts that have lasted for this time are a drift of clocks [s].
DRIFT_S = 10.0
# Lags that are tried [s].
_MOST_LAG_S, _LAG_STEP_S = 0.3, 0.005


@dataclass(frozen=True)
class Track:
    """
    A stretch of the twin's course on an even grid, and the readings of a real drive beside it.

    Attributes
    ----------
    time : of the twin, ascending, shape (n,) [s]
    course : the twin's readings, shape (n, 6), in the order of `CHANNELS`
    washed : the same with the encoder behind its high-pass
    command : axis rate command, shape (n,) [rad/s]
    spacing : of the samples of the command that the twin was driven with [s]
    samples : times [s] and values of each measured signal

    """

    time: FloatArray
    course: FloatArray
    washed: FloatArray
    command: FloatArray
    spacing: float
    samples: Mapping[str, tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class SignalBaseline:
    """
    What is known of one signal of a healthy drive.

    Attributes
    ----------
    lag : by which the reading is late [s]
    centre, spread : of the regressors, shape (m,)
    coefficients : of the standardised regressors, in units of the signal, shape (m,)
    sigma : robust standard deviation of what is left, in units of the signal
    mean, deviation : of the scores, shape (5,); deviation 0 where a score says nothing
    allowance : two standard errors of the mean, shape (5,), in deviations

    """

    lag: float
    centre: FloatArray
    spread: FloatArray
    coefficients: FloatArray
    sigma: float
    mean: FloatArray
    deviation: FloatArray
    allowance: FloatArray


@dataclass(frozen=True)
class Baseline:
    """
    What is known of a healthy drive.

    Attributes
    ----------
    signals : by name
    envelope : greatest rate command [rad/s] and greatest rms slope of it in a block [rad/s^2]
    spacing : of the samples of the command: how far a block may be shifted [s]
    blocks : of the quiet record

    """

    signals: Mapping[str, SignalBaseline]
    envelope: tuple[float, float]
    spacing: float
    blocks: int

    def judged(self, motion: tuple[float, float]) -> bool:
        """Return whether the motion of a block is one that the quiet record had."""
        return all(new <= _BEYOND * old for new, old in zip(motion, self.envelope, strict=True))

    def plain(self) -> dict[str, Any]:
        """Return plain data for a file."""
        return {'envelope': list(self.envelope), 'spacing': self.spacing, 'blocks': self.blocks,
                'signals': {
                    name: {key: value.tolist() if isinstance(value, np.ndarray) else value
                           for key, value in vars(item).items()}
                    for name, item in self.signals.items()}}

    @classmethod
    def of_plain(cls, data: Mapping[str, Any]) -> Baseline:
        """Return the baseline that `plain` gave; KeyError or TypeError if it is none."""
        signals = {}
        for name, item in data['signals'].items():
            plain: dict[str, Any] = {
                key: np.array(value, np.float64) if isinstance(value, list) else float(value)
                for key, value in item.items()}
            signals[name] = SignalBaseline(**plain)
        command, slope = map(float, data['envelope'])
        return cls(signals, (command, slope), float(data['spacing']), int(data['blocks']))


def motion_of(time: FloatArray, command: FloatArray) -> tuple[float, float]:
    """Return the greatest rate command and its rms slope in a block [rad/s, rad/s^2]."""
    slope = np.gradient(command, time) if time.size > 1 else np.zeros(1)
    return float(np.abs(command).max(initial=0.0)), float(np.sqrt(np.mean(slope**2)))


class WashOut:
    """The high-pass of the encoder; it begins at rest at its first value."""

    def __init__(self) -> None:
        """Begin."""
        self._last: float | None = None
        self._state = 0.0

    def __call__(self, values: FloatArray, step_s: float) -> FloatArray:
        """Return the next values behind the high-pass, shape (n,), `step_s` [s] apart."""
        if not values.size:
            return values
        keep = math.exp(-step_s / WASH_OUT_S)
        steps = np.diff(values, prepend=values[0] if self._last is None else self._last)
        result, _ = lfilter([1.0], [1.0, -keep], steps, zi=[keep * self._state])
        self._last, self._state = float(values[-1]), float(result[-1])
        return np.asarray(result)


def regressors(time: FloatArray, course: FloatArray) -> FloatArray:
    """
    Return what a healthy drive's residual may be made of, shape (n, 16).

    A constant, each reading and its slope, the direction of motion, and the jerk of motor 1.

    Parameters
    ----------
    time
        even, shape (n,) [s]
    course
        the twin's readings there, that of the encoder behind its high-pass, shape (n, 6)

    """
    slopes = np.gradient(course, time, axis=0)
    return np.column_stack([
        np.ones(time.size), course, slopes, direction(course),
        np.gradient(slopes[:, _RATE], time), np.abs(course[:, _RATE])])


def direction(course: FloatArray) -> FloatArray:
    """Return the direction of motion, -1 to 1, shape (n,)."""
    return np.asarray(np.tanh(course[:, _RATE] / _STANDS))


def scores(left: FloatArray, signal: FloatArray, slope: FloatArray,
           way: FloatArray) -> FloatArray:
    """
    Return the scores of one signal in one block, shape (5,), NaN for too few samples.

    Parameters
    ----------
    left
        what is left of the residual, in its standard deviations, shape (n,)
    signal, slope, way
        the signal and its slope, standardised, and the direction of motion, shape (n,)

    """
    if left.size < LEAST_SAMPLES:
        return np.full(len(SCORES), np.nan)
    cut = np.clip(left, -_CUT, _CUT)
    return np.array([cut.mean(), (cut * signal).mean(), (cut * slope).mean(), (cut * way).mean(),
                     0.5 * math.log1p(float((cut**2).mean()))])


def lag_of(track: Track, name: str) -> float:
    """
    Return by how much a reading is late, from its correlation with the twin [s].

    The lag of the greatest correlation of both, refined by a parabola; 0 where nothing moves.
    """
    times, values = track.samples[name]
    column = track.course[:, CHANNELS.index(name)]
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
    spread = float(one.std() * other.std())
    return float(((one - one.mean()) * (other - other.mean())).mean()) / spread if spread else 0.0


def learn(track: Track, begin: float) -> Baseline:
    """
    Return the baseline of a quiet record.

    Parameters
    ----------
    track
        of a healthy drive, a minute or more
    begin
        what is earlier is not learned from: high-passes have to settle [s]

    """
    table = regressors(track.time, track.washed)
    edges = np.arange(begin, track.time[-1] - 0.5 * BLOCK_S, BLOCK_S)
    motions = [motion_of(track.time[part], track.command[part])
               for part in _parts(track.time, edges)]
    envelope = (max(m[0] for m in motions), max(m[1] for m in motions))
    lags = {name: lag_of(track, name) for name in track.samples}
    late = np.zeros(len(edges))
    for _ in range(_DRIFT_PASSES):
        prepared = _all_prepared(track, table, edges, lags, late)
        signals = {name: _fitted_to(item, [0.0] * len(edges)) for name, item in prepared.items()}
        late = late - _smooth(*_shifts(prepared, signals))
    prepared = _all_prepared(track, table, edges, lags, late)
    shifts = [0.0] * len(edges)
    for _ in range(_SHIFT_PASSES):
        signals = {name: _fitted_to(item, shifts) for name, item in prepared.items()}
        shifts = np.clip(_shifts(prepared, signals)[0], -track.spacing, track.spacing).tolist()
    return Baseline({name: _with_scores(signals[name], item.parts, shifts)
                     for name, item in prepared.items()}, envelope, track.spacing, len(edges))


def _all_prepared(track: Track, table: FloatArray, edges: FloatArray, lags: Mapping[str, float],
                  late: FloatArray) -> dict[str, _Prepared]:
    return {name: found for name, lag in lags.items() if (
        found := _prepared(track, name, table, edges, lag + late)) is not None}


def _smooth(shifts: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the shifts of blocks as a course over time [s]."""
    blocks = np.arange(shifts.size)
    kernel = np.exp(-np.abs(blocks[:, np.newaxis] - blocks) * BLOCK_S / DRIFT_S)
    return np.asarray(kernel @ (weights * shifts) / np.maximum(kernel @ weights, 1e-30))


def _parts(time: FloatArray, edges: FloatArray) -> list[slice]:
    places = np.searchsorted(time, [*edges, time[-1] + 1.0])
    return [slice(a, b) for a, b in zip(places[:-1], places[1:])]


@dataclass(frozen=True)
class Part:
    """
    One signal in one block.

    Attributes
    ----------
    column : of the signal in `CHANNELS`
    residual : measured minus twin, shape (n,)
    rows : regressors at the same times, shape (n, 16)

    """

    column: int
    residual: FloatArray
    rows: FloatArray

    @property
    def slope(self) -> FloatArray:
        """Return the slope of the twin's signal, shape (n,)."""
        return np.asarray(self.rows[:, _SLOPES + self.column])

    def shifted(self, shift_s: float) -> Part:
        """Return the part beside a twin that is earlier by a time [s]."""
        return replace(self, residual=self.residual - shift_s * self.slope)

    def left(self, baseline: SignalBaseline) -> FloatArray:
        """Return what the regressors of a baseline leave of the residual, shape (n,)."""
        own = standardised(self.rows, baseline.centre, baseline.spread)
        return np.asarray(self.residual - own @ baseline.coefficients)


@dataclass(frozen=True)
class _Prepared:
    """One signal of a quiet record: its name, its lag at the end [s], and its blocks."""

    name: str
    lag: float
    parts: Sequence[Part]


def _prepared(track: Track, name: str, table: FloatArray, edges: FloatArray,
              lag: FloatArray) -> _Prepared | None:
    """Return one signal beside the twin, with its lag in each block; None if it has too little."""
    column = CHANNELS.index(name)
    times, values = track.samples[name]
    times = times - np.interp(times, edges + 0.5 * BLOCK_S, lag)
    inside = (times >= track.time[0]) & (times <= track.time[-1])
    times, values = times[inside], values[inside]
    if times.size < 10 * table.shape[1]:
        return None
    residual = residual_of(column, values, interpolated(times, track.time, track.course)[
        :, column], times, WashOut())
    rows = interpolated(times, track.time, table)
    return _Prepared(name, float(lag[-1]), [Part(column, residual[part], rows[part])
                                            for part in _parts(times, edges)])


def _fitted_to(item: _Prepared, shifts: Sequence[float]) -> SignalBaseline:
    """Return the baseline of one signal without its scores, fitted to its shifted blocks."""
    residual = np.concatenate([part.shifted(shift).residual
                               for part, shift in zip(item.parts, shifts, strict=True)])
    rows = np.concatenate([part.rows for part in item.parts])
    centre, spread = rows.mean(axis=0), rows.std(axis=0)
    spread = np.where(_moves(rows, spread), spread, 0.0)
    least = _LEAST[unit_of(item.name) or '']
    own = standardised(rows, centre, spread)
    coefficients = _fitted(own, residual, least)
    sigma = _robust(residual - own @ coefficients, least)
    return SignalBaseline(item.lag, centre, spread, coefficients, sigma,
                          *np.zeros((3, len(SCORES))))


def _shifts(prepared: Mapping[str, _Prepared],
            signals: Mapping[str, SignalBaseline]) -> tuple[FloatArray, FloatArray]:
    """Return the shift of each block [s] and its weight, shape (n,)."""
    found = [shift_of([(signals[name], part) for name, part in zip(prepared, parts)])
             for parts in zip(*(item.parts for item in prepared.values()))]
    shifts, weights = np.array(found).reshape(-1, 2).T
    return shifts, weights


def shift_of(block: Sequence[tuple[SignalBaseline, Part]]) -> tuple[float, float]:
    """
    Return by how much the twin is late in one block [s], and what that weighs [1/s^2].

    Parameters
    ----------
    block
        each signal's baseline and its part of the block

    """
    left = np.concatenate([part.left(item) / item.sigma for item, part in block])
    slope = np.concatenate([part.slope / item.sigma for item, part in block])
    square = float(slope @ slope)
    found = 0.0
    for _ in range(_SHIFT_ROUNDS if square > 0.0 else 0):
        # Huber's way: a spike counts as much as the cut
        found += float(np.clip(left - found * slope, -_CUT, _CUT) @ slope) / square
    return found, square


def _with_scores(bare: SignalBaseline, parts: Sequence[Part],
                 shifts: Sequence[float]) -> SignalBaseline:
    """Return a baseline with mean and scatter of its scores."""
    table = np.array([block_scores(bare, part.shifted(shift))[0]
                      for part, shift in zip(parts, shifts, strict=True)])
    mean, deviation, allowance = np.array([_standard(column) for column in table.T]).T
    return replace(bare, mean=mean, deviation=deviation, allowance=allowance)


def _moves(rows: FloatArray, spread: FloatArray) -> NDArray[np.bool_]:
    """Return which regressors more than rounding moves; the others have nothing to say."""
    size = np.abs(rows).max(axis=0)
    # the slope of a constant is what rounding makes of it, in a second
    of_signals, slopes = size[1:_SLOPES], size[_SLOPES:_WAY]
    np.maximum(slopes, of_signals, out=slopes)
    return np.asarray(spread > 1e-9 * np.maximum(size, 1e-9))


def interpolated(times: FloatArray, grid: FloatArray, table: FloatArray) -> FloatArray:
    """Return the rows of an even table at other times, shape (n, m)."""
    place = np.clip(np.searchsorted(grid, times, side='right') - 1, 0, grid.size - 2)
    part = ((times - grid[place]) / (grid[place + 1] - grid[place]))[:, np.newaxis]
    return np.asarray((1.0 - part) * table[place] + part * table[place + 1])


def residual_of(column: int, values: FloatArray, twin: FloatArray, times: FloatArray,
                wash_out: WashOut) -> FloatArray:
    """Return measured minus twin; that of the encoder behind its high-pass."""
    residual = values - twin
    if column == ENCODER and times.size > 1:
        return wash_out(residual, float(np.median(np.diff(times))))
    return residual


def standardised(rows: FloatArray, centre: FloatArray, spread: FloatArray) -> FloatArray:
    """Return regressors with mean 0 and variance 1; a constant one is 0, the first one 1."""
    safe = np.where(spread > 0.0, spread, 1.0)
    result = np.where(spread > 0.0, (rows - centre) / safe, 0.0)
    result[:, 0] = 1.0
    return np.asarray(result)


def _robust(values: FloatArray, least: float) -> float:
    """Return a standard deviation that spikes do not raise, at least this one."""
    off = np.abs(values - np.median(values))
    sigma = max(1.4826 * float(np.median(off)), least)
    return max(sigma, float(values[off < _CUT * sigma].std()))


def _fitted(rows: FloatArray, residual: FloatArray, least: float) -> FloatArray:
    """Return coefficients by least squares with a ridge, spikes left out."""
    keep = np.ones(residual.size, dtype=bool)
    found: FloatArray = np.zeros(rows.shape[1])
    for _ in range(3):
        kept = rows[keep]
        gram = kept.T @ kept + _RIDGE * len(kept) * np.eye(rows.shape[1])
        found = np.asarray(np.linalg.solve(gram, kept.T @ residual[keep]))
        left = residual - rows @ found
        keep = np.abs(left - np.median(left)) < _CUT * _robust(left, least)
    return found


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


def block_scores(baseline: SignalBaseline, part: Part) -> tuple[FloatArray, FloatArray]:
    """Return the scores of one signal in one block, and what is left of its residual."""
    own = standardised(part.rows, baseline.centre, baseline.spread)
    left = part.left(baseline)
    return scores(left / baseline.sigma, own[:, 1 + part.column],
                  own[:, _SLOPES + part.column], part.rows[:, _WAY]), left


def standard_scores(baseline: SignalBaseline, found: FloatArray) -> FloatArray:
    """Return scores in deviations of the quiet record, shape (5,), NaN where they say nothing."""
    safe = np.where(baseline.deviation > 0.0, baseline.deviation, np.nan)
    return np.asarray((found - baseline.mean) / safe)


def names_of_charts(signals: Sequence[str]) -> list[tuple[str, str]]:
    """Return signal and score of each chart, in the order of the charts."""
    return [(name, score) for name in signals for score in SCORES]
