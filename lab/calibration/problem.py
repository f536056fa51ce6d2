# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The definition of a fit: free parameters with bounds, targets with weights.

A target file has these sections:

  free:         section.entry of a configuration file, or section.list[0], with low, high and
                scale (linear or log)
  targets:      name of a figure, with value, at_least or at_most, and tolerance and weight
  figures:      additional figures; those of the article are known by name
  experiments:  additional experiments
  search:       population and spread of the first generation
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import re
from typing import Any

from antenna_drive.article import readings
from antenna_drive.article.experiments import DriveExperiment
from antenna_drive.article.measures import (
    article_experiments, article_measures, Measure, OLD_CIRCUIT, Readout, Results,
)
from antenna_drive.parameters import Drive, load, ParameterError
from antenna_drive.parameters.loading import find, MOTOR_SECTIONS, PLACES, SECTIONS
from antenna_drive.parameters.sets import changed, entries, values
from simgap.errors import one_line
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, nearest, quoted

# Target files that `lab calibrate` knows by name.
SHIPPED = Path(__file__).parent
# The circuit of an experiment that uses the configuration's own.
NO_CIRCUIT = 'none'
KINDS = ('value', 'at_least', 'at_most')
# The miss of a figure that cannot be evaluated, in tolerances.
_UNREADABLE = 100.0
_LIST_ITEM = re.compile(r'(?P<key>.+)\[(?P<index>\d+)\]')


@dataclass(frozen=True)
class Free:
    """One free parameter."""

    name: str  # as in a configuration file, 'gearbox.stiffness', 'axis.mode_inertias[0]'
    # bounds, in the parameter's unit
    low: float
    high: float
    log: bool  # True to search on a logarithmic scale
    unit: str  # of the parameter

    def at(self, share: float) -> float:
        """Return the value at a share of the range, 0 at low and 1 at high."""
        share = min(max(share, 0.0), 1.0)
        if self.log:
            return float(self.low * (self.high / self.low) ** share)
        return self.low + share * (self.high - self.low)

    def share(self, value: float) -> float:
        """Return the share of the range at a value; values outside give 0 or 1."""
        if self.log:
            share = math.log(max(value, self.low) / self.low) / math.log(self.high / self.low)
        else:
            share = (value - self.low) / (self.high - self.low)
        return min(max(share, 0.0), 1.0)

    @property
    def key(self) -> str:
        """Return 'section.entry' without the index of a list."""
        item = _LIST_ITEM.fullmatch(self.name)
        return item['key'] if item else self.name

    @property
    def index(self) -> int | None:
        """Return the index in a list, None for a single number."""
        item = _LIST_ITEM.fullmatch(self.name)
        return int(item['index']) if item else None


@dataclass(frozen=True)
class Target:
    """The aim for one figure."""

    figure: str  # its name
    kind: str  # value, at_least or at_most
    number: float  # the aim, in the figure's unit
    tolerance: float  # the miss that costs as much as any other target's tolerance
    weight: float = 1.0  # factor on the cost

    def residual(self, obtained: float) -> float:
        """Return the miss in tolerances, zero if a bound is kept."""
        if not math.isfinite(obtained):
            return _UNREADABLE
        miss = (obtained - self.number) / self.tolerance
        if self.kind == 'at_least':
            miss = min(miss, 0.0)
        elif self.kind == 'at_most':
            miss = max(miss, 0.0)
        return max(-_UNREADABLE, min(miss, _UNREADABLE))

    def cost(self, obtained: float) -> float:
        """Return the cost of the miss: quadratic for a small one, linear for a large one."""
        return self.weight * 2.0 * (math.hypot(1.0, self.residual(obtained)) - 1.0)


@dataclass(frozen=True)
class Evaluation:
    """The cost of a candidate and the figures that were evaluated for it."""

    cost: float
    figures: Mapping[str, float]
    complete: bool


