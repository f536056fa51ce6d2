# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The article's experiments for the page: what they change, what was published and obtained."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
import math
from types import SimpleNamespace
from typing import Any, NamedTuple

from antenna_drive.article.experiments import DriveExperiment, experiments
from antenna_drive.article.measures import article_measures, Measure
from antenna_drive.article.published import Claim, CLAIMS
from antenna_drive.emulator.run import Run
from antenna_drive.emulator.units import build, SourceUnit
from antenna_drive.emulator.wiring import DRIVE, TEST_SIGNAL, UNITS
from antenna_drive.live.history import History, Piece
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.parameters.waveforms import TestSignal
import numpy as np
from simgap.inputs.schema import Entry, Value

_DEGREES = 180.0 / math.pi
# This share of the intervals may be missing: the page's reader is a guest that may come late.
_MOST_MISSING = 0.01

TITLES = {
    'T1': ('Square wave, no bias', 'Figs. 8-10'),
    'T2': ('Square wave, 15 % bias', 'Figs. 11-13'),
    'T3a': ('Saw-tooth, old circuit', 'Figs. 18, 19'),
    'T3b': ('Saw-tooth, new circuit', 'Figs. 18, 20'),
    'T4a': ('Switch-on, old circuit', 'Fig. 21(a)'),
    'T4e': ('Switch-on, new circuit', 'Fig. 23'),
}

# The claims that are a level of one signal: measure, signal, a factor to its unit, and whether
# the level is reached both ways.
_LEVELS = (
    ('T1.tach_rate', 'motor_1/tach_rate', 1.0 / _DEGREES, True),
    ('T1.current_1', 'motor_1/current', 1.0, True),
    ('T3a.high', 'torque_share/bias_voltage', 1.0, False),
    ('T3a.low', 'torque_share/bias_voltage', 1.0, False),
    ('T3b.high', 'torque_share/bias_voltage', 1.0, False),
    ('T3b.low', 'torque_share/bias_voltage', 1.0, False),
)
_BY_MEASURE: Mapping[str, Claim] = {claim.measure: claim for claim in CLAIMS}


class Level(NamedTuple):
    """A published level of a signal, in its SI unit: what the analysis gave, and the field."""

    signal: str
    analysis: float
    field: float | None
    note: str


def levels(name: str) -> list[Level]:
    """Return the published levels of an experiment that can be drawn beside a signal."""
    found = []
    for measure, signal, factor, both_ways in _LEVELS:
        if measure.partition('.')[0] != name:
            continue
        claim = _BY_MEASURE[measure]
        field = claim.says.get('field') if isinstance(claim.says, Mapping) else None
        for sign in (1.0, -1.0) if both_ways else (1.0,):
            found.append(Level(signal, sign * factor * claim.number,
                               None if field is None else sign * factor * field, claim.note))
    return found


def listed() -> list[dict[str, Any]]:
    """Return the experiments as the page lists them."""
    return [{'name': name, 'title': TITLES[name][0], 'figures': TITLES[name][1],
             'duration': experiment.duration,
             'levels': [level._asdict() for level in levels(name)], 'claims': claims(name)}
            for name, experiment in experiments().items()]


# The claims' figures in words.
_WORDS = {
    'tach_rate': 'motor rate between reversals', 'current_1': 'current of motor 1',
    'current_2': 'current of motor 2', 'bias': 'torque bias, of the greatest torque',
    'tach': 'unrest of the motor rate, against T1',
    'encoder': 'unrest of the axis rate, against T1', 'high': 'greatest bias voltage',
    'high_share': 'greatest bias voltage, of 13 V', 'low': 'least bias voltage',
    'low_share': 'least bias voltage, of 13 V', 'time_at_zero': 'share of the time without bias',
    'final': 'bias in the end, of the greatest torque', 'overshoot': 'overshoot of the bias',
    'settling': 'settling time of the bias',
}


def claims(name: str) -> list[dict[str, str]]:
    """Return what the article says of an experiment, in words."""
    found = []
    for claim in claims_of(name):
        says, unit = claim.says, _units()[claim.measure]
        if isinstance(says, Mapping):
            says = f'{says["analysis"]:g} {unit} (analysis), {says["field"]:g} {unit} (field)'
        found.append({'measure': claim.measure, 'unit': unit,
                      'what': _WORDS[claim.measure.partition('.')[2]], 'note': claim.note,
                      'says': says if isinstance(says, str) else f'{says:g} {unit}'})
    return found


@cache
def _units() -> dict[str, str]:
    return {name: measure.unit for name, measure in article_measures(load()).items()}


class ExperimentChanges(NamedTuple):
    """What an experiment changes in a drive, by unit."""

    live: dict[str, dict[str, Value]]  # tuning parameters that differ
    # names of the physical constants that differ, which only a restart can change
    constants: dict[str, list[str]]


