# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What was measured in one test, and the noise in it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from simgap.machine.arrays import FloatArray
from simgap.machine.responses import ProcessResponses


@dataclass(frozen=True)
class Colour:
    """The colour of noise: a filter whose output is white, see `noise`."""

    pole: float = 0.0  # of the slow part, for one sample; 0 if there is none
    gain: float = 0.0  # share of an innovation that stays in the slow part
    level: float = 1.0  # standard deviation of the innovations, in units of the stated noise


@dataclass(frozen=True)
class Excerpt:
    """Of which recording, how long that is, and when in it the test's time is zero [s]."""

    recording: str
    of_s: float
    zero_s: float = 0.0


@dataclass(frozen=True)
class Experiment:
    """
    What was measured in one test.

    time : shape (n,) [s]
    channels, units : names and units of the c signals
    measured : shape (n, c); NaN where there is no sample
    noise : standard deviation of the residuals of a perfect model, shape (n, c)
    quantised : names of signals whose residual at rest is a fraction of a digit, not noise
    model_error : slow error of a right model, shape (c,), as read; None for a usual share
    colours : of the noise of each signal, as a diagnosis finds it; empty for white noise
    process : what acts on the machine every day; None for nothing
    labels : what was different in this test, such as load: A; see `interventions`
    excerpt : of which recording it is; None if that is not known
    """

    name: str
    time: FloatArray
    channels: tuple[str, ...]
    units: tuple[str, ...]
    measured: FloatArray
    noise: FloatArray
    quantised: tuple[str, ...] = ()
    model_error: FloatArray | None = None
    colours: tuple[Colour, ...] = ()
    process: ProcessResponses | None = None
    labels: Mapping[str, str] = field(default_factory=dict)
    excerpt: Excerpt | None = None

    @property
    def recorded_time(self) -> FloatArray:
        """Return the time of the recording, shape (n,) [s]."""
        return self.time + (self.excerpt.zero_s if self.excerpt else 0.0)

    def model_error_of(self, channel: int, share: float) -> float:
        """Return the model's error in a signal; by default a share of the signal's spread."""
        if self.model_error is not None:
            return float(self.model_error[channel])
        values = self.measured[:, channel]
        return share * float(np.nanstd(values)) if np.isfinite(values).any() else 0.0
