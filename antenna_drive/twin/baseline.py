# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a healthy drive's residuals are like: learned from its own quiet record.

A healthy machine differs from its configuration within tolerances, and each residual is then a
course over time that repeats with the motion. Four steps turn it into numbers of mean zero and
variance one, in which a change shows:

1. What a linear combination of the twin's own signals explains is taken out: errors of gains,
   zeros, delays and levels of friction. The coefficients are those of the quiet record.
2. A jump of the command lies somewhere between two of its samples, so the whole twin may be early
   or late by up to that. In each block the shift that all signals have in common is taken out.
   What it is over many blocks, the clocks of command and readings have drifted apart by.
3. What is left is summed over blocks of a second: its mean, its products with the signal, with
   the signal's slope and with the direction of motion, and the logarithm of its size. These are
   the scores of the local approach (A. Benveniste, M. Basseville, G. Moustakides, IEEE Trans.
   Automatic Control 32 (1987) 583): a change of any number of the machine moves some of them.
4. Scores are standardised by their mean and scatter in the quiet record. Where neighbouring
   blocks are alike, the scatter is that of the long run of a first-order autoregression
   (R. A. Johnson, M. Bagshaw, Technometrics 16 (1974) 103; its bias after M. G. Kendall,
   Biometrika 41 (1954) 403).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any

from antenna_drive.emulator.unit import FloatArray
from antenna_drive.readings import AT, READINGS
import numpy as np
from scipy.signal import lfilter

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
# Between the samples of a recorder of whose spacing nothing is known [s].
_USUAL_S = 0.01
ENCODER, _RATE = AT['encoder'], AT['tach_1']
# Columns of the regressors: the first slope, and the direction.
SLOPES, WAY = 1 + len(READINGS), 1 + 2 * len(READINGS)
# Residuals beyond so many robust standard deviations are cut: one spike is no gap.
CUT = 8.0
# Motion that leaves the quiet record by more than this factor is not judged.
_BEYOND = 1.25
# Rounds in which the shift of a block is found.
_SHIFT_ROUNDS = 5
# Shifts that have lasted for this time are a drift of clocks [s].
DRIFT_S = 10.0


@dataclass(frozen=True)
class SignalBaseline:
    """What is known of one signal of a healthy drive."""

    lag: float  # by which the reading is late [s]
    # of the regressors, shape (m,)
    centre: FloatArray
    scale: FloatArray
    coefficients: FloatArray  # of the standardised regressors, in units of the signal, shape (m,)
    sigma: float  # robust standard deviation of what is left, in units of the signal
    # of the scores, shape (5,); deviation 0 where a score says nothing
    mean: FloatArray
    deviation: FloatArray
    allowance: FloatArray  # two standard errors of the mean, shape (5,), in deviations


@dataclass(frozen=True)
class Baseline:
    """What is known of a healthy drive."""

    signals: Mapping[str, SignalBaseline]  # by name
    # greatest rate command [rad/s] and greatest rms slope of it in a block [rad/s^2]
    envelope: tuple[float, float]
    spacing: float  # of the samples of the command: how far a block may be shifted [s]
    blocks: int  # of the quiet record

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
    def of_plain(cls, data: Mapping[str, Any]) -> 'Baseline':
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


def residual_of(column: int, values: FloatArray, twin: FloatArray, times: FloatArray,
                wash_out: WashOut) -> FloatArray:
    """Return measured minus twin; that of the encoder behind its high-pass."""
    residual = values - twin
    if column != ENCODER:
        return residual
    return wash_out(residual, float(np.median(np.diff(times))) if times.size > 1 else _USUAL_S)


def interpolated(times: FloatArray, grid: FloatArray, table: FloatArray) -> FloatArray:
    """Return the rows of an even table at other times, shape (n, m)."""
    place = np.clip(np.searchsorted(grid, times, side='right') - 1, 0, grid.size - 2)
    part = ((times - grid[place]) / (grid[place + 1] - grid[place]))[:, np.newaxis]
    return np.asarray((1.0 - part) * table[place] + part * table[place + 1])


