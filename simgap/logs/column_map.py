# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A map from somebody else's file to signals, see docs/recording.md: columns, units, clocks."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
import math
from operator import itemgetter
from pathlib import Path
from typing import Any

from simgap.errors import one_line
from simgap.inputs.labels import plain_value
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, nearest, ParameterError, quoted
from simgap.logs.channel import check_name, NANOSECONDS, nanoseconds, RecordingError
from simgap.logs.expression import Expression, MOST_COLUMNS, parse_expression, Reference
from simgap.logs.table import AUTO, Layout

# A unit in which a column may be written: the SI unit and how much of it one is.
UNITS: dict[str, tuple[str, float]] = {
    'rad': ('rad', 1.0), 'mrad': ('rad', 1e-3), 'urad': ('rad', 1e-6),
    'deg': ('rad', math.pi / 180), 'arcmin': ('rad', math.pi / 10800),
    'arcsec': ('rad', math.pi / 648000), 'mdeg': ('rad', math.pi / 180000),
    'rad/s': ('rad/s', 1.0), 'mrad/s': ('rad/s', 1e-3), 'deg/s': ('rad/s', math.pi / 180),
    'mdeg/s': ('rad/s', math.pi / 180000), 'arcsec/s': ('rad/s', math.pi / 648000),
    'rpm': ('rad/s', math.pi / 30), 'rev/s': ('rad/s', 2 * math.pi),
    'A': ('A', 1.0), 'mA': ('A', 1e-3), 'V': ('V', 1.0), 'mV': ('V', 1e-3),
    'N m': ('N m', 1.0), 'kN m': ('N m', 1e3), 'N': ('N', 1.0), 'kN': ('N', 1e3),
    'm': ('m', 1.0), 'mm': ('m', 1e-3), 'um': ('m', 1e-6),
    'm/s': ('m/s', 1.0), 'mm/s': ('m/s', 1e-3), '1': ('1', 1.0)}
COUNTS = 'counts'
TIME_UNITS = {'s': NANOSECONDS, 'ms': 1_000_000, 'us': 1_000, 'ns': 1}
ISO_8601 = 'iso8601'
_TEXT_ENTRIES = ('delimiter', 'decimal', 'comment', 'encoding', 'records')
_FLAGS = {'header': True, 'units_row': False, 'transposed': False}
_TOP = (*_TEXT_ENTRIES, *_FLAGS, 'skip_lines', 'missing', 'where', 'time', 'signals', 'also')
_TIME = ('column', 'index', 'unit', 'offset_s', 'origin', 'duplicates', 'onto')
_PLACE = Entry('1', 0, MOST_COLUMNS, whole=True)
_OFFSET_S = Entry('s', -9e9, 9e9)
_NUMBERS = {'scale': Entry('1', -1e12, 1e12), 'offset': Entry(''), 'clock_offset_s': _OFFSET_S,
            'counts_per_revolution': Entry('1', 1.0, 2.0**64), 'unwrap': Entry('', 0.0),
            'index': _PLACE, 'sign_magnitude_bits': Entry('1', 2, 53, whole=True)}
_SIGNAL = ('column', 'expression', 'unit', 'sign', 'time_column', 'join', *_NUMBERS)


@dataclass(frozen=True)
class TimeMap:
    column: str | int = AUTO  # its name, or its place, counted from 0
    index: int | None = None  # of the time in a column of vectors
    unit: str = 's'  # one of TIME_UNITS, or iso8601 (without a zone it is taken for UTC)
    offset_ns: int = 0  # added to every time stamp [ns]
    from_first: bool = False  # count from the first time stamp of the file
    duplicates: str = 'refuse'  # or first or last: which of the rows with one stamp counts
    onto: str = ''  # the signal onto whose stamps others come; '' for one with the most samples


@dataclass(frozen=True)
class SignalMap:
    """How one signal is written: SI value = factor * (gain * number + offset)."""

    number: Expression  # of the columns
    unit: str  # SI unit of the signal
    factor: float = 1.0  # SI units in the unit of the column
    gain: float = 1.0  # sign * scale
    offset: float = 0.0  # in the unit of the column
    time_column: str | int | None = None  # of its own stamps; None for the common one
    clock_offset_ns: int = 0  # added to this signal's time stamps [ns]
    sign_bit: int = 0  # value of the bit that is the sign of a sign-magnitude register; 0 for none
    unwrap: float = 0.0  # what the number jumps by where it wraps around; 0 if it does not
    # onto the stamps of another clock: a sample goes to the next stamp, as what is held does, or
    # along a straight line to the nearest one
    join: str = 'next'


