# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
The catalogue: every effect that the drive may have and its model lacks, each at its neutral value.

Adding an effect takes one term in `physics` (with a neutral default in `parameters.sets`) and one
entry here. A parameter acts on fields of the drive's record: it scales them, is added to them, or
takes their place. Two parameters that are sine and cosine parts act as one amplitude and phase.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
import math

from antenna_drive.diagnosis.machine import Effect, Entry, FloatArray, Form, Parameter, Point
import numpy as np

SCALE, ADD, SET = 'scale', 'add', 'set'

Setting = tuple[str, str, float]


@dataclass(frozen=True)
class DriveParameter(Parameter):
    """A parameter of the drive: how it acts on which fields of the record."""

    how: str = ADD
    fields: tuple[str, ...] = ()


@dataclass(frozen=True)
class Wave(Form):
    """
    A wave of three harmonics by their sine and cosine parts, with its cycles per revolution.

    Attributes
    ----------
    stem : what the names of the amplitude, cycles and phase begin with
    paths : where these fields are
    angle : 'motor_1', 'motor_2' or 'axis': the angle that the wave follows
    orders : cycles per revolution to look for
    order : the cycles per revolution about which it is fitted, 0 for not chosen yet

    """

    stem: str = ''
    paths: tuple[str, ...] = ()
    angle: str = ''
    orders: tuple[float, ...] = ()
    order: float = 0.0

    def at(self, order: float) -> Wave:
        """Return the form for so many cycles per revolution, with parameters of its own."""
        parameters = tuple(replace(part, name=f'{part.name}@{order:g}')
                           for part in self.parameters)
        return replace(self, name=f'{order:g} cycles per revolution', parameters=parameters,
                       order=order, sought=True)

    def settings(self, sine: float, cosine: float, change: float, second_sine: float,
                 second_cosine: float, third_sine: float, third_cosine: float) -> list[Setting]:
        """Return what the sine and cosine parts of the harmonics set in the record."""
        values = (('', math.hypot(sine, cosine)), ('_phase', math.atan2(cosine, sine)),
                  ('_cycles', self.order * (1.0 + change)),
                  ('_second', math.hypot(second_sine, second_cosine)),
                  ('_second_phase', math.atan2(second_cosine, second_sine)),
                  ('_third', math.hypot(third_sine, third_cosine)),
                  ('_third_phase', math.atan2(third_cosine, third_sine)))
        return [(f'{path}.{self.stem}{end}', SET, value)
                for path in self.paths for end, value in values]

    def along(self, angle: FloatArray, parts: Sequence[float]) -> FloatArray:
        """Return the wave at angles of shape (n,), its parameters being as in `settings`."""
        sine, cosine, change, *higher = parts
        total = np.zeros_like(angle)
        amplitudes = (sine, cosine, *higher)
        for k, (a, b) in enumerate(zip(amplitudes[::2], amplitudes[1::2], strict=True), start=1):
            turned = k * self.order * (1.0 + change) * angle
            total += a * np.sin(turned) + b * np.cos(turned)
        return total


def _parameter(name: str, unit: str, low: float, high: float, step: float, how: str,
               *fields: str, reading: bool = False, start: float = 0.0) -> DriveParameter:
    return DriveParameter(name, unit, low, high, step, how=how, fields=fields, reading=reading,
                          start=start, shape=start != 0.0)


# Where a motor's own fields are, for one motor or both.
MOTORS: Mapping[str, tuple[str, ...]] = {
    'motor_1': ('motor_1',), 'motor_2': ('motor_2',), 'motors': ('motor_1', 'motor_2'),
}
# Bounds and step of a flow index: grease thins as it is sheared, windage grows with the square.
_FLOW = (0.5, 2.0, 0.02)
MOTOR_ORDERS = tuple(float(k) for k in range(1, 49))


@dataclass
class _Catalogue:
    """The entries as they are written down."""

    effects: dict[str, Effect] = field(default_factory=dict)

    def add(self, component: str, name: str, cause: str, look: str, *forms: Form) -> None:
        key = f'{component}.{name}'
        parts = tuple(f'{motor}.{name}' for motor in MOTORS['motors']) * (component == 'motors')
        self.effects[key] = Effect(key, component, cause, look, forms, parts)


def _form(key: str, *parts: DriveParameter, name: str = '') -> Form:
    named = tuple(_renamed(part, f'{key}.{part.name}') for part in parts)
    return Form(name, named)


def _renamed(part: DriveParameter, name: str) -> DriveParameter:
    return replace(part, name=name)