def regressors(time: FloatArray, course: FloatArray) -> FloatArray:
    """
    Return what a healthy drive's residual may be made of, shape (n, 16).

    A constant, each reading and its slope, the direction of motion, and the jerk of motor 1.

    time : even, shape (n,) [s]
    course : the twin's readings there, that of the encoder behind its high-pass, shape (n, 6)
    """
    slopes = np.gradient(course, time, axis=0)
    way = np.tanh(course[:, _RATE] / _STANDS)  # the direction, -1 to 1
    return np.column_stack([
        np.ones(time.size), course, slopes, way,
        np.gradient(slopes[:, _RATE], time), np.abs(course[:, _RATE])])


def standardised(rows: FloatArray, centre: FloatArray, scale: FloatArray) -> FloatArray:
    """Return regressors with mean 0 and variance 1; a constant one is 0, the first one 1."""
    safe = np.where(scale > 0.0, scale, 1.0)
    result = np.where(scale > 0.0, (rows - centre) / safe, 0.0)
    result[:, 0] = 1.0
    return np.asarray(result)


@dataclass(frozen=True)
class SignalBlock:
    """One signal in one block."""

    column: int  # of the signal among the readings
    residual: FloatArray  # measured minus twin, shape (n,)
    rows: FloatArray  # regressors at the same times, shape (n, 16)

    @property
    def slope(self) -> FloatArray:
        """Return the slope of the twin's signal, shape (n,)."""
        return np.asarray(self.rows[:, SLOPES + self.column])

    def shifted(self, shift_s: float) -> 'SignalBlock':
        """Return the part beside a twin that is earlier by a time [s]."""
        return replace(self, residual=self.residual - shift_s * self.slope)

    def left(self, baseline: SignalBaseline) -> FloatArray:
        """Return what the regressors of a baseline leave of the residual, shape (n,)."""
        own = standardised(self.rows, baseline.centre, baseline.scale)
        return np.asarray(self.residual - own @ baseline.coefficients)


def shift_of(block: Sequence[tuple[SignalBaseline, SignalBlock]]) -> tuple[float, float]:
    """
    Return by how much the twin is late in one block [s], and what that weighs [1/s^2].

    block : each signal's baseline and its part of the block
    """
    left = np.concatenate([part.left(item) / item.sigma for item, part in block])
    slope = np.concatenate([part.slope / item.sigma for item, part in block])
    square = float(slope @ slope)
    found = 0.0
    for _ in range(_SHIFT_ROUNDS if square > 0.0 else 0):
        # Huber's way: a spike counts as much as the cut
        found += float(np.clip(left - found * slope, -CUT, CUT) @ slope) / square
    return found, square


def scores(left: FloatArray, signal: FloatArray, slope: FloatArray,
           way: FloatArray) -> FloatArray:
    """
    Return the scores of one signal in one block, shape (5,), NaN for too few samples.

    left : what is left of the residual, in its standard deviations, shape (n,)
    signal, slope, way : the signal and its slope, standardised, and the direction of motion, shape
        (n,)
    """
    if left.size < LEAST_SAMPLES:
        return np.full(len(SCORES), np.nan)
    cut = np.clip(left, -CUT, CUT)
    return np.array([cut.mean(), (cut * signal).mean(), (cut * slope).mean(), (cut * way).mean(),
                     0.5 * math.log1p(float((cut**2).mean()))])


def block_scores(baseline: SignalBaseline, part: SignalBlock) -> tuple[FloatArray, FloatArray]:
    """Return the scores of one signal in one block, and what is left of its residual."""
    own = standardised(part.rows, baseline.centre, baseline.scale)
    left = part.left(baseline)
    return scores(left / baseline.sigma, own[:, 1 + part.column],
                  own[:, SLOPES + part.column], part.rows[:, WAY]), left