@dataclass(frozen=True)
class ImportMap:
    time: TimeMap
    signals: Mapping[str, SignalMap]
    layout: Layout = Layout()
    source: Mapping[str, Any] = field(default_factory=dict)
    where: Mapping[str, Any] = field(default_factory=dict)  # values that the rows must have
    # maps of further files of the same test, by their names; {test} is what comes before the last
    # underscore in the name of the first
    also: Mapping[str, ImportMap] = field(default_factory=dict)


@dataclass(frozen=True)
class KnownSignals:
    """Signals that the program `owner` knows before a map: SI units by name, and aliases."""

    owner: str = ''
    units: Mapping[str, str] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)


def load_map(path: str | Path, known: KnownSignals = KnownSignals()) -> ImportMap:
    """Read a map; ParameterError names file, key and what is allowed; known units may lack."""
    path = Path(path)
    tree = read_yaml(path)
    try:
        return parse_map(tree, known)
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None


def parse_map(tree: object, known: KnownSignals = KnownSignals()) -> ImportMap:
    """Check the plain data of a map, as `load_map`; ParameterError names a wrong key."""
    top = mapping_of('the map', tree, _TOP)
    texts = {key: _text(key, top[key]) for key in _TEXT_ENTRIES if key in top}
    for key, allowed in (('delimiter', ',;\t| '), ('decimal', '.,')):
        if key in texts and (len(texts[key]) != 1 or texts[key] not in allowed):
            raise ParameterError(f'{key}: {quoted(texts[key])} given, allowed is one of '
                                 + ' '.join(repr(c) for c in allowed))
    if texts.get('decimal', '.') == texts.get('delimiter', ','):
        raise ParameterError("decimal: the same as the delimiter; give delimiter: ';'")
    try:
        ''.encode(texts.get('encoding', 'utf-8'))
    except (LookupError, ValueError, UnicodeError):
        raise ParameterError(f'encoding: {quoted(texts["encoding"])} given, allowed is one that '
                             'Python knows, such as utf-8 or latin-1') from None
    skip = _checked(Entry('1', 0, 10000, whole=True), 'skip_lines', top.get('skip_lines', 0))
    rows = {key: top.get(key, usual) for key, usual in _FLAGS.items()}
    for key, value in rows.items():
        if not isinstance(value, bool):
            raise ParameterError(f'{key}: {quoted(plain_value(value))} given, allowed is true or '
                                 'false')
    missing = top.get('missing', [])
    if not isinstance(missing, list) or not all(isinstance(text, str) for text in missing):
        raise ParameterError(f'missing: {quoted(plain_value(missing))} given, allowed is a list '
                             'of texts in quotes')
    signals = {}
    for name, body in mapping_of('signals', top.get('signals')).items():
        signal = known.aliases.get(str(name), str(name))
        if signal in signals:
            raise ParameterError(f'signals.{one_line(name)}: {signal} is given twice')
        signals[signal] = _signal(f'signals.{one_line(name)}', signal, body, known)
    if not signals:
        raise ParameterError('signals: none is given')
    return ImportMap(_time(top.get('time', {'column': AUTO})), signals,
                     Layout(**texts, **rows,  # type: ignore[arg-type]
                            skip_lines=skip, missing=tuple(missing)), top,
                     mapping_of('where', top.get('where', {})),
                     _also(top.get('also', {}), known, signals))


def _also(body: object, known: KnownSignals, taken: Collection[str]) -> dict[str, ImportMap]:
    found: dict[str, ImportMap] = {}
    for name, entries in mapping_of('also', body).items():
        try:
            found[name] = parse_map(entries, known)
        except ParameterError as error:
            raise ParameterError(f'also.{one_line(name)}: {error}') from None
        for signal in set(taken) & found[name].signals.keys():
            raise ParameterError(f'also.{one_line(name)}: signals.{signal} is given twice')
    return found


def _checked(entry: Entry, key: str, value: object) -> Any:
    return entry.check(key, plain_value(value))


