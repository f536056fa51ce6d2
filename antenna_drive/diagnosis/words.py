# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue in plain words: what is said of each effect's number, and what to do next.

A row is a kind of effect, or one form of it. {part} is the part of the drive, {by} a share such as
'40 percent'. What a number is compared with is looked up in the drive's record.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
import math
from typing import Any

from antenna_drive.diagnosis.modifiers import AntennaParameter, SCALE, SET
from antenna_drive.parameters.records import place_of
from antenna_drive.parameters.sets import Drive, values
import numpy as np
from simgap.machine.contract import Effect
from simgap.machine.machine import Words
from simgap.verdict.spoken import number, quantity, with_interval

_PREDICT = ('run `antenna-drive predict RECORDING --config corrected.yaml --recorder verdict.json '
            '--against reference` on a recording that was not used here (`diagnose --corrected` '
            'writes the first file, `--json` the second)')
# Tests that show an effect again.
_RATES = 'constant rates, at least six from creep to the fastest, in both directions'
_TURNS = 'one constant rate held for a minute'
_REVERSALS = 'slow reversals without bias, and a bias step at rest'
_CHIRP = 'a chirp up to 10 Hz at small amplitude with full bias'
_LARGE = 'a square wave large enough to saturate the currents'
_REST = 'a recording with amplifiers on at zero command'
_BIAS = 'a slow triangle, the bias voltage read with a second meter'
_HEIGHTS = 'the same test at two elevations far apart'

