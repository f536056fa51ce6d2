# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Responses of a test's readings to pulses of an input, each of which ends soon."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from simgap.machine.arrays import FloatArray


@dataclass(frozen=True)
class Responses:
    """
    Responses to m pulses in a test with c readings, w samples of each.

    first : sample at which each begins, shape (m,)
    values : of the readings from there on, shape (w, c, m)
    """

    first: NDArray[np.intp]
    values: FloatArray

    @classmethod
    def of(cls, first: Sequence[int], values: Sequence[FloatArray]) -> 'Responses':
        """Put responses together, shape (w, c) with any w each."""
        whole = np.zeros((max(map(len, values)), values[0].shape[1], len(values)))
        for j, part in enumerate(values):
            whole[:len(part), :, j] = part
        return cls(np.array(first), whole)

    def longer(self) -> 'Responses':
        """Return responses that are watched for twice as long."""
        return Responses(self.first, np.concatenate([self.values, np.zeros_like(self.values)]))

    def during(self, values: FloatArray) -> FloatArray:
        """Return values of a test, shape (n, c), during each response, shape (w, c, m)."""
        rows = np.arange(len(self.values))[:, np.newaxis] + self.first
        return np.asarray(values[np.minimum(rows, len(values) - 1)].transpose(0, 2, 1))

    def matrix(self, samples: int) -> sparse.csr_array:
        """Return the responses in a test of so many samples, shape (n c, m)."""
        width, channels, count = self.values.shape
        sample = np.arange(width)[:, np.newaxis, np.newaxis] + self.first
        row = sample * channels + np.arange(channels)[:, np.newaxis]
        kept = (self.values != 0.0) & (sample < samples)
        column = np.broadcast_to(np.arange(count), self.values.shape)
        return sparse.csr_array((self.values[kept], (row[kept], column[kept])),
                                (samples * channels, count))


@dataclass(frozen=True)
class _Parts:
    """Responses to pulses of several kinds, m of them in all."""

    parts: Sequence[Responses]

    def matrix(self, samples: int) -> sparse.csr_array:
        """Return the responses in a test of so many samples, shape (n c, m)."""
        return sparse.hstack([part.matrix(samples) for part in self.parts], 'csr')


@dataclass(frozen=True)
class Answers(_Parts):
    """
    Answers of a test's readings to an input with heights at even times, and lines between them.

    mixed : what the pulses have of the heights, shape (m, k)
    times : of the heights, shape (k,) [s]
    """

    mixed: FloatArray
    times: FloatArray

    def summed(self, heights: FloatArray, samples: int) -> FloatArray:
        """Return the answers to heights, shape (k, ...), in so many samples, shape (n, c, ...)."""
        moved = self.matrix(samples) @ (self.mixed @ heights)
        return np.asarray(moved).reshape(samples, -1, *heights.shape[1:])


@dataclass(frozen=True)
class ProcessResponses(_Parts):
    """
    What acts on a machine every day, in a test.

    root : of the covariance of how much there is of each of these responses, shape (m, k)
    beyond : rms of what it does to the readings beyond these responses, shape (n, c)
    """

    root: FloatArray
    beyond: FloatArray

    @classmethod
    def together(cls, places: Sequence['ProcessResponses']) -> 'ProcessResponses':
        """Return that of several places."""
        return cls([part for place in places for part in place.parts],
                   linalg.block_diag(*(place.root for place in places)),
                   np.sqrt(np.sum([place.beyond ** 2 for place in places], axis=0)))