class CalibrationProblem:
    """
    A fit: free parameters, targets, and the configuration for everything else.

    free : the free parameters, tuple of Free
    targets : tuple of Target
    population : candidates in a generation
    spread : standard deviation of the first generation, as a share of the bounds
    """

    def __init__(self, free: Sequence[Free], targets: Sequence[Target], *,
                 start: Sequence[str] = (),
                 experiments: Mapping[str, DriveExperiment] | None = None,
                 figures: Mapping[str, Measure] | None = None, population: int = 16,
                 spread: float = 0.1) -> None:
        """Load the configuration with every circuit that an experiment needs."""
        self.free = tuple(free)
        self.targets = tuple(targets)
        self.population = population
        self.spread = spread
        self._experiments = {**article_experiments(), **(experiments or {})}
        self._base = load(*start)
        circuits = {experiment.circuit for experiment in self._experiments.values()}
        self._circuits = {
            name: load(*start, *(() if name == NO_CIRCUIT else (name,))) for name in circuits}
        self._figures = {**article_measures(self._circuits[OLD_CIRCUIT]), **(figures or {})}
        for target in self.targets:
            if target.figure not in self._figures:
                raise ParameterError(f'targets.{target.figure}: no such figure'
                                     f'{nearest(target.figure, tuple(self._figures))}')
        # parameters that a circuit's file sets are not changed by a candidate
        self._fixed = {
            name: {key for (key, _, own), (_, _, base) in zip(values(drive), values(self._base))
                   if own != base}
            for name, drive in self._circuits.items()}

    def figure(self, name: str) -> Measure:
        """Return a figure by name; KeyError if there is none."""
        return self._figures[name]

    def start(self) -> list[float]:
        """Return the configuration's values as shares of the bounds."""
        own = {name: value for name, _, value in values(self._base)}
        shares = []
        for item in self.free:
            value: Any = own[drive_names(item.key)[0]]
            shares.append(item.share(value if item.index is None else value[item.index]))
        return shares

    def parameters(self, shares: Sequence[float]) -> dict[str, Any]:
        """Return the candidate's values by 'section.entry', with complete lists."""
        own = {name: value for name, _, value in values(self._base)}
        found: dict[str, Any] = {}
        for item, share in zip(self.free, shares):
            if item.index is None:
                found[item.key] = item.at(share)
            else:
                numbers = list(found.get(item.key, own[drive_names(item.key)[0]]))
                numbers[item.index] = item.at(share)
                found[item.key] = tuple(numbers)
        return found

    def results(self, shares: Sequence[float]) -> Results:
        """Return the candidate's results; nothing is run yet."""
        changes = {name: value for key, value in self.parameters(shares).items()
                   for name in drive_names(key)}
        drives: dict[str, Drive] = {}
        for circuit, drive in self._circuits.items():
            fixed = self._fixed[circuit]
            drives[circuit] = changed(drive, {name: value for name, value in changes.items()
                                              if name not in fixed})
        return Results(drives, self._experiments)

    def evaluate(self, shares: Sequence[float], give_up_at: float = math.inf) -> Evaluation:
        """
        Simulate a candidate and return its cost and figures.

        shares : of the bounds, one for each free parameter
        give_up_at : stop once the cost exceeds this; targets are evaluated in their order
        """
        results = self.results(shares)
        cost = 0.0
        figures: dict[str, float] = {}
        for target in self.targets:
            if cost > give_up_at:
                return Evaluation(cost, figures, False)
            figures[target.figure] = read(self._figures[target.figure], results)
            cost += target.cost(figures[target.figure])
        return Evaluation(cost, figures, True)


def read(figure: Measure, results: Results) -> float:
    """Return a figure, or NaN if it cannot be evaluated."""
    try:
        return figure.value(results)
    except (ArithmeticError, ValueError, IndexError):
        return math.nan


def drive_names(key: str) -> list[str]:
    """Return the dotted names in `Drive` that 'section.entry' of a file stands for."""
    section, _, entry = key.partition('.')
    if section in MOTOR_SECTIONS:
        return [f'{motor}.{key}' for motor in ('motor_1', 'motor_2')]
    return [f'{PLACES[section]}.{entry}']


def read_problem(source: str | Path, start: Sequence[str] = ()) -> CalibrationProblem:
    """
    Read a target file; the module's docstring describes its form.

    source : path, or name of a file in config/
    start : configuration files that give the start of the fit and all fixed parameters

    Raises ParameterError: the file cannot be read or has an entry that is not allowed; one line
    names file and entry.
    """
    path = find(source)
    content = read_yaml(path)
    try:
        content = mapping_of(
            '', content, ('free', 'targets', 'figures', 'experiments', 'search'))
        experiments = {str(name): _experiment(str(name), body)
                       for name, body in (content.get('experiments') or {}).items()}
        known = {*article_experiments(), *experiments}
        figures = {str(name): _figure(str(name), body, known)
                   for name, body in (content.get('figures') or {}).items()}
        search = mapping_of('search', content.get('search') or {}, ('population', 'spread'))
        return CalibrationProblem(
            [_free(str(name), body) for name, body in _filled(content, 'free')],
            [_target(str(name), body) for name, body in _filled(content, 'targets')],
            start=start, experiments=experiments, figures=figures,
            population=int(_number('search.population', search.get('population', 16), 4, 1e4)),
            spread=_number('search.spread', search.get('spread', 0.1), 1e-6, 1.0))
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None