def _wave(key: str, unit: str, limit: float, step: float, paths: tuple[str, ...], angle: str,
          orders: tuple[float, ...], stem: str, reading: bool = False) -> Wave:
    def amplitude(part: str, shape: bool = False) -> DriveParameter:
        return DriveParameter(f'{key}.{part}', unit, -limit, limit, step, reading=reading,
                              shape=shape)

    parts = (amplitude('sine'), amplitude('cosine'),
             DriveParameter(f'{key}.cycles_change', '1', -0.05, 0.05, 2e-4, reading=reading,
                            shape=True),
             amplitude('second_sine', shape=True), amplitude('second_cosine', shape=True),
             amplitude('third_sine', shape=True), amplitude('third_cosine', shape=True))
    return Wave('', parts, stem=stem, paths=paths, angle=angle, orders=orders)


def _motor_effects(into: _Catalogue, component: str, paths: tuple[str, ...]) -> None:
    def at(name: str) -> tuple[str, ...]:
        return tuple(f'{path}.{name}' for path in paths)

    def one(name: str, cause: str, look: str, *parts: DriveParameter, form: str = '') -> None:
        into.add(component, name, cause, look, _form(f'{component}.{name}', *parts, name=form))

    one('viscous_friction', 'lubricant or seals drag the more, the faster the motor turns',
        'current grows with the rate, in both directions',
        _parameter('torque_per_rate', 'N m s/rad', 0.0, 0.5, 2e-3, ADD,
                   *at('motor.viscous_friction')),
        _parameter('flow_index', '1', *_FLOW, SET, *at('motor.flow_index'), start=1.0))
    key = f'{component}.stribeck_friction'
    into.add(component, 'stribeck_friction',
             'the lubricating film breaks down at creep and friction rises',
             'more current, and stick-slip, close to standstill',
             *(_form(key, _parameter('torque', 'N m', 0.0, 20.0, 0.05, ADD,
                                     *at('motor.stribeck_torque')),
                     _parameter('rate', 'rad/s', 0.02, 40.0, 0.02 * rate, SET,
                                *at('motor.stribeck_rate'), start=rate),
                     _parameter('shape', '1', 0.3, 2.5, 0.05, SET,
                                *at('motor.stribeck_shape'), start=1.0),
                     name=f'from {rate:g} rad/s') for rate in (0.5, 2.0, 8.0)))
    one('coulomb_friction', 'bearings or brake rub harder or less than assumed',
        'current offset that changes sign with the direction',
        _parameter('torque', 'A', -0.069, 3.0, 0.01, ADD, *at('motor.coulomb_torque')))
    one('friction_asymmetry', 'a seal or brush rubs more in one direction',
        'current level differs between the directions',
        _parameter('share', '1', -8.0, 8.0, 0.05, ADD, *at('motor.friction_asymmetry')))
    one('load_dependent_friction', 'tooth and bearing friction grow with the transmitted torque',
        'current grows by a share of the gear torque, against the direction of motion',
        _parameter('share', '1', 0.0, 0.6, 5e-3, ADD, *at('motor.load_dependent_friction')))
    into.add(component, 'torque_ripple', 'slots and poles of the motor modulate its torque',
             'rate and current vary with the angle of the rotor',
             _wave(f'{component}.torque_ripple', 'N m', 10.0, 0.02,
                   tuple(f'{path}.motor' for path in paths), paths[0], MOTOR_ORDERS,
                   'torque_ripple'))
    # whether the amplifier was trimmed to the motor as it is or as it should be, who knows
    key = f'{component}.torque_constant'
    into.add(component, 'torque_constant', 'weak or hot magnets, a wrong winding',
             'more or less current for the same motion',
             *(_form(key, _parameter(name, '1', -0.6, 0.6, 5e-3, SCALE,
                                     *at('motor.torque_constant'), *other), name=words)
               for name, words, other in (
                   ('change', 'torque and back-EMF', at('armature.back_emf_share')),
                   ('trimmed_change', 'torque and back-EMF, the limiter trimmed to it',
                    at('armature.back_emf_constant')),
                   ('torque_change', 'torque alone', ()))))
    key = f'{component}.armature_resistance'
    into.add(component, 'armature_resistance', 'hot or worn winding, brushes or cable',
             'current follows its demand with another gain and lag',
             _form(key, _parameter('change', 'ohm', -0.4, 3.0, 4e-3, ADD,
                                   *at('armature.resistance_change')), name='of the winding'),
             _form(key, _parameter('trimmed_change', '1', -0.8, 3.0, 5e-3, SCALE,
                                   *at('armature.resistance')),
                   name='of the winding, the amplifier trimmed to it'))
    one('amplifier_gain', 'amplifier 1 set or drifted to another gain',
        'stiffer or softer rate loop: currents at reversals',
        _parameter('change', '1', -0.8, 1.5, 5e-3, SCALE, *at('amplifier.rate_gain')))
    one('amplifier_offset', 'drift of the operational amplifier',
        'a constant rate error, and currents that wind up against each other',
        _parameter('offset', 'V', -0.5, 0.5, 5e-4, ADD, *at('amplifier.offset')))
    key = f'{component}.amplifier_dead_zone'
    into.add(component, 'amplifier_dead_zone',
             'crossover distortion, or a comparator in front of amplifier 1',
             'no answer to small rate errors or demands, hunting at low rates',
             _form(key, _parameter('half_width', 'V', 0.0, 0.5, 1e-3, ADD,
                                   *at('amplifier.dead_zone')), name='in front of amplifier 1'),
             _form(key, _parameter('crossover', 'A', 0.0, 2.0, 5e-3, ADD,
                                   *at('amplifier.crossover')), name='crossover of amplifier 2'))
    one('current_limit', 'limiter set lower or higher than assumed',
        'current clipped at another level while it saturates',
        _parameter('change', '1', -0.9, 0.5, 5e-3, SCALE, *at('motor.current_limit')))


