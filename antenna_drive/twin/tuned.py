# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The configuration as a healthy machine has it: the tolerances of a quiet record, fitted.

It is the first fit of a diagnosis, the one without effects. A twin that has the machine's own
numbers is several times closer to it than one with the numbers of the drawing. What the fit leaves
is beyond the tolerances: the machine is not the one of the configuration.
"""

from dataclasses import dataclass
from pathlib import Path
import tempfile

from antenna_drive.diagnosis.corrected import correct
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import READINGS
from antenna_drive.recording.recording import Recording
import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.robust_loss import robust_level
from simgap.fit.starts import with_initial_conditions
from simgap.fit.state import FitState
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT

# Fits, each with the noise that the one before has left, and steps of each.
_PASSES, _STEPS = 3, 12
# What a signal may keep, in standard deviations of its sensor's noise: a healthy drive's recorder
# may be two and a half times as noisy as the sheet says.
_NOISE = 3.0


@dataclass(frozen=True)
class Tuned:
    """What a quiet record shows of a drive."""

    text: str  # of a configuration file with the tolerances as they were fitted
    # what the record has beyond all tolerances, a line for each signal, the greatest first
    outside: tuple[str, ...] = ()


def tuned(recording: Recording, drive: Drive) -> Tuned:
    """
    Return the configuration with the tolerances as a quiet record shows them, and what is beyond.

    The healthy drive of the record stood still at the beginning. Raises UserError: the recording
    cannot be compared with the drive.
    """
    machine = AntennaMachine({'quiet record': recording}, drive, threads=1)
    problem = LeastSquares(machine)
    point = with_initial_conditions(problem, {})
    state = problem.start(machine.nuisances, point)
    for _ in range(_PASSES):
        # what is not explained yet counts as noise
        problem = problem.at_noise(problem.noise_level(state.residual))
        state = problem.start(machine.nuisances, with_initial_conditions(problem, state.point()))
        state = problem.fit(state, _STEPS)
    return Tuned(correct(drive, machine.records, Hypothesis((), (), state)).text,
                 _outside(problem, state))


def _outside(problem: LeastSquares, state: FitState) -> tuple[str, ...]:
    """Return the signals of which a fit of the tolerances leaves more than noise."""
    [test] = problem.experiments
    predicted = problem.machine.predict(state.point(), 0)
    left = problem.of_test(state.residual, 0)
    found = []
    for column, reading in enumerate(READINGS):
        there = np.isfinite(left[:, column])
        if not there.any():
            continue
        level = problem.scale * robust_level(left[there, column], DEFAULT.fit.outlier)
        if level > _NOISE:
            apart = (test.measured - predicted)[there, column]
            found.append((level, f'{reading.signal}: {np.sqrt(np.mean(apart**2)):.3g} '
                                 f'{reading.unit} rms, {level:.0f} times its noise'))
    return tuple(line for _, line in sorted(found, reverse=True))


def loaded(text: str) -> Drive:
    """Return the drive of a configuration file that is kept as text; ParameterError if wrong."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'tuned.yaml'
        path.write_text(text, encoding='utf-8')
        return load(path)
