# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The test sheet: what the tester knows of a recording and no sensor shows.

A YAML file NAME.yaml beside NAME.csv; inside a bag it travels as an attachment. Every entry is
optional, and None means 'not known'. An entry that is not allowed is refused with one line that
names the file, the key and what is allowed.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, is_dataclass, make_dataclass
from itertools import pairwise
import math
from pathlib import Path
from typing import Any, ClassVar, get_args, get_type_hints

from antenna_drive.parameters.waveforms import KNOTS_LIMIT, SINES_LIMIT
from antenna_drive.readings import not_negative, SENSORS, SheetNumber
from antenna_drive.yaml_text import dump_yaml
from simgap.errors import one_line
from simgap.inputs.labels import parse_labels, plain_value
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, ParameterError

FILE_NAME = 'test_sheet.yaml'


def _entry(unit: str, description: str, low: float = -math.inf, high: float = math.inf,
           **allowed: Any) -> Any:
    """Declare one optional entry and what may be said in it."""
    return field(default=None, metadata={
        'entry': Entry(unit, low, high, description, **allowed)})


def _numbers(unit: str, description: str, low: float = -math.inf) -> Any:
    """Declare a list of numbers, as many as the tester wants."""
    return field(default=None, metadata={
        'each': Entry(unit, low, description=description)})


def _choice(description: str, *choices: str) -> Any:
    return _entry('', description, choices=choices)


@dataclass(frozen=True)
class CircuitBias:
    """The torque-share circuit asks for the bias."""

    kind: ClassVar[str] = 'circuit'
    bias_pot: float | None = _entry('1', 'setting of the bias pot, k_p', 0.0, 1.0)
    start: str | None = _choice("the circuit's states at the start", 'steady', 'zero')


@dataclass(frozen=True)
class FixedBias:
    """A source gives the bias voltage; the torque-share circuit is not connected."""

    kind: ClassVar[str] = 'fixed'
    voltage_V: float | None = _entry('V', 'bias voltage')


@dataclass(frozen=True)
class FixedStepBias:
    """A source gives 0 V, and from one moment on the bias voltage."""

    kind: ClassVar[str] = 'fixed_step'
    voltage_V: float | None = _entry('V', 'bias voltage after the step')
    at_s: float | None = _entry('s', 'time of the step')


Bias = CircuitBias | FixedBias | FixedStepBias


@dataclass(frozen=True)
class Square:
    """A square wave, positive in its first half."""

    kind: ClassVar[str] = 'square'
    amplitude_deg_s: float | None = _entry('deg/s', 'amplitude of the rate command')
    period_s: float | None = _entry('s', 'period', 1e-3)
    phase: float | None = _entry('1', 'phase at the start, in periods')


@dataclass(frozen=True)
class Triangle:
    """A symmetric triangle that starts at zero and rises."""

    kind: ClassVar[str] = 'triangle'
    amplitude_deg_s: float | None = _entry('deg/s', 'amplitude of the rate command')
    period_s: float | None = _entry('s', 'period', 1e-3)
    phase: float | None = _entry('1', 'phase at the start, in periods')


@dataclass(frozen=True)
class Multisine:
    """A sum of sines."""

    kind: ClassVar[str] = 'multisine'
    amplitude_deg_s: float | None = _entry('deg/s', 'amplitude of the rate command')
    frequencies_hz: tuple[float, ...] | None = _numbers('Hz', 'frequency of each sine', 0.0)
    weights: tuple[float, ...] | None = _numbers('1', 'weight of each sine')
    phases: tuple[float, ...] | None = _numbers('1', 'phase of each sine')
    start_s: float | None = _entry('s', 'when it begins')


@dataclass(frozen=True)
class Chirp:
    """A sine whose frequency rises or falls."""

    kind: ClassVar[str] = 'chirp'
    amplitude_deg_s: float | None = _entry('deg/s', 'amplitude of the rate command')
    f0_hz: float | None = _entry('Hz', 'frequency at the beginning', 0.0)
    f1_hz: float | None = _entry('Hz', 'frequency at the end', 0.0)
    duration_s: float | None = _entry('s', 'length of the sweep', 0.0)
    start_s: float | None = _entry('s', 'when it begins')


@dataclass(frozen=True)
class Knots:
    """Straight lines between points, zero outside of them; two points of one time are a jump."""

    kind: ClassVar[str] = 'knots'
    times_s: tuple[float, ...] | None = _numbers('s', 'time of each point, ascending', 0.0)
    rates_deg_s: tuple[float, ...] | None = _numbers('deg/s', 'rate command at each point')


Waveform = Square | Triangle | Multisine | Chirp | Knots


def _numbers_of(numbers: Iterable[SheetNumber]) -> Any:
    """Return a class with an entry for each number."""
    return make_dataclass('_Numbers', [
        (number.key, float | None, field(default=None, metadata={'entry': number.entry}))
        for number in numbers], frozen=True)


class Sensors(_numbers_of(  # type: ignore[misc]
        number for sensor in SENSORS for number in sensor.numbers)):
    """How good the sensors are: noise is one standard deviation, step one digit."""