def _filled(content: Mapping[str, Any], section: str) -> list[tuple[Any, Any]]:
    body = content.get(section)
    if not isinstance(body, dict) or not body:
        raise ParameterError(f'{section}: {quoted(body)} given, allowed is a mapping of entries')
    return list(body.items())


def _number(key: str, value: Any, low: float = -math.inf, high: float = math.inf) -> float:
    return float(Entry('', low, high).check(key, value))  # type: ignore[arg-type]


def _free(name: str, body: Any) -> Free:
    key = f'free.{one_line(name)}'
    table = mapping_of(key, body, ('low', 'high', 'scale'))
    item = _LIST_ITEM.fullmatch(name)
    section, _, entry_name = (item['key'] if item else name).partition('.')
    if section not in SECTIONS:
        raise ParameterError(f'{key}: no such section{nearest(section, tuple(SECTIONS))}')
    known = dict(entries(SECTIONS[section]))
    if entry_name not in known:
        raise ParameterError(f'{key}: no such entry{nearest(entry_name, tuple(known))}')
    entry = known[entry_name]
    if entry.choices is not None or (entry.lengths is None) != (item is None):
        raise ParameterError(f'{key}: allowed is a number, or one of a list as name[0]')
    low, high = (_number(f'{key}.{end}', table.get(end), entry.low, entry.high)
                 for end in ('low', 'high'))
    scale = table.get('scale', 'linear')
    if scale not in ('linear', 'log') or not low < high or (scale == 'log' and low <= 0.0):
        raise ParameterError(f'{key}: low {low:g}, high {high:g}, scale {quoted(scale)} given, '
                             'allowed is low below high, scale linear or, above zero, log')
    return Free(name, low, high, scale == 'log', entry.unit)


def _target(name: str, body: Any) -> Target:
    key = f'targets.{one_line(name)}'
    table = mapping_of(key, body, (*KINDS, 'tolerance', 'weight'))
    kinds = [kind for kind in KINDS if kind in table]
    if len(kinds) != 1:
        raise ParameterError(f'{key}: allowed is one of {", ".join(KINDS)}')
    return Target(name, kinds[0], _number(f'{key}.{kinds[0]}', table[kinds[0]]),
                  _number(f'{key}.tolerance', table.get('tolerance'), 1e-12),
                  _number(f'{key}.weight', table.get('weight', 1.0), 0.0))


def _experiment(name: str, body: Any) -> DriveExperiment:
    key = f'experiments.{name}'
    table = mapping_of(key, body, ('duration', 'circuit', 'settings', 'bias_share'))
    settings = {str(path): value for path, value in (table.get('settings') or {}).items()}
    known = {path: entry for path, entry, _ in values(load())}
    for path, value in settings.items():
        if path not in known:
            raise ParameterError(f'{key}.settings.{path}: no such parameter'
                                 f'{nearest(path, tuple(known))}')
        settings[path] = known[path].check(f'{key}.settings.{path}', value)
    share = table.get('bias_share')
    return DriveExperiment(
        name, _number(f'{key}.duration', table.get('duration'), 1e-3, 1e5),
        str(table.get('circuit', NO_CIRCUIT)), settings,
        None if share is None else _number(f'{key}.bias_share', share, -1.0, 1.0))


def _figure(name: str, body: Any, experiments: set[str]) -> Readout:
    key = f'figures.{name}'
    table = mapping_of(key, body, ('experiment', 'kind', 'signal', 'arguments', 'compared_with',
                                   'scale', 'unit'))
    for part in ('experiment', 'compared_with'):
        if table.get(part, None if part == 'compared_with' else '') not in (*experiments, None):
            raise ParameterError(f'{key}.{part}: {quoted(table.get(part))} given, allowed are '
                                 f'{", ".join(sorted(experiments))}')
    if table.get('kind') not in readings.KINDS:
        raise ParameterError(f'{key}.kind: {quoted(table.get("kind"))} given, allowed are '
                             f'{", ".join(readings.KINDS)}')
    signal = table.get('signal')
    if not isinstance(signal, dict) or not signal:
        raise ParameterError(f'{key}.signal: {quoted(signal)} given, allowed is a mapping of '
                             'signals to weights')
    return Readout(name, str(table.get('unit', '1')), str(table['experiment']),
                   str(table['kind']),
                   {str(part): _number(f'{key}.signal.{part}', weight)
                    for part, weight in signal.items()},
                   dict(table.get('arguments') or {}), table.get('compared_with'),
                   _number(f'{key}.scale', table.get('scale', 1.0)))
