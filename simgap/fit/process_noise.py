# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Noise of the process, such as wind: it moves the machine, and so shows in all readings at once.

Its covariance U K U^T, with responses U to pulses or patterns and the covariance K of their sizes,
is added to that of the sensors. Nothing is fitted: residuals are made white under the sum. Where
the sensors' noise is white, a residual along an eigenvector counts by 1 / (1 + s^2), with the
process' deviation s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from simgap.machine.contract import Experiment, FloatArray

# Directions in which the process moves readings by a smaller share of their noise do not count.
_LEAST = 0.1


@dataclass(frozen=True)
class ProcessNoise:
    """Noise of the process in readings whose sensors' noise is white and of variance 1."""

    responses: sparse.csr_array  # to pulses, most of which end soon, shape (n, m)
    transposed: sparse.csr_array  # the same, shape (m, n)
    turns: NDArray[np.float32]  # of them into orthonormal directions, shape (m, k)
    deviations: FloatArray  # of the process in these, shape (k,)

    @classmethod
    def of(cls, responses: sparse.csr_array, root: FloatArray) -> ProcessNoise:
        """Return that of responses, shape (n, m), to pulses whose covariance has a root."""
        single, root = responses.astype(np.float32), root.astype(np.float32)
        squares, vectors = np.linalg.eigh(root.T @ (single.T @ single).toarray() @ root)
        kept = squares > _LEAST ** 2
        deviations = np.sqrt(squares[kept]).astype(float)
        turns = root @ (vectors[:, kept] / deviations.astype(np.float32))
        return cls(single, single.T.tocsr(), turns, deviations)

    def whitened(self, residual: FloatArray, scale: float) -> FloatArray:
        """Return residuals, shape (n,) or (n, m), that are white, at a scale of the noise."""
        share = 1.0 - 1.0 / np.hypot(1.0, self.deviations / scale)
        along = self.turns.T @ (self.transposed @ residual.astype(np.float32))
        return residual - self.responses @ (self.turns @ (share * along.T).T.astype(np.float32))


def without_process(experiment: Experiment, residual: FloatArray, bound: float) -> FloatArray:
    """
    Return a residual, measured minus predicted, less what the process most probably does in it.

    Both have the shape (n, c). Beyond a bound, in standard deviations, it is none of the process.
    """
    if experiment.process is None:
        return residual
    there, root = np.isfinite(residual), experiment.process.root
    z = np.where(there, np.clip(residual / experiment.noise, -bound, bound), 0.0).ravel()
    responses = experiment.process.matrix(len(residual))
    seen = sparse.diags_array((there / experiment.noise).ravel()) @ responses
    square = root.T @ (seen.T @ seen).toarray() @ root + np.eye(root.shape[1])
    heights = root @ linalg.solve(square, root.T @ (seen.T @ z), assume_a='pos')
    return residual - (responses @ heights).reshape(residual.shape)