# What is said of a number above zero and below it ('' for the same), what to inspect, and which
# test to repeat.
_Row = tuple[str, str, str, str]
_ROWS: Mapping[str, _Row] = {
    # motors
    'motor.viscous_friction': (
        '{part} drags the more, the faster it turns, by more than the model has', '',
        'lubricant and seals of {part}', _RATES),
    'motor.stribeck_friction': (
        '{part} rubs more at creep than the model says', '',
        'lubricant of {part}, and how it creeps', _RATES),
    'motor.coulomb_friction': (
        '{part} rubs {by} more than configured', '{part} rubs {by} less than configured',
        'bearings and brake of {part}', _RATES),
    'motor.friction_asymmetry': (
        '{part} rubs {by} above its mean forwards, and as much below it backwards',
        '{part} rubs {by} above its mean backwards, and as much below it forwards',
        'seals and brushes of {part}', _RATES),
    'motor.load_dependent_friction': (
        '{part} loses {by} of its torque in teeth and bearings as friction', '',
        'teeth and bearings of {part}, and their lubricant', _RATES),
    'motor.torque_ripple': (
        'the torque of {part} varies with the angle of its rotor', '',
        'winding and commutation of {part}', _TURNS),
    'motor.torque_constant': (
        '{part} gives {by} more torque per current than configured',
        '{part} gives {by} less torque per current than configured',
        'magnets, temperature and winding of {part}', _LARGE),
    'motor.armature_resistance': (
        'the armature of {part} has {by} more resistance than configured',
        'the armature of {part} has {by} less resistance than configured',
        'winding, brushes and cable of {part}, with an ohmmeter', _LARGE),
    'motor.amplifier_gain': (
        'amplifier 1 of {part} has {by} more gain than configured',
        'amplifier 1 of {part} has {by} less gain than configured',
        'the gain setting of amplifier 1 of {part}', _LARGE),
    'motor.amplifier_offset': (
        'amplifier 1 of {part} has an offset at its input', '',
        'the zero of amplifier 1 of {part}, its input shorted', _REST),
    'motor.amplifier_dead_zone': (
        'amplifier 1 of {part} does not answer to inputs up to this size', '',
        'a comparator in front of amplifier 1 of {part}', 'a triangle at creep'),
    'motor.amplifier_dead_zone.crossover': (
        'the crossover of amplifier 2 of {part} swallows demands up to this size', '',
        'the crossover setting of amplifier 2 of {part}', 'a triangle at creep'),
    'motor.current_limit': (
        'the current limit of {part} is {by} higher than configured',
        'the current limit of {part} is {by} lower than configured',
        'the limiter of {part}', _LARGE),
    # gearboxes
    'gearbox.gap': (
        'half the gap of {part} is {by} wider than configured',
        'half the gap of {part} is {by} narrower than configured',
        'teeth and shims of {part}, its gap with a dial gauge', _REVERSALS),
    'gearbox.stiffness': (
        '{part} is {by} stiffer than configured', '{part} is {by} softer than configured',
        'housing, bolts and shaft of {part}', _REVERSALS),
    'gearbox.hysteresis': (
        'friction within {part} holds torque back as it winds up', '',
        'bearings and lubricant of {part}', _REVERSALS),
    'gearbox.hysteresis.share': (
        'friction within {part} holds back {by} of its load as it winds up', '',
        'bearings and lubricant of {part}', _REVERSALS),
    'gearbox.transmission_error': (
        'the teeth of {part} are uneven: its transmission error has an amplitude', '',
        'centring and teeth of {part}', _TURNS),
    # share circuit
    'torque_share.bias_pot': (
        'the bias pot is set {by} higher than written down',
        'the bias pot is set {by} lower than written down', 'the setting of the bias pot', _BIAS),
    'torque_share.fade_out_voltage': (
        'the fade-out voltage is {by} greater than written down',
        'the fade-out voltage is {by} smaller than written down', 'the setting of the fade-out',
        _BIAS),
    'torque_share.share_filter': (
        'the filters of the share circuit are {by} faster than configured',
        'the filters of the share circuit are {by} slower than configured',
        'capacitors of the share circuit', 'a square wave, the bias on'),
    'torque_share.filter_1_gain': (
        'the gain of Filter 1 is {by} higher than configured',
        'the gain of Filter 1 is {by} lower than configured', 'resistors of Filter 1',
        'a bias step at rest'),
    'torque_share.filter_1_pole': (
        'the pole of Filter 1 is {by} faster than configured',
        'the pole of Filter 1 is {by} slower than configured', 'the capacitor of Filter 1',
        'a bias step at rest'),
    # axis
    'axis.coulomb_friction': (
        'the axis rubs {by} more than configured', 'the axis rubs {by} less than configured',
        'bearings, seals and cable wrap of the axis', _RATES),
    'axis.viscous_friction': (
        'the axis drags the more, the faster it turns, by more than the model has', '',
        'grease of the axis and its temperature', _RATES),
    'axis.stribeck_friction': (
        'the axis rubs more at creep than the model says', '', 'lubricant of the axis bearing',
        _RATES),
    'axis.position_dependent_friction': (
        'friction of the axis varies with the elevation by {by}', '', 'rail and bearing',
        'one slow rate over the whole range'),
    'axis.gravity_imbalance': (
        'the axis is out of balance: gravity turns it with a torque', '',
        'counterweights', _HEIGHTS),
    'axis.wind_steady': (
        'a steady torque, such as that of wind, acts on the axis', '',
        'the record of the wind', 'the same test in calm air, at two elevations far apart'),
    'axis.inertia': (
        'the inertia of the hub is {by} greater than configured',
        'the inertia of the hub is {by} smaller than configured',
        'counterweights, subreflector and instruments', _CHIRP),
    'axis.mode_frequency': (
        'the frequency of {mode} is {by} higher than configured',
        'the frequency of {mode} is {by} lower than configured',
        'members and bolted joints of the structure', _CHIRP),
    'axis.mode_damping': (
        'the damping of {mode} is {by} greater than configured',
        'the damping of {mode} is {by} smaller than configured',
        'bolted joints and dampers of the structure', _CHIRP),
    'axis.extra_mode': (
        'the structure has one more mode, with an inertia', '',
        'parts of the structure that the model takes for rigid', _CHIRP),
    'axis.bull_gear_backlash': (
        'the bull gear has more play than configured, half of it at each pinion',
        'the bull gear has less play than configured, half of it at each pinion',
        'teeth of the bull gear, the play with a dial gauge', _REVERSALS),
    'axis.wind_gust': (
        'gusts act on the axis, with a torque', '', 'the record of the wind',
        'the same test in calm air'),
    # sensors
    'tach.gain': (
        '{part} gives {by} more volts per rate than assumed',
        '{part} gives {by} fewer volts per rate than assumed',
        '{part} against the encoder at a constant rate', _TURNS),
    'tach.offset': (
        '{part} shows a rate at standstill', '', 'the zero of {part}, shorted', _REST),
    'tach.ripple': (
        'the reading of {part} varies with the angle by {by} of the rate', '',
        'commutator and coupling of {part}', _TURNS),
    'current.gain': (
        '{part} reads {by} too high', '{part} reads {by} too low',
        'shunt and amplifier of {part}, against a second ammeter', _LARGE),
    'current.offset': (
        '{part} shows a current where there is none', '', 'the zero of {part}', _REST),
    'encoder.quantisation': (
        'the encoder has coarser steps than configured', '', 'the lowest bits of the encoder',
        'a triangle at creep'),
    'encoder.cyclic_error': (
        'the reading of the encoder varies with its own angle', '',
        'centring and interpolation of the encoder', 'one slow rate over the whole range'),
    'encoder.offset': (
        'the encoder is shifted', '', 'mounting and zero of the encoder',
        'a recording at a known elevation'),
    'bias_voltage.gain': (
        '{part} reads {by} too high', '{part} reads {by} too low', 'the divider of {part}', _BIAS),
    'loop.delay': (
        'the rate command comes late', '', 'computer and network of the command',
        'a square wave, with clocks that are synchronised'),
    'loop.delay.error_time': (
        'the rate error comes late in the rate loop', '', 'computer and network of the rate loop',
        _LARGE),
}
_PARTS = {
    'motors': 'each motor', 'tach_1': 'tachometer 1', 'tach_2': 'tachometer 2',
    'current_1': 'ammeter 1', 'current_2': 'ammeter 2',
    'bias_voltage': 'the voltmeter of the bias',
}
# What a number is added to, where that is not the field that holds the addition.
_ADDED_TO = {'armature.resistance_change': 'armature.resistance'}