def _gearbox_effects(into: _Catalogue, component: str, path: str) -> None:
    def one(name: str, cause: str, look: str, *parts: DriveParameter) -> None:
        into.add(component, name, cause, look, _form(f'{component}.{name}', *parts))

    one('gap', 'worn teeth, or shims set wrong', 'time to cross the gap at a reversal',
        _parameter('change', '1', -0.9, 4.0, 5e-3, SCALE, f'{path}.gearbox.half_gap'))
    one('stiffness', 'loose housing, cracked shaft or other teeth',
        'frequency of the oscillation after a contact',
        _parameter('change', '1', -0.8, 4.0, 5e-3, SCALE, f'{path}.gearbox.stiffness'))
    key = f'{component}.hysteresis'
    into.add(component, 'hysteresis', 'friction within the gear train as it winds up',
             'torque lags behind the wind-up at each change of direction',
             _form(key, _parameter('torque', 'N m', 0.0, 10.0, 0.02, ADD,
                                   f'{path}.gearbox.hysteresis'),
                   _parameter('angle', 'rad', 2e-3, 0.5, 2e-3, SET,
                              f'{path}.gearbox.hysteresis_angle', start=0.03),
                   name='the same at any load'),
             _form(key, _parameter('share', '1', 0.0, 0.9, 4e-3, ADD,
                                   f'{path}.gearbox.hysteresis_share'),
                   _parameter('share_angle', 'rad', 2e-3, 0.5, 2e-3, SET,
                              f'{path}.gearbox.hysteresis_angle', start=0.03),
                   name='a share of the load'))
    into.add(component, 'transmission_error', 'eccentric or uneven teeth',
             'rate and current vary with the angle of the shaft, while the teeth touch',
             _wave(f'{component}.transmission_error', 'rad', 0.3, 5e-4, (f'{path}.gearbox',), path,
                   MOTOR_ORDERS, 'transmission_error'))


def _share_effects(into: _Catalogue) -> None:
    share, filter_1 = 'torque_share.circuit', 'torque_share.filter_1'
    key = 'torque_share'

    def one(name: str, cause: str, look: str, *parts: DriveParameter) -> None:
        into.add(key, name, cause, look, _form(f'{key}.{name}', *parts))

    one('bias_pot', 'the pot is set otherwise than written down',
        'bias voltage and difference of the currents scaled',
        _parameter('change', '1', -0.8, 0.5, 5e-3, SCALE, f'{share}.bias_pot'))
    one('fade_out_voltage', 'the fade-out is set otherwise than written down',
        'bias fades at another load',
        _parameter('change', '1', -0.6, 0.6, 5e-3, SCALE, f'{share}.fade_out_voltage'))
    into.add(key, 'share_filter', 'capacitors of the share circuit drifted',
             'bias follows the load slower or faster',
             _form(f'{key}.share_filter', _parameter(
                 'load_rate_change', '1', -0.8, 3.0, 5e-3, SCALE, f'{share}.k_3'),
                 name='transfer function 3'),
             _form(f'{key}.share_filter', _parameter(
                 'share_rate_change', '1', -0.8, 3.0, 5e-3, SCALE, f'{share}.s_2',
                 f'{share}.k_2'), name='transfer functions 2 and 4'),
             _form(f'{key}.share_filter', _parameter(
                 'rate_change', '1', -0.8, 3.0, 5e-3, SCALE, f'{share}.s_2', f'{share}.k_2',
                 f'{share}.k_3'), name='all transfer functions'))
    one('filter_1_gain', 'resistors of Filter 1 set or drifted',
        'difference of the currents follows the bias with another error and speed',
        _parameter('change', '1', -0.8, 2.0, 5e-3, SCALE, f'{filter_1}.gain'))
    one('filter_1_pole', 'capacitor of Filter 1 drifted',
        'difference of the currents settles at another level and speed',
        _parameter('change', '1', -0.8, 3.0, 5e-3, SCALE, f'{filter_1}.pole'))


