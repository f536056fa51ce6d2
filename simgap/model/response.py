# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How the readings of a machine of one's own answer to its numbers."""

from collections.abc import Iterator
from dataclasses import dataclass
import math

import numpy as np
from simgap.machine.contract import Form, Parameter, Point
from simgap.model.machine import OwnMachine

# A response below this is none, in standard deviations of the noise.
NO_RESPONSE = 1e-6


@dataclass(frozen=True)
class StepResponse:
    """How readings answer to a step of a number, in standard deviations."""

    acts: bool  # False if nothing changes
    roughness: float  # share by which the difference quotient changes if its step is doubled


def responses(machine: OwnMachine, parameter: Parameter, point: Point) -> Iterator[StepResponse]:
    """Yield how each test on which a number acts answers to a step of it at a point."""
    here = point.get(parameter.name, 0.0)
    step = parameter.step if here + 2.0 * parameter.step <= parameter.high else -parameter.step
    for k, experiment in enumerate(machine.experiments):
        if parameter.experiment not in (None, k):
            continue
        before = machine.predict(point, k)
        one, two = ((machine.predict({**point, parameter.name: here + count * step}, k)
                     - before) / experiment.noise for count in (1.0, 2.0))
        there = np.isfinite(one) & np.isfinite(two)
        if not there.any() or float(np.abs(one[there]).max()) < NO_RESPONSE:
            yield StepResponse(False, 0.0)
            continue
        size = 0.5 * math.sqrt(float(np.mean(two[there] ** 2)))
        off = math.sqrt(float(np.mean((one[there] - 0.5 * two[there]) ** 2)))
        yield StepResponse(True, off / size)


def where_it_acts(form: Form, parameter: Parameter) -> dict[str, float]:
    """Return a point where an effect is there: at its edge many a law has a corner."""
    return {**form.start, parameter.name: 0.25 * max(parameter.low, parameter.high, key=abs)}


def derivative_error(machine: OwnMachine) -> float:
    """Return by which share the worst difference quotient changes where its step is doubled."""
    places: list[tuple[Parameter, Point]] = [(parameter, {}) for parameter in machine.nuisances]
    places += [(parameter, where_it_acts(form, parameter))
               for effect in machine.catalogue.values() for form in effect.forms
               for parameter in form.sizes]
    return max((item.roughness for parameter, point in places
                for item in responses(machine, parameter, point)), default=0.0)