def _text(key: str, value: object, choices: tuple[str, ...] | None = None) -> str:
    if choices is not None:
        return str(_checked(Entry('', choices=choices), key, value))
    if not isinstance(value, str) or not value:
        raise ParameterError(f'{key}: {quoted(plain_value(value))} given, allowed is a text')
    return value


def _column(key: str, value: object) -> str | int:
    if isinstance(value, int) and not isinstance(value, bool):
        return int(_checked(_PLACE, key, value))
    if not isinstance(value, str) or not value:
        raise ParameterError(f'{key}: {quoted(plain_value(value))} given, allowed is a text, or '
                             'the number of a column, counted from 0')
    return value


def _time(body: object) -> TimeMap:
    entries = mapping_of('time', body, _TIME)
    return TimeMap(
        _column('time.column', entries.get('column')),
        _checked(_PLACE, 'time.index', entries['index']) if 'index' in entries else None,
        _text('time.unit', entries.get('unit', 's'), (*TIME_UNITS, ISO_8601)),
        nanoseconds(_checked(_OFFSET_S, 'time.offset_s', entries.get('offset_s', 0))),
        _text('time.origin', entries.get('origin', 'keep'), ('keep', 'first')) == 'first',
        _text('time.duplicates', entries.get('duplicates', 'refuse'), ('refuse', 'first', 'last')),
        _text('time.onto', entries['onto']) if 'onto' in entries else '')


def _signal(key: str, name: str, body: object, known: KnownSignals) -> SignalMap:
    unit = known.units.get(name, '')
    if not unit:
        if name.partition('/')[0] in {other.partition('/')[0] for other in known.units}:
            raise ParameterError(f'{key}: {known.owner} has no such signal'
                                 f'{nearest(name, known.units)}')
        try:
            check_name(name)
        except RecordingError as error:
            raise ParameterError(f'signals: {error}') from None
    entries = mapping_of(key, body, _SIGNAL)
    numbers = {name: _checked(entry, f'{key}.{name}', entries[name])
               for name, entry in _NUMBERS.items() if name in entries}
    sign = entries.get('sign', 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise ParameterError(f'{key}.sign: {quoted(plain_value(sign))} given, allowed is 1 or -1')
    written = _text(f'{key}.unit', entries.get('unit', unit or None), (*UNITS, COUNTS))
    if written != COUNTS:
        if 'counts_per_revolution' in numbers:
            raise ParameterError(f'{key}.counts_per_revolution: goes with the unit counts only')
        si, factor = UNITS[written]
    elif 'counts_per_revolution' in numbers:
        si, factor = 'rad', 2 * math.pi / numbers['counts_per_revolution']
    elif 'scale' in numbers:  # counts of a converter: the scale says what one is
        si, factor = unit or '1', 1.0
    else:
        raise ParameterError(f'{key}: counts need counts_per_revolution (an angle) or scale '
                             '(anything else, in SI units for each count)')
    if unit and si != unit:
        same = [text for text, (target, _) in UNITS.items() if target == unit]
        raise ParameterError(f'{key}.unit: {quoted(written)} given, but {name} is in {unit}; '
                             f'allowed is one of {", ".join((*same, COUNTS))}')
    own_time = entries.get('time_column')
    return SignalMap(
        _expression(key, entries, numbers.get('index')), si, factor,
        float(sign) * numbers.get('scale', 1.0), numbers.get('offset', 0.0),
        None if own_time is None else _column(f'{key}.time_column', own_time),
        nanoseconds(numbers.get('clock_offset_s', 0.0)),
        (1 << numbers.get('sign_magnitude_bits', 0)) >> 1,
        numbers.get('unwrap', 0.0),
        _text(f'{key}.join', entries.get('join', 'next'), ('next', 'linear')))


def _expression(key: str, entries: Mapping[str, Any], index: int | None) -> Expression:
    if 'expression' not in entries:
        column = Reference(_column(f'{key}.column', entries.get('column')), index)
        return Expression((column,), itemgetter(0))
    for entry in ('column', 'index', 'sign_magnitude_bits'):
        if entry in entries:
            raise ParameterError(f'{key}.{entry}: does not go with expression')
    if 'unit' not in entries:
        raise ParameterError(f'{key}.unit: an expression needs the unit of its result')
    found = parse_expression(f'{key}.expression',
                             _text(f'{key}.expression', entries['expression']))
    if not found.references:
        raise ParameterError(f'{key}.expression: names no column')
    return found