def _axis_effects(into: _Catalogue) -> None:
    path = 'plant.axis'

    def one(name: str, cause: str, look: str, *parts: DriveParameter) -> None:
        into.add('axis', name, cause, look, _form(f'axis.{name}', *parts))

    one('coulomb_friction', 'bearings, seals or cable wrap rub harder or less than assumed',
        'both currents change with the direction',
        _parameter('change', '1', -0.9, 3.0, 5e-3, SCALE, f'{path}.coulomb_torque'))
    one('viscous_friction', 'cold grease', 'both currents grow with the rate',
        _parameter('torque_per_rate', 'N m s/rad', 0.0, 1e9, 1e5, ADD,
                   f'{path}.viscous_friction'),
        _parameter('flow_index', '1', *_FLOW, SET, f'{path}.flow_index', start=1.0))
    into.add('axis', 'stribeck_friction', 'the film of the axis bearing breaks down at creep',
             'stick-slip of the axis, both currents rise close to standstill',
             *(_form('axis.stribeck_friction', _parameter(
                 'torque', 'N m', 0.0, 6e5, 1e3, ADD, f'{path}.stribeck_torque'),
                 _parameter('rate', 'rad/s', 2e-6, 3e-3, 0.02 * rate, SET,
                            f'{path}.stribeck_rate', start=rate),
                 _parameter('shape', '1', 0.3, 2.5, 0.05, SET, f'{path}.stribeck_shape',
                            start=1.0), name=f'from {rate:g} rad/s')
               for rate in (4e-5, 2e-4, 8e-4)))
    into.add('axis', 'position_dependent_friction', 'an uneven rail or bearing',
             'both currents vary with the elevation, against the direction of motion',
             _wave('axis.position_dependent_friction', '1', 0.9, 5e-3, (path,), 'axis',
                   tuple(20.0 * 1.03 ** k for k in range(200)), 'friction_wave'))
    one('gravity_imbalance', 'counterweight too light or too heavy',
        'both currents shifted, by the cosine of the elevation',
        _parameter('torque', 'N m', -1e6, 1e6, 500.0, ADD, f'{path}.gravity_torque'))
    one('wind_steady', 'a steady wind on the dish', 'both currents shifted',
        _parameter('torque', 'N m', -1e6, 1e6, 500.0, ADD, f'{path}.steady_wind_torque'))
    one('inertia', 'other counterweight, subreflector or instruments',
        'currents at every change of rate, and the frequencies of the modes',
        _parameter('change', '1', -0.6, 2.0, 5e-3, SCALE, f'{path}.inertia_hub'))
    into.add('axis', 'mode_frequency', 'a structural member is stiffer or softer',
             'oscillation after a reversal at another frequency',
             *(_form('axis.mode_frequency', _parameter(
                 f'change_{j + 1}', '1', -0.5, 0.8, 3e-3, SCALE, f'{path}.mode_frequencies.{j}'),
                 name=f'mode {j + 1}') for j in range(3)),
             _form('axis.mode_frequency', _parameter(
                 'change', '1', -0.5, 0.8, 3e-3, SCALE,
                 *(f'{path}.mode_frequencies.{j}' for j in range(3))), name='all modes'))
    into.add('axis', 'mode_damping', 'bolted joints slip, or dampers were added',
             'oscillation after a reversal decays faster or slower',
             *(_form('axis.mode_damping', _parameter(
                 f'factor_{j + 1}', '1', -0.95, 30.0, 0.1, SCALE,
                 f'{path}.mode_damping_ratios.{j}'), name=f'mode {j + 1}') for j in range(3)),
             _form('axis.mode_damping', _parameter(
                 'factor', '1', -0.95, 30.0, 0.1, SCALE,
                 *(f'{path}.mode_damping_ratios.{j}' for j in range(3))), name='all modes'))
    into.add('axis', 'extra_mode', 'a part of the structure that the model takes for rigid',
             'an oscillation that the model has not',
             *(_form('axis.extra_mode', _parameter(
                 'inertia', 'kg m^2', 0.0, 8e6, 2e4, SET, f'{path}.mode_inertias.3'),
                 _parameter('frequency', 'Hz', 0.85 * frequency, 1.18 * frequency,
                            0.005 * frequency, SET, f'{path}.mode_frequencies.3',
                            start=frequency),
                 _parameter('damping', '1', 0.0, 0.2, 2e-3, SET,
                            f'{path}.mode_damping_ratios.3', start=0.03),
                 name=f'{frequency:.2g} Hz')
               for frequency in EXTRA_MODES))
    one('bull_gear_backlash', 'worn bull gear: both pinions have more play',
        'longer crossing of both gaps at a reversal',
        _parameter('half_gap', 'rad', -0.1, 0.6, 1e-3, ADD, 'motor_1.gearbox.half_gap',
                   'motor_2.gearbox.half_gap'))


