# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The configuration as a healthy machine has it: the tolerances of a quiet record, fitted.

It is the first fit of a diagnosis, the one without effects. A twin that has the machine's own
numbers is several times closer to it than one with the numbers of the drawing.
"""

from __future__ import annotations

from pathlib import Path
import tempfile

from antenna_drive.diagnosis.corrected import correct
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.recording import Recording
from simgap.fit.least_squares import LeastSquares
from simgap.fit.starts import with_initial_conditions
from simgap.search.hypothesis import Hypothesis
from simgap.settings import DEFAULT

# Fits, each with the noise that the one before has left, and steps of each.
_PASSES, _STEPS = 3, 12


def tuned(recording: Recording, drive: Drive) -> str:
    """
    Return a configuration file with the tolerances in it, as a quiet record shows them.

    Parameters
    ----------
    recording
        of a healthy drive that stood still at the beginning, with its test sheet
    drive
        the configuration

    Raises
    ------
    UserError : the recording cannot be compared with the drive

    """
    machine = AntennaMachine({'quiet record': recording}, drive, threads=1)
    problem = LeastSquares(machine)
    point = with_initial_conditions(problem, {})
    state = problem.start(machine.nuisances, point)
    for _ in range(_PASSES):
        # what is not explained yet counts as noise
        level = problem.noise_level(state.residual)
        problem = problem.at_scale(level if level > DEFAULT.search.strong else 1.0)
        state = problem.start(machine.nuisances, with_initial_conditions(problem, state.point()))
        state = problem.fit(state, _STEPS)
    return correct(drive, machine.records, Hypothesis((), (), state)).text


def loaded(text: str) -> Drive:
    """
    Return the drive of a configuration file that is kept as text.

    Raises
    ------
    ParameterError : an entry is not allowed

    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'tuned.yaml'
        path.write_text(text, encoding='utf-8')
        return load(path)
