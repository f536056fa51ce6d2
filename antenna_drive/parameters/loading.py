# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
From config/*.yaml to a checked parameter set: all of it, or one line that says what is wrong.

A file holds sections (axis, motor, gearbox ...) of entries. An entry is a value, or a mapping of
value, unit, range, source and note. Files lie over one another, the first over the reference
set; a file with `base: none` at its top stands alone. What holds for one motor only goes into
a section motor_1 or motor_2: `motor_1: {gearbox: {half_gap: 0.2}}`.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, MISSING, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, get_type_hints

from antenna_drive.parameters import files
from antenna_drive.parameters.sets import (
    Axis, Drive, Encoder, entries, Filter1, MotorDrive, TorqueShare,
)
from antenna_drive.parameters.waveforms import TestSignal, Waveform
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, nearest, ParameterError, quoted, Value

MOTOR_SECTIONS: dict[str, type] = {
    name: kind for name, kind in get_type_hints(MotorDrive).items()
    if isinstance(kind, type) and is_dataclass(kind)}
SECTIONS: dict[str, type] = {'axis': Axis, 'encoder': Encoder, 'torque_share': TorqueShare,
                             'filter_1': Filter1, **MOTOR_SECTIONS}
# Where the sets of the drive are that have a section of their own.
PLACES = {'axis': 'plant.axis', 'encoder': 'plant.encoder',
          'torque_share': 'torque_share.circuit', 'filter_1': 'torque_share.filter_1'}
MOTOR_SIGNS = {'motor_1': -1.0, 'motor_2': 1.0}
START_IN_GAP = 'start_in_gap'
TEST_SIGNAL_PARTS = ('rate', 'torque')
_ENTRY_KEYS = ('value', 'unit', 'range', 'source', 'note')

# What a file says of one parameter, by dotted name, and which file says it.
_Given = dict[str, tuple[Value, str]]
# What a section may say: of an entry or of a section within it.
_Known = dict[str, Any]


def load(*sources: str | Path, kind: Any = Drive) -> Drive:
    """
    Load configuration files, each over the one before, and check everything.

    sources : paths, or names of the sets in config/ ('new_circuit'); none is the reference set
    kind : Drive, or a subclass with further parameter sets; a file gives each in a section of its
        field's name

    Raises ParameterError: a file cannot be read, or an entry is wrong, missing, misspelt or out of
    range; one line names file, key and what is allowed.
    """
    given: _Given = {}
    alone = False
    own = {item.name for item in fields(Drive)}
    more = {name: hint for name, hint in get_type_hints(kind).items() if name not in own}
    for source in sources:
        base, content = _read(find(source), {**SECTIONS, **more})
        alone = alone or base == 'none'
        given.update(content)
    if not alone:
        given = {**_read(find('reference'), SECTIONS)[1], **given}
    return _drive(given, str(sources[-1]) if sources else 'reference', kind)


def find(source: str | Path) -> Path:
    """
    Return the path of a file, or of a set in config/ by its name.

    Raises ParameterError: there is no such file or set.
    """
    path = Path(source)
    if path.is_file():
        return path
    named = files.config_dir() / f'{source}.yaml'
    if path.parent == Path() and named.is_file():
        return named
    known = tuple(sorted(item.stem for item in files.config_dir().glob('*.yaml')))
    raise ParameterError(f'{source}: no such file, and no such set in config/ '
                         f'({", ".join(known)}){nearest(str(source), known)}')


def _read(path: Path, sections: Mapping[str, type]) -> tuple[str, _Given]:
    """Return the base that a file names, and what it says of parameters."""
    known: _Known = {name: dict(entries(kind)) for name, kind in sections.items()}
    motor = {name: dict(entries(kind)) for name, kind in MOTOR_SECTIONS.items()}
    start = dict(entries(MotorDrive))[START_IN_GAP]
    known.update(dict.fromkeys(MOTOR_SIGNS, {**motor, START_IN_GAP: start}))
    known['test_signal'] = {**dict.fromkeys(TEST_SIGNAL_PARTS, dict(entries(Waveform))),
                            **dict(entries(TestSignal))}
    given: _Given = {}
    content = read_yaml(path)
    try:
        content = dict(mapping_of('', {} if content is None else content))
        base = content.pop('base', 'reference')
        if base not in ('reference', 'none'):
            raise ParameterError(f'base: {quoted(base)} given, allowed is reference or none')
        _take('', content, known, str(path), given)
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None
    return base, given


def _take(prefix: str, body: Any, known: _Known, source: str, given: _Given) -> None:
    """Put what a section says of parameters, and its own sections, into `given`."""
    for key, item in mapping_of(prefix.rstrip('.'), body, known).items():
        part = known[key]
        if isinstance(part, Entry):
            given[f'{prefix}{key}'] = (_value(f'{prefix}{key}', part, item), source)
        else:
            _take(f'{prefix}{key}.', item, part, source, given)


def _value(key: str, entry: Entry, item: Any) -> Value:
    if not isinstance(item, dict):
        return entry.check(key, item)
    mapping_of(key, item, _ENTRY_KEYS)
    if 'value' not in item:
        raise ParameterError(f'{key}: value is missing, allowed is {entry.allowed()}')
    # a file may still say A where article amperes are meant
    if 'unit' in item and item['unit'] not in (entry.unit, entry.unit.replace('article A', 'A')):
        raise ParameterError(f'{key}: unit {quoted(item["unit"])} given, allowed is '
                             f'{entry.unit!r}')
    return _narrowed(key, entry, item).check(key, item['value'])


def _narrowed(key: str, entry: Entry, item: Mapping[str, Any]) -> Entry:
    """Return the entry with the range that the file itself gives, which may only be narrower."""
    if 'range' not in item:
        return entry
    bounds = item['range']
    numbers = (isinstance(bounds, list) and len(bounds) == 2
               and all(isinstance(b, (int, float)) and not isinstance(b, bool) for b in bounds))
    if not numbers or not entry.low <= bounds[0] <= bounds[1] <= entry.high:
        raise ParameterError(f'{key}: range {quoted(bounds)} given, allowed is [low, high] within '
                             f'[{entry.low:g}, {entry.high:g}]')
    return replace(entry, low=float(bounds[0]), high=float(bounds[1]))


def _drive(given: _Given, source: str, kind: Any) -> Drive:
    axis: Axis = _set(Axis, PLACES['axis'], given, source)
    _check_modes(axis, given)
    for motor, sign in MOTOR_SIGNS.items():
        given[f'{motor}.sign'] = sign, source
        given[f'{motor}.gear_ratio'] = axis.gear_ratio, source
    drive: Drive = _set(kind, '', given, source)
    share = drive.torque_share.circuit
    if share.saturation_low > share.saturation_high:
        raise ParameterError(f'{given["torque_share.saturation_low"][1]}: '
                             f'torque_share.saturation_low: {share.saturation_low:g} given, '
                             f'allowed is at most saturation_high ({share.saturation_high:g} V)')
    for part in TEST_SIGNAL_PARTS:
        check_waveform(getattr(drive.test_signal, part), f'{source}: test_signal.{part}')
    return drive


def _set(kind: type, place: str, given: _Given, source: str) -> Any:
    """
    Build a set and those within it.

    A section of a file goes by the place of its set in the drive, such as motor_1.gearbox, or by
    the name that all sets of this kind share, such as gearbox.
    """
    shared = next((section for section, own in PLACES.items() if own == place),
                  place.rpartition('.')[2])
    hints = get_type_hints(kind)
    found: dict[str, Any] = {}
    for item in fields(kind):
        if is_dataclass(hints[item.name]):
            within = f'{place}.{item.name}' if place else item.name
            found[item.name] = _set(hints[item.name], within, given, source)
            continue
        names = [name for name in (f'{place}.{item.name}', f'{shared}.{item.name}')
                 if name in given]
        if names:
            found[item.name] = given[names[0]][0]
        elif item.default is MISSING:
            entry: Entry = item.metadata['entry']
            raise ParameterError(f'{source}: {shared}.{item.name}: is missing, '
                                 f'allowed is {entry.allowed()}')
    return kind(**found)


def _check_modes(axis: Axis, given: _Given) -> None:
    count = len(axis.mode_inertias)
    for name in ('mode_frequencies', 'mode_damping_ratios', 'pointing_elevation',
                 'pointing_cross_elevation'):
        if len(getattr(axis, name)) != count:
            said_in = (given['axis.mode_inertias'][1], given[f'axis.{name}'][1])
            # the reference fits itself, so the other of the two files is the one to mend
            path = next((item for item in said_in if item != str(find('reference'))), said_in[1])
            raise ParameterError(
                f'{path}: axis.{name}: {len(getattr(axis, name))} numbers given, '
                f'allowed is {count}, one for each of axis.mode_inertias')


def check_waveform(waveform: Waveform, key: str) -> None:
    """
    Check what no single entry shows: lists that belong together, and the order of times.

    Raises ParameterError: lists differ in length, or times go back; the message begins with `key`.
    """
    for first, name in (('frequencies', 'weights'), ('frequencies', 'phases'),
                        ('knot_times', 'knot_values')):
        count, given = len(getattr(waveform, first)), len(getattr(waveform, name))
        if given != count:
            raise ParameterError(f'{key}.{name}: {given} numbers given, allowed is {count}, '
                                 f'one for each of {first}')
    if any(later < earlier for earlier, later in pairwise(waveform.knot_times)):
        raise ParameterError(f'{key}.knot_times: a time before the one that precedes it, allowed '
                             'are times in their order')
