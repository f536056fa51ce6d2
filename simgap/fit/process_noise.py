# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Noise of the process, such as wind: it moves the machine, and so shows in all readings at once.

Its covariance U U^T, with U of `Experiment.process`, stands beside that of the sensors. Nothing of
it is fitted: residuals are made white under the sum of both. In the eigenvectors of that sum where
the sensors' noise is white, a residual counts by 1 / (1 + s^2), with the process' deviation s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from simgap.machine.contract import Experiment, FloatArray

# Directions in which the process moves readings by a smaller share of their noise do not count.
_LEAST = 0.1


@dataclass(frozen=True)
class ProcessNoise:
    """Noise of the process in readings whose sensors' noise is white and of variance 1."""

    directions: NDArray[np.float32]  # orthonormal, shape (n, k)
    deviations: FloatArray  # of the process in them, shape (k,)

    @classmethod
    def of(cls, columns: FloatArray) -> ProcessNoise:
        """Return that of a response to independent inputs of variance 1, shape (n, m)."""
        squares, vectors = np.linalg.eigh(columns.T @ columns)
        kept = squares > _LEAST ** 2
        deviations = np.sqrt(squares[kept])
        return cls((columns @ (vectors[:, kept] / deviations)).astype(np.float32), deviations)

    def whitened(self, residual: FloatArray, scale: float) -> FloatArray:
        """Return residuals, shape (n,) or (n, m), that are white, at a scale of the noise."""
        share = 1.0 - 1.0 / np.hypot(1.0, self.deviations / scale)
        along = self.directions.T @ residual.astype(np.float32)
        return residual - self.directions @ (share * along.T).T.astype(np.float32)


def without_process(experiment: Experiment, residual: FloatArray, bound: float) -> FloatArray:
    """
    Return a residual, measured minus predicted, less what the process most probably does in it.

    Both have the shape (n, c). Beyond a bound, in standard deviations, it is none of the process.
    """
    if experiment.process is None:
        return residual
    there = np.isfinite(residual)
    z = np.clip(residual / experiment.noise, -bound, bound)[there]
    columns = (experiment.process / experiment.noise[..., np.newaxis])[there]
    square = columns.T @ columns + np.eye(columns.shape[1])
    return residual - experiment.process @ np.linalg.solve(square, columns.T @ z)