# A change above this share is said as a multiple.
_MULTIPLE = 10.0


@dataclass(frozen=True)
class _Said:
    """What is said of a number: above zero, below it ('' for the same), and what to do next."""

    greater: str
    smaller: str
    configured: float | None  # what the number changes; None for nothing
    unit: str  # of `configured`
    how: str  # what the number does to it
    then: tuple[str, ...]

    def sized(self, item: Mapping[str, Any]) -> str:
        """Return what is said with the size, beside the configured one if there is one."""
        base, values = self.configured, [item['value'], *item['ci95']]
        if base:
            made = [base * (1.0 + v) if self.how == SCALE else v if self.how == SET else base + v
                    for v in values]
            change = made[0] / base - 1.0
        else:
            change = values[0]
            made = [-v for v in values] if change < 0.0 and self.smaller else values
        text = self.smaller if change < 0.0 and self.smaller else self.greater
        if '{by}' in text and not base:
            near, far = sorted(max(v * math.copysign(1.0, change), 0.0) for v in values[1:])
            return text.replace('{by}', f'{ratio(change)} ({ratio(near, "")} to {ratio(far, "")})')
        told = with_interval({'value': made[0], 'ci95': sorted(made[1:]),
                              'unit': self.unit or item['unit']})
        return (f'{text.replace("{by}", ratio(change))}: {told}'
                + (f' instead of {number(base)}' if base else ''))


def ratio(change: float, word: str = ' percent') -> str:
    """Return by how much a number differs, without its sign: 40 percent, 930 times."""
    size = abs(change)
    return f'{number(size)} times' if size >= _MULTIPLE else f'{100.0 * size:.3g}{word}'