# The frequencies from which an additional mode is sought [Hz].
EXTRA_MODES = tuple(0.6 * 1.14 ** k for k in range(23))


def _sensor_effects(into: _Catalogue) -> None:
    for m in (1, 2):
        tach, current, motor = f'tach_{m}', f'current_{m}', f'motor_{m}'

        def one(component: str, name: str, cause: str, look: str, part: DriveParameter) -> None:
            into.add(component, name, cause, look, _form(f'{component}.{name}', part))

        one(tach, 'gain', 'the tachometer gives more or less volts per rate',
            'this motor runs slower or faster than its partner, currents wind up',
            _parameter('change', '1', -0.3, 0.3, 5e-4, ADD, f'{motor}.tachometer.gain'))
        one(tach, 'offset', 'drift of the tachometer or its amplifier',
            'a constant rate error, currents wind up against each other',
            _parameter('offset', 'rad/s', -5.0, 5.0, 0.02, ADD, f'{motor}.tachometer.offset'))
        into.add(tach, 'ripple', 'commutator or coupling of the tachometer',
                 'reading varies with the angle of the rotor, more at higher rate',
                 _wave(f'{tach}.ripple', '1', 0.3, 2e-4, (f'{motor}.tachometer',), motor,
                       MOTOR_ORDERS, 'ripple'))
        one(current, 'gain', 'shunt or amplifier of the ammeter', 'reading scaled',
            _parameter('change', '1', -0.5, 0.5, 1e-3, ADD, f'{motor}.ammeter.gain',
                       reading=True))
        one(current, 'offset', 'drift of the ammeter', 'reading shifted',
            _parameter('offset', 'A', -1.0, 1.0, 1e-3, ADD, f'{motor}.ammeter.offset',
                       reading=True))
    into.add('encoder', 'quantisation', 'bits of the encoder are lost', 'steps in the angle',
             _form(QUANTISATION, _parameter('step', 'rad', 0.0, 1e-2, 1e-5, SET, DIGIT,
                                            reading=True)))
    into.add('encoder', 'cyclic_error', 'eccentric scale or uneven interpolation',
             'the angle varies with itself',
             _wave('encoder.cyclic_error', 'rad', 1e-3, 1e-6, ('plant.encoder',), 'axis',
                   tuple(20.0 * 1.01 ** k for k in range(830)), 'cyclic_error', reading=True))
    into.add('encoder', 'offset', 'the encoder was mounted or zeroed otherwise',
             'the angle shifted',
             _form('encoder.offset', _parameter(
                 'offset', 'rad', -0.1, 0.1, 1e-6, ADD, 'plant.encoder.offset', reading=True)))
    into.add('bias_voltage', 'gain', 'divider of the voltmeter', 'reading scaled',
             _form('bias_voltage.gain', _parameter(
                 'change', '1', -0.5, 0.5, 1e-3, ADD,
                 'torque_share.circuit.voltmeter_gain', reading=True)))


QUANTISATION = 'encoder.quantisation'


@dataclass(frozen=True)
class DriveEntry(Entry):
    """A place of the drive: the field that changes over time, by how much, and what it needs."""

    path: str = ''
    size: float = 0.0
    settings: tuple[Setting, ...] = ()