# What instruments of the kind have when somebody looks after them: tachometers and servo
# amplifiers of a drive, transducers and the logger of a test.
_TOLERANCES = (
    not_negative('tach_zero_rad_s', 0.01, 'rad/s', 'zero of each tachometer, in the loop'),
    not_negative('amplifier_zero_V', 1e-3, 'V', 'zero of each amplifier, in the loop'),
    not_negative('recorder_gain', 0.01, '1', 'gain of each recorded channel', 0.5),
    *(sensor.zero for sensor in SENSORS if sensor.zero),
    not_negative('channel_delay_samples', 1.0, '1',
                 'constant delay of each recorded channel, in samples', 10.0),
    # a filter of 25 Hz in front of a slow logger
    not_negative('channel_lag_s', 6.4e-3, 's', 'time constant of a filter in each channel', 1.0),
    not_negative('clock_ppm', 100.0, '1', "rate of the recorder's clock, in millionths", 1e4),
)


class Tolerances(_numbers_of(_TOLERANCES)):  # type: ignore[misc]
    """
    How far a healthy machine and its recorder may be from what is written down.

    What is not given is not fitted, but for the zeros of the readings, which are fitted within
    two standard deviations of their noise.
    """


USUAL = Tolerances(**{number.key: number.usual for number in _TOLERANCES})


@dataclass(frozen=True)
class TestSheet:
    """What the tester knows. Every entry may be None: not known."""

    __test__: ClassVar[bool] = False  # not a test case, whatever pytest makes of the name

    circuit: str | None = _choice('torque-share constants of Table 1', 'old', 'new')
    filter_1: str | None = _choice('Filter 1 constants of Table 1', 'old', 'new')
    bias: Bias | None = None  # where the bias voltage comes from
    waveform: Waveform | None = None  # the rate command
    # 'rest' if everything stood still, encoder near zero, each motor inside its gap
    start: str | None = _choice('state at the start', 'rest')
    elevation_deg: float | None = _entry('deg', 'elevation at the start', -90.0, 180.0)
    sensors: Sensors | None = None  # how good the sensors are
    # how far the machine's parameters may lie from the configuration [1]
    parameter_tolerance: float | None = _entry('1', 'relative tolerance', 0.0, 1.0)
    tolerances: Tolerances | None = None  # the same for zeros, recorders and clocks
    # names and values of what was different in this test, such as load: A
    labels: tuple[tuple[str, str], ...] | None = field(default=None, metadata={'labels': True})

    def __bool__(self) -> bool:
        """Tell whether anything is known."""
        return any(getattr(self, item.name) is not None for item in fields(self))


def parse_sheet(tree: object) -> TestSheet:
    """Check the plain data of a test sheet; ParameterError names a key that is not allowed."""
    return _parse('', tree, (TestSheet,))


def _parse(key: str, tree: object, classes: tuple[type, ...]) -> Any:
    given = dict(mapping_of(key, tree))
    chosen = classes[0]
    if hasattr(classes[0], 'kind'):
        kinds = {c.kind: c for c in classes}  # type: ignore[attr-defined]
        choice = Entry('', choices=tuple(kinds)).check(
            f'{key}.type', plain_value(given.pop('type', None)))
        chosen = kinds[str(choice)]
    known = {item.name: item for item in fields(chosen)}
    types = get_type_hints(chosen)
    content = {}
    for name, value in mapping_of(key, given, known).items():
        full = f'{key}.{name}' if key else name
        if value is None:
            continue
        metadata = known[name].metadata
        if 'labels' in metadata:
            content[name] = parse_labels(full, value)
        elif 'entry' in metadata:
            content[name] = metadata['entry'].check(full, plain_value(value))
        elif 'each' in metadata:
            if not isinstance(value, list):
                raise ParameterError(f'{full}: {one_line(repr(value))} given, allowed is '
                                     'a list of numbers')
            most = KNOTS_LIMIT if chosen is Knots else SINES_LIMIT
            if len(value) > most:
                raise ParameterError(f'{full}: {len(value)} numbers given, '
                                     f'allowed are up to {most}')
            content[name] = tuple(metadata['each'].check(f'{full}[{i}]', plain_value(item))
                                  for i, item in enumerate(value))
        else:
            parts = tuple(c for c in get_args(types[name]) if c is not type(None))
            content[name] = _parse(full, value, parts)
    lengths = {name: len(value) for name, value in content.items()
               if 'each' in known[name].metadata}
    if len(set(lengths.values())) > 1:
        raise ParameterError(f'{key}: {lengths} values given, allowed is one of each for '
                             'every sine or point')
    times = content.get('times_s', ())
    if any(later < earlier for earlier, later in pairwise(times)):
        raise ParameterError(f'{key}.times_s: a time before the one that precedes it, allowed are '
                             'times in their order')
    return chosen(**content)


def sheet_tree(sheet: Any) -> dict[str, Any]:
    """Return a test sheet as the plain data that `parse_sheet` reads; unknown entries left out."""
    tree: dict[str, Any] = {}
    if hasattr(sheet, 'kind'):
        tree['type'] = sheet.kind
    for item in fields(sheet):
        value = getattr(sheet, item.name)
        if value is None:
            continue
        if 'labels' in item.metadata:
            tree[item.name] = dict(value)
        elif is_dataclass(value):
            tree[item.name] = sheet_tree(value)
        else:
            tree[item.name] = list(value) if isinstance(value, tuple) else value
    return tree


def dump_sheet(sheet: TestSheet) -> str:
    """Return a test sheet as YAML."""
    return dump_yaml(sheet_tree(sheet), default_flow_style=None)


def load_sheet(path: Path) -> TestSheet:
    """Read a test sheet; ParameterError names file, key and what is allowed."""
    tree = read_yaml(path)
    try:
        return parse_sheet({} if tree is None else tree)
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None
