# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a simulation program does for a model file: MuJoCo and FMUs stand behind this."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from simgap.machine.contract import FloatArray


@dataclass(frozen=True)
class Ports:
    """Names in a simulation program, each with the entry of the model file that gives it."""

    places: Mapping[str, str]  # parameters and initial states that are written before a run
    inputs: Mapping[str, str]  # what the log feeds in
    pushes: Mapping[str, str]  # where something unknown may enter
    outputs: Mapping[str, str]  # what is read


class Simulator(Protocol):
    """A simulation program with the ports that a model file names."""

    defaults: FloatArray  # of the places, by the program's own file; NaN where it has none
    longest_step_s: float  # of a run
    parallel: bool  # True if several threads may call `run` at once

    def run(self, values: FloatArray, start_s: float, step_s: float,
            inputs: FloatArray) -> FloatArray:
        """
        Return the outputs as each step begins, shape (n, outputs); NaN from a failure on.

        values : of the places, in their order; NaN leaves a place as it is
        start_s, step_s : time of the first row, and from row to row [s]
        inputs : inputs, then pushes, held in a step, shape (n, inputs + pushes)
        """