def _entries() -> Iterator[DriveEntry]:
    yield DriveEntry('torque on the axis', 'axis', 'plant.axis.steady_wind_torque', 3e4)
    yield DriveEntry('voltage in the torque share', 'torque_share',
                     'torque_share.circuit.fade_out_voltage', 0.2)
    for m in (1, 2):
        motor, tooth = f'motor_{m}', f'motor_{m}.gearbox.transmission_error'
        yield DriveEntry(f'friction of motor {m}', motor, f'{motor}.motor.coulomb_torque', 0.2)
        yield DriveEntry(f'voltage in amplifier {m}', motor, f'{motor}.amplifier.offset', 0.01)
        yield DriveEntry(f'reading of tachometer {m}', f'tach_{m}', f'{motor}.tachometer.offset',
                         0.2)
        # a tooth that is displaced alike at any angle, as far as the input says
        yield DriveEntry(f'displacement in gearbox {m}', f'gearbox_{m}', tooth, 2e-3, (
            (tooth, ADD, 1e-12), (f'{tooth}_cycles', SET, 0.0),
            (f'{tooth}_phase', SET, 0.5 * math.pi)))


# Where something that no effect names may enter the drive.
ENTRIES = tuple(_entries())
DELAY = 'loop.delay.time'
GUST = 'axis.wind_gust'
# Digit of the encoder [rad], and the share of one by which its reading is off its middle.
DIGIT, TURN = 'plant.encoder.step', 'plant.encoder.turn'
# The gust's torque is free at times so far apart [s], and smooth between.
GUST_KNOT_S = 0.5
# Wind has no jumps: from one knot to the next it changes by no more than so many times its usual
# change.
_JUMP = 7.0


def quantisation_form(digit: float) -> Form:
    """
    Return the form of a quantisation whose digit the readings themselves tell.

    Either there is such a digit or there is none: the derivative reaches from the one to the
    other.
    """
    return _form(QUANTISATION, _parameter(
        'step', 'rad', 0.0, digit, digit, SET, DIGIT, reading=True), DriveParameter(
        'turn', '1', -0.5, 0.5, 0.02, how=SET, fields=(TURN,), reading=True, shape=True),
        name='digits seen')


def gust_knots(duration: float) -> int:
    """Return how many knots a gust has in a test of so many seconds."""
    return int(duration / GUST_KNOT_S) + 2


@dataclass(frozen=True)
class Course(Form):
    """A course over time in each test, free at its knots: so free that it may be no wind."""

    def strangeness(self, point: Point) -> float:
        """Return the greatest change between two knots by that which wind might make."""
        courses: dict[int | None, list[float]] = {}
        for knot in self.parameters:
            courses.setdefault(knot.experiment, []).append(point[knot.name])
        found = 0.0
        for course in courses.values():
            change = np.abs(np.diff(course))
            if change.size and np.any(change):
                found = max(found, float(change.max() / (1.4826 * np.median(change) + 1e-30)))
        return found / _JUMP


def gust_form(durations: Sequence[float]) -> Form:
    """Return the form of a gust: in each test a torque over time that is what it is."""
    return Course('torque over time', tuple(
        DriveParameter(f'{GUST}.torque:{k}:{i}', 'N m', -1e6, 1e6, 2e3, 3e4, experiment=k,
                       how=SET, fields=(f'gust:{k}:{i}',))
        for k, duration in enumerate(durations)
        for i in range(gust_knots(duration))))


def catalogue() -> dict[str, Effect]:
    """Return the catalogue of the drive, by id."""
    into = _Catalogue()
    for component, paths in MOTORS.items():
        _motor_effects(into, component, paths)
    for m in (1, 2):
        _gearbox_effects(into, f'gearbox_{m}', f'motor_{m}')
    _share_effects(into)
    _axis_effects(into)
    _sensor_effects(into)
    into.add('axis', 'wind_gust', 'gusts on the dish, other ones in each test',
             'both currents vary with time, by no angle or rate')
    into.add('loop', 'delay', 'a computer or a network in the command or in the rate loop',
             'everything comes late, or the rate loop rings',
             _form('loop.delay', _parameter('time', 's', 0.0, 0.2, 5e-4, SET),
                   name='of the command'),
             _form('loop.delay', _parameter(
                 'error_time', 's', 0.0, 0.05, 2e-4, ADD, 'motor_1.amplifier.delay',
                 'motor_2.amplifier.delay'), name='of the rate error'))
    return into.effects