def words(effects: Iterable[Effect], drive: Drive,
          record: np.ndarray[Any, np.dtype[Any]]) -> dict[str, Words]:
    """
    Return what people say of effects, by id.

    Parameters
    ----------
    effects
        of the catalogue
    drive
        the configuration, which knows units
    record
        of the drive in a test, shape (1,), which has the configured numbers

    """
    units = {path: entry.unit for path, entry, _ in values(drive)}
    found = {}
    for effect in effects:
        sizes = {}
        for item in (size for form in effect.forms for size in form.sizes):
            assert isinstance(item, AntennaParameter)
            name = item.name.removeprefix(f'{effect.id}.')
            sizes[item.name] = _said(effect, name, item, units, record)
        found[effect.id] = partial(_clause, effect, sizes)
    return found


def _clause(effect: Effect, said: Mapping[str, _Said],
            numbers: Mapping[str, Any]) -> tuple[str, Sequence[str]]:
    """Return what is said of an effect with some numbers, and its next steps."""
    sizes = {name: item for name, item in numbers.items() if _bare(name) in said}
    name = max(sizes, key=lambda key: abs(sizes[key]['value']))
    words, form = said[_bare(name)], effect.forms[0]
    text = words.sized(_amplitude(list(sizes.values())) if form.is_wave else sizes[name])
    if form.is_wave:
        text += f', {name.partition("@")[2].partition("[")[0]} cycles a turn'
    else:
        if form.is_course:
            text = text.replace(': ', ': up to ', 1)
        text += ''.join(f', {key.rpartition(".")[2].replace("_", " ")} '
                        f'{quantity(item["value"], item["unit"])}' for key, item in numbers.items()
                        if key not in sizes and item['unit'] != '1')
    return text + (f', where {name[name.index("[") + 1:-1]}' if name.endswith(']') else ''
                   ), words.then


def _bare(name: str) -> str:
    """Return the name of a number without its order and its label."""
    return name.partition('@')[0].partition('[')[0]


def _amplitude(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the amplitude of a wave from its sine and cosine parts, with its interval."""
    size = math.hypot(*(part['value'] for part in parts))
    half = math.hypot(*(0.5 * (part['ci95'][1] - part['ci95'][0]) * part['value'] / size
                        for part in parts)) if size else 0.0
    return {'value': size, 'ci95': [max(size - half, 0.0), size + half],
            'unit': parts[0]['unit']}


def _said(effect: Effect, name: str, item: AntennaParameter, units: Mapping[str, str],
          record: np.ndarray[Any, np.dtype[Any]]) -> _Said:
    kind = f'{_kind(effect.component)}.{effect.id.partition(".")[2]}'
    greater, smaller, inspect, repeat = _ROWS.get(f'{kind}.{name}') or _ROWS[kind]
    number = name.rpartition('_')[2]
    part = _PARTS.get(effect.component, effect.component.replace('_', ' '))
    said = {'part': part, 'mode': f'mode {number}' if number.isdigit() else 'all modes',
            'by': '{by}'}
    fields = [_changed(path) for path in getattr(item.modifier, 'fields', ())]
    base = _in_common(fields, record)
    return _Said(greater.format(**said), smaller.format(**said), base,
                 units.get(_entry(fields[0]), '') if fields else '', item.modifier.how,
                 (f'inspect {inspect.format(**said)}', _PREDICT, f'repeat {repeat}'))


def _kind(component: str) -> str:
    """Return the kind of a component: a motor, a gearbox, a sensor."""
    return 'motor' if component == 'motors' else component.removesuffix('_1').removesuffix('_2')


def _changed(path: str) -> str:
    unit, _, field = path.partition('.')
    return f'{unit}.{_ADDED_TO.get(field, field)}'


def _entry(path: str) -> str:
    """Return the entry of the configuration that a field is, or is one of the list of."""
    return path.rpartition('.')[0] if path.rpartition('.')[2].isdigit() else path


def _in_common(fields: list[str], record: np.ndarray[Any, np.dtype[Any]]) -> float | None:
    """Return the number that the first field and those of its name have; None if they differ."""
    numbers = record.view(np.float64)
    same = [path for path in fields
            if _entry(path).rpartition('.')[2] == _entry(fields[0]).rpartition('.')[2]]
    found = {float(numbers[place_of(record.dtype, path)]) for path in same}
    return found.pop() if len(found) == 1 else None
