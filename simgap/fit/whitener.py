# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What makes the residuals of a test white: noise of its sensors, and of its process."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from simgap.fit.noise import innovations, whitened
from simgap.fit.process_noise import ProcessNoise
from simgap.machine.contract import Experiment, FloatArray


class Whitener:
    """
    What makes the residuals of a test with n samples of c readings white.

    valid : where they count, shape (n c,); they are 0 elsewhere
    bound : of a residual [standard deviations]; what diverged is a bad prediction, not an error
    """

    def __init__(self, experiment: Experiment, valid: NDArray[np.bool_], bound: float) -> None:
        self.experiment, self._valid, self._bound = experiment, valid, bound

    def of_sensors(self, predicted: FloatArray, scale: float) -> FloatArray:
        """Return residuals, shape (n c,), in which the sensors' noise is white."""
        own = self.experiment
        z = (own.measured - predicted) / (scale * own.noise)
        for c, colour in enumerate(own.colours):
            z[:, c] = whitened(z[:, c], colour)
        z = z.ravel()
        z[~self._valid] = 0.0
        return np.clip(np.nan_to_num(z, copy=False, nan=self._bound), -self._bound, self._bound,
                       out=z)

    def changes(self, changes: FloatArray, scale: float) -> FloatArray:
        """Return changes of readings, shape (n, c, m), as residuals have them, shape (n c, m)."""
        z = self._innovations(changes / self.experiment.noise[..., np.newaxis])
        z = z.reshape(self._valid.size, -1) / scale
        z[~self._valid] = 0.0
        return self.without_process(z, scale)

    def without_process(self, z: FloatArray, scale: float) -> FloatArray:
        """Return residuals, shape (n c,) or (n c, m), in which all noise is white."""
        return z if self._process is None else self._process.whitened(z, scale)

    @cached_property
    def _process(self) -> ProcessNoise | None:
        own = self.experiment
        if own.process is None:
            return None
        white = replace(own.process, parts=[
            replace(longer, values=self._innovations(longer.values / longer.during(own.noise)))
            # a filter of slow noise goes on for a while after a response
            for longer in (part.longer() for part in own.process.parts)])
        seen = sparse.diags_array(self._valid.astype(float))
        return ProcessNoise.of(seen @ white.matrix(own.time.size), white.root)

    def _innovations(self, changes: FloatArray) -> FloatArray:
        """Return changes in standard deviations, shape (w, c, m), as white noise has them."""
        for c, colour in enumerate(self.experiment.colours):
            changes[:, c] = innovations(changes[:, c].T, colour).T
        return np.clip(np.nan_to_num(changes), -self._bound, self._bound)
