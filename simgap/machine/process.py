# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What acts on a machine every day, such as wind: how much and in which pattern it moves readings.

Such an input may change at any rate. It is Gaussian, with as much in each octave of time between
a pulse and the test. Where the machine is nearly linear, readings are moved in a pattern that is
known: by the responses to slow pulses, each of which is simulated alone to the end, and by those
to what is faster, which soon end. Where it sticks and slips, a little wind decides when, and no
sum of responses says what follows. How far they hold is seen from random courses (statistical
linearisation: R. C. Booton, IRE Transactions on Circuit Theory 1, 9, 1954).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d
from simgap.machine.arrays import FloatArray, Point
from simgap.machine.experiment import Experiment
from simgap.machine.machine import DisturbanceInput, Machine
from simgap.machine.pulses import pulse_responses, root
from simgap.machine.responses import ProcessResponses, Responses

# Pulses in one of an unknown input: what resonates is moved, too.
_FINER = 2
# Times of change in the covariance.
_TIMES = 8
# Random courses.
_DRAWS = 10


def process(machine: Machine, point: Point) -> list[ProcessResponses | None]:
    """Return of each experiment the response to what acts every day, see `Experiment.process`."""
    faster = machine.low_fidelity()
    places = [_of_place(faster, point, place) for place in faster.disturbance_inputs
              if place.everyday]
    return [ProcessResponses.together(test) for test in zip(*places, strict=True)] or [
        None for _ in machine.experiments]


def with_process(machine: Machine) -> Machine:
    """Return a machine in planned tests, in which what acts every day acts as well."""
    return machine.with_experiments([acting(e, part) for e, part in zip(
        machine.experiments, process(machine, {}), strict=True)])


def acting(experiment: Experiment, process: ProcessResponses | None) -> Experiment:
    """Return an experiment in which something acts every day."""
    if process is None:
        return replace(experiment, process=None)
    beyond = process.beyond[:experiment.time.size]
    return replace(experiment, process=process, noise=np.hypot(experiment.noise, beyond))


def calm(experiment: Experiment) -> Experiment:
    """Return an experiment without what acts every day; the inverse of `acting`."""
    if experiment.process is None:
        return experiment
    beyond = experiment.process.beyond[:experiment.time.size]
    return replace(experiment, process=None, noise=np.sqrt(experiment.noise ** 2 - beyond ** 2))


@dataclass(frozen=True)
class _Heights:
    """Heights of pulses in a test: those of slow ones, and what is left for quick ones."""

    root: FloatArray  # of the covariance of all, shape (k, k)
    spread: FloatArray  # of slow pulses over the quick ones, shape (k, j)

    @classmethod
    def until(cls, end: float, quick_s: float, slow_s: float) -> '_Heights':
        quick, slow = np.arange(0.0, end, quick_s), np.arange(0.0, end + slow_s, slow_s)
        return cls(root(quick.size, np.geomspace(1.0, quick.size, _TIMES)), np.maximum(
            0.0, 1.0 - np.abs(quick[:, np.newaxis] - slow) / slow_s))

    def parted(self, heights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what slow pulses and quick ones have of heights, shape (k,) or (k, n)."""
        slow = np.linalg.pinv(self.spread) @ heights
        return slow, heights - self.spread @ slow


def _of_place(machine: Machine, point: Point, place: DisturbanceInput) -> list[ProcessResponses]:
    scales = machine.time_scales
    finer = replace(scales, pulse_s=scales.pulse_s / _FINER, response_s=2.0 * scales.response_s)
    slow_s = scales.response_s
    still = machine.simulate([point])[0]
    ends = [float(e.time[-1]) + finer.pulse_s for e in machine.experiments]
    tests = [_Heights.until(end, finer.pulse_s, slow_s) for end in ends]
    longest = tests[int(np.argmax(ends))]

    def moved(times: FloatArray, heights: FloatArray) -> list[FloatArray]:
        """Return by how much a course moves the readings of each test."""
        found = machine.simulate_disturbed(
            point, place, lambda time: place.everyday * np.interp(time, times, heights))
        return [np.nan_to_num(one - none) for one, none in zip(found, still, strict=True)
                if none is not None]

    slow = np.arange(0.0, max(ends) + slow_s, slow_s)
    alone = [moved(slow, height) for height in np.eye(slow.size, dtype=np.float64)]
    responses, roots, choices = [], [], []
    for k, (own, (quick, peaks)) in enumerate(zip(tests, pulse_responses(
            machine, point, place, finer, place.everyday), strict=True)):
        choice = np.rint(peaks / finer.pulse_s).astype(int)
        whole = np.stack([row[k] for row in alone[:own.spread.shape[1]]], axis=-1)
        responses.append((quick, Responses(np.zeros(whole.shape[-1], int), whole)))
        below, above = own.parted(own.root)
        roots.append(np.concatenate([above[choice], below]))
        choices.append(choice)

    random = np.random.default_rng(0)
    draws = [longest.root @ random.standard_normal(len(longest.root)) for _ in range(_DRAWS)]
    seen = [moved(finer.pulse_s * np.arange(len(longest.root)), heights) for heights in draws]
    found = []
    for k, own in enumerate(tests):
        parts = [own.parted(heights[:len(own.root)]) for heights in draws]
        shape = seen[0][k].shape
        quick, slowly = (part.matrix(shape[0]) for part in responses[k])
        summed = [(quick @ above[choices[k]] + slowly @ below).reshape(shape)
                  for below, above in parts]
        found.append(_linearised(responses[k], roots[k], summed, [row[k] for row in seen],
                                 machine.experiments[k], finer.response_s))
    return found


def _linearised(parts: Sequence[Responses], root: FloatArray, summed: Sequence[FloatArray],
                seen: Sequence[FloatArray], experiment: Experiment,
                window_s: float) -> ProcessResponses:
    """Return responses in so far as their sums, shape (n, c) each, say what was seen."""
    samples = max(int(window_s / float(np.median(np.diff(experiment.time)))), 1)

    def mean(products: Sequence[FloatArray]) -> FloatArray:
        return np.asarray(uniform_filter1d(np.mean(products, axis=0), samples, axis=0))

    both = mean([one * other for one, other in zip(summed, seen, strict=True)])
    power = mean([one ** 2 for one in summed])
    share = np.clip(both / np.maximum(power, 1e-30), 0.0, 1.0)
    beyond = mean([(other - share * one) ** 2 for one, other in zip(summed, seen, strict=True)])
    return ProcessResponses([replace(part, values=part.values * part.during(share))
                             for part in parts], root, np.sqrt(beyond))