def plan(name: str, settings: Mapping[str, Mapping[str, Any]],
         configuration: tuple[str, ...] = ()) -> ExperimentChanges:
    """
    Compare an experiment with what is in force.

    name : one of `experiments`
    settings : the parameters in force, by unit and name
    configuration : files that the experiment is built on, as in `DriveExperiment.drive`
    """
    result = ExperimentChanges({}, {})
    for unit, key, entry, value in _wanted(experiments()[name].drive(*configuration)):
        now = settings.get(unit, {}).get(key)
        if now is None or _same(now, value):
            continue
        if entry.live:
            result.live.setdefault(unit, {})[key] = value
        else:
            result.constants.setdefault(unit, []).append(key)
    return result


def start_of(experiment: DriveExperiment, configuration: tuple[str, ...],
             ) -> dict[str, dict[str, Value]]:
    """Return the parameters of nodes that differ from those of configuration and circuit."""
    plain = replace(experiment, settings={}, bias_share=None).drive(*configuration)
    before = {(unit, key): value for unit, key, _, value in _wanted(plain)}
    found: dict[str, dict[str, Value]] = {}
    for unit, key, _, value in _wanted(experiment.drive(*configuration)):
        if not _same(before[unit, key], value):
            found.setdefault(unit, {})[key] = value
    return found


def _wanted(drive: Drive) -> list[tuple[str, str, Entry, Value]]:
    return [(unit, key, entry, value) for unit in UNITS
            for key, (entry, value) in build(unit, drive).settings().items()
            if key not in ('external', 'torque.external')]


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, (list, tuple)):
        return list(one) == list(other)
    return bool(one == other)


def preview(values: Mapping[str, Any], span_s: float, points: int = 600) -> dict[str, Any]:
    """
    Return a test signal as the drive would play it.

    values : of `Waveform` by name, SI; those that are not given are the defaults
    span_s : how much of it [s]
    points : how many intervals

    Returns `span` [s]; `low` and `high`, least and greatest value in each interval.

    Raises ParameterError: a value is not allowed.
    """
    unit = SourceUnit(TEST_SIGNAL, DRIVE.units[TEST_SIGNAL], TestSignal())
    unit.tune(values)
    within = 8
    unit.start(span_s / (points * within))
    parts = unit.ahead(-1, points * within)[:, 0, 0].reshape(points, within)
    return {'span': span_s, 'low': parts.min(axis=1).tolist(), 'high': parts.max(axis=1).tolist()}


def claims_of(name: str) -> list[Claim]:
    """Return what the article says of an experiment that the page can begin."""
    rows = {'T2': ('T2a', 'T2b')}.get(name, (name,))
    return [claim for claim in CLAIMS if claim.measure.partition('.')[0] in rows]


class Obtained:
    """Reads the figures of each experiment once its run is long enough, and remembers the runs."""

    def __init__(self) -> None:
        self._runs: dict[str, Run] = {}
        self._told: tuple[str, int] | None = None
        self._before = 0

    def begin(self, before: int) -> None:
        """Take note that an experiment begins with a run that is not `before`."""
        self._before, self._told = before, None

    def look(self, name: str, history: History) -> dict[str, float | None] | None:
        """
        Return the figures of an experiment by name, None if there is nothing new.

        A figure is None if too many steps were missed, or if the run of the other experiment has
        not been seen with which it compares.
        """
        run = history.run
        if run in (0, self._before) or self._told == (name, run):
            return None
        experiment = experiments()[name]
        piece = history.since(run, 0)
        if piece.run != run or piece.time_s < experiment.duration:
            return None
        self._told = (name, run)
        self._runs.pop(name, None)
        seen = run_of(piece, experiment)
        if seen is not None:
            self._runs[name] = seen
        measures = article_measures(load())
        return {claim.measure: self._value(measures[claim.measure]) for claim in claims_of(name)}

    def _value(self, measure: Measure) -> float | None:
        # the runs that were seen, in place of simulated ones
        seen: Any = SimpleNamespace(drives={}, run=self._runs.__getitem__)
        try:
            value = measure.value(seen)
        except KeyError:
            return None
        return value if math.isfinite(value) else None


def run_of(piece: Piece, experiment: DriveExperiment) -> Run | None:
    """Return the run of an experiment, a sample each interval; None if too much is missing."""
    per = round(piece.interval_s / piece.step_s)
    wanted = round(experiment.duration / piece.interval_s)
    ends = piece.ends[:wanted]
    there = np.isfinite(ends).all(axis=1)
    if piece.first or there.sum() < (1.0 - _MOST_MISSING) * wanted:
        return None
    steps = (np.flatnonzero(there) + 1) * per - 1
    return Run(piece.step_s, steps, DRIVE.signals, np.stack(
        [ends[there], np.zeros_like(ends[there])], axis=2))
