# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What acts on a machine every day, such as wind: how much and in which pattern it moves readings.

Such an input may change at any rate. It is Gaussian, with as much in each octave of time between
a pulse and the test. Where the machine is nearly linear, it moves readings in a pattern that is
known, the sum of answers to pulses. Where it sticks and slips, a little wind decides when, and no
sum says what follows. How far sums hold is seen from random courses (statistical linearisation:
R. C. Booton, IRE Transactions on Circuit Theory 1, 9, 1954). What these do beyond the sums has
patterns, too: a slip that comes late shows in all readings. Their covariance is that of the random
courses within a short time, as in an ensemble filter (G. Evensen, J. Geophys. Res. 99, 10143,
1994), with a small share that is white, because courses are few.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg
from scipy.ndimage import uniform_filter1d
from simgap.machine.arrays import FloatArray, Point
from simgap.machine.experiment import Experiment
from simgap.machine.machine import DisturbanceInput, Machine
from simgap.machine.motion import TimeScales
from simgap.machine.pulses import answers, root
from simgap.machine.responses import Answers, ProcessResponses, Responses

# Pulses in one of an unknown input: what resonates is moved, too.
_FINER = 2
# Times of change in the covariance.
_TIMES = 8
# Random courses, time in which their patterns are taken, in pulses, and the share of these.
_DRAWS, _BLOCK, _PATTERNS = 20, 4.0, 0.95
# The least size of a pattern, and the greatest of a course, which may diverge [noise].
_LEAST, _MOST = 1.0, 1e4


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


def _of_place(machine: Machine, point: Point, place: DisturbanceInput) -> list[ProcessResponses]:
    found = answers(machine, point, place, place.everyday, _FINER)
    longest = max((own.times for own in found), key=len)
    random = np.random.default_rng(0)
    draws = _root(longest.size) @ random.standard_normal((_DRAWS, longest.size)).T
    still = [machine.predict(point, k) for k in range(len(found))]
    seen = [[np.nan_to_num(one - none) for one, none in zip(machine.simulate_disturbed(
        point, place, [lambda time: place.everyday * np.interp(time, longest, heights)]
        * len(still)), still, strict=True)] for heights in draws.T]
    return [_linearised(machine.experiments[k], machine.time_scales, own, own.summed(
        draws[:own.times.size], len(still[k])), np.stack([row[k] for row in seen], axis=-1))
            for k, own in enumerate(found)]


def _root(count: int) -> FloatArray:
    """Return a root of the covariance of heights that change as much in each octave of time."""
    return root(count, np.geomspace(1.0, count, _TIMES))


def _linearised(experiment: Experiment, scales: TimeScales, own: Answers, summed: FloatArray,
                seen: FloatArray) -> ProcessResponses:
    """Return answers in so far as their sums say what was seen, and patterns of what they miss."""
    # what was summed and seen in d random courses has the shape (n, c, d)
    interval = float(np.median(np.diff(experiment.time)))

    def smooth(power: FloatArray) -> FloatArray:
        # a running sum may end a little below zero
        return np.asarray(uniform_filter1d(
            power, max(int(2.0 * scales.response_s / interval), 1), axis=0)).clip(0.0)

    share = np.clip(smooth((summed * seen).mean(axis=-1)) / np.maximum(
        smooth((summed ** 2).mean(axis=-1)), 1e-30), 0.0, 1.0)
    missed = seen - share[..., np.newaxis] * summed
    there = np.isfinite(experiment.measured)
    patterns, told = _patterns(missed * there[..., np.newaxis], np.where(
        there, experiment.noise, 1.0), max(int(_BLOCK * scales.pulse_s / interval), 1))
    return ProcessResponses(
        [*(replace(part, values=part.values * part.during(share)) for part in own.parts),
         *patterns], linalg.block_diag(own.mixed @ _root(own.times.size), *(
             np.eye(part.first.size) for part in patterns)),
        np.sqrt(smooth((missed ** 2).mean(axis=-1) - told)))


def _patterns(missed: FloatArray, noise: FloatArray,
              block: int) -> tuple[list[Responses], FloatArray]:
    """Return the patterns of random courses in each block of time, and their variance, (n, c)."""
    first, values, told = [], [], np.zeros(noise.shape)
    for begin in range(0, len(missed), block):
        rows = slice(begin, begin + block)
        courses = (_PATTERNS / _DRAWS) ** 0.5 * np.clip(
            missed[rows] / noise[rows, :, np.newaxis], -_MOST, _MOST)
        _, sizes, sums = np.linalg.svd(courses.reshape(-1, _DRAWS), full_matrices=False)
        for own in sums[sizes > _LEAST]:
            first.append(begin)
            values.append(courses @ own * noise[rows])
            told[rows] += values[-1] ** 2
    return [Responses.of(first, values)] if first else [], told
