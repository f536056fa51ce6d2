# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Error of the lock-step against a converged run, on the article's experiments.

The reference is the same drive at a macro-step of `FINE_STEP`. The error of a signal is the rms
difference in T1 to T4, as a share of the signal's rms. `stability` measures the effect of the
exchange between units on the stability limit of the torque bias.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import FINE_STEP, Run, simulate
import numpy as np

# Signals that are not compared; a missed impulse is a correction of one scheme, not a signal.
_LEFT_OUT = ('test_signal/external_torque', 'missed_impulse')
# Both runs are compared at these times [s]: a multiple of every macro-step.
_GRID = 4e-3


@dataclass(frozen=True)
class Distance:
    """The rms difference between a signal and its reference, as a share of the signal's rms."""

    experiment: str
    signal: str
    share: float


# the references of all experiments, and some more runs
@lru_cache(maxsize=32)
def _sampled(name: str, step_s: float) -> Run:
    experiment = experiments()[name]
    return simulate(experiment.drive(), experiment.duration, step_s,
                    every=round(_GRID / step_s))


def distances(step_s: float, names: Iterable[str] | None = None) -> list[Distance]:
    """
    Return the error of every signal of the experiments at a macro-step.

    step_s : macro-step [s]; must divide 4 ms
    names : of the experiments; all of T1 to T4 if None
    """
    found = []
    for name in names or experiments():
        reference, run = _sampled(name, FINE_STEP), _sampled(name, step_s)
        for signal in run.names:
            if signal.endswith(_LEFT_OUT):
                continue
            size = float(np.sqrt(np.mean(reference[signal] ** 2)))
            error = float(np.sqrt(np.mean((run[signal] - reference[signal]) ** 2)))
            if size > 0.0:
                found.append(Distance(name, signal, error / size))
    return found
