# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue: every effect that the drive may have and its model lacks, each at its neutral value.

An effect has a tolerance (`healthy`): a size that a machine in good order may have. Where the test
sheet or the configuration gives a tolerance for the same number, the larger of the two counts.

A new effect takes one term in `physics` (with a neutral default in `parameters.sets`) and one
entry here. An entry declares what its parameters do: see `modifiers`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from antenna_drive.diagnosis import gust
from antenna_drive.diagnosis.modifiers import (
    add, AntennaParameter, Modifier, RecorderError, Rounding, scale, set_to,
)
from antenna_drive.diagnosis.wave_shape import WaveShape
from antenna_drive.diagnosis.waves import wave
from antenna_drive.readings import NAMED
from simgap.machine.contract import Effect, Form

# The motors of an effect, for one motor or both.
MOTORS: Mapping[str, tuple[str, ...]] = {
    'motor_1': ('motor_1',), 'motor_2': ('motor_2',), 'motors': ('motor_1', 'motor_2'),
}
# The flow index of a lubricant: grease thins as it is sheared, windage grows with the square.
_FLOW_INDEX = (0.5, 2.0, 0.02)
# Cycles per revolution, and frequencies of an additional mode [Hz], that are looked for.
MOTOR_ORDERS = tuple(float(k) for k in range(1, 49))
_RAIL_ORDERS = tuple(20.0 * 1.03 ** k for k in range(200))
_ENCODER_ORDERS = tuple(20.0 * 1.01 ** k for k in range(830))
# The form of a quantisation whose digit the readings tell.
DIGITS_SEEN = 'digits seen'
EXTRA_MODES = tuple(0.6 * 1.14 ** k for k in range(23))
# The mode of that effect: the record has room for it, the configuration does not have it.
EXTRA_MODE = 3


class _Catalogue(dict[str, Effect]):
    """The entries as they are written down; names of parameters are relative to their effect."""

    def add(self, component: str, name: str, cause: str, look: str, *forms: Form,
            simpler: str = '') -> None:
        key = f'{component}.{name}'
        parts = tuple(f'{motor}.{name}' for motor in MOTORS['motors']) * (component == 'motors')
        self[key] = Effect(key, component, cause, look,
                           tuple(_prefixed(form, key) for form in forms), parts,
                           (f'{component}.{simpler}',) * bool(simpler))


def _prefixed(form: Form, key: str) -> Form:
    if form.is_course:
        return form
    return replace(form, parameters=tuple(
        replace(p, name=f'{key}.{p.name}') for p in form.parameters))


def _form(*parameters: AntennaParameter, name: str = '') -> Form:
    return Form(name, parameters)


def _number(name: str, unit: str, low: float, high: float, step: float, modifier: Modifier,
            start: float = 0.0, healthy: float = 0.0) -> AntennaParameter:
    return AntennaParameter(name, unit, low, high, step, start=start, is_shape=start != 0.0,
                            modifier=modifier, tolerance=healthy)


def _one(name: str, unit: str, low: float, high: float, step: float, modifier: Modifier,
         healthy: float = 0.0, form: str = '') -> Form:
    return _form(_number(name, unit, low, high, step, modifier, healthy=healthy), name=form)


def _fields(owners: Sequence[str], name: str) -> list[str]:
    return [f'{owner}.{name}' for owner in owners]


def _stribeck(unit_rates: Iterable[float], torque: tuple[float, float], rate: tuple[float, float],
              owners: Sequence[str], healthy: float) -> tuple[Form, ...]:
    """Return forms of Stribeck friction that begin at several rates [rad/s]."""
    at = partial(_fields, owners)
    return tuple(_form(
        _number('torque', 'N m', 0.0, *torque, add(*at('stribeck_torque')), healthy=healthy),
        _number('rate', 'rad/s', *rate, 0.02 * start, set_to(*at('stribeck_rate')), start=start),
        _number('shape', '1', 0.3, 2.5, 0.05, set_to(*at('stribeck_shape')), start=1.0),
        name=f'from {start:g} rad/s') for start in unit_rates)


def _friction_effects(into: _Catalogue, component: str, motors: tuple[str, ...]) -> None:
    at = partial(_fields, motors)
    into.add(component, 'viscous_friction',
             'lubricant or seals drag the more, the faster the motor turns',
             'current grows with the rate, in both directions',
             _form(_number('torque_per_rate', 'N m s/rad', 0.0, 0.5, 2e-3,
                           add(*at('motor.viscous_friction')), healthy=1e-3),
                   _number('flow_index', '1', *_FLOW_INDEX, set_to(*at('motor.flow_index')),
                           start=1.0)))
    into.add(component, 'stribeck_friction',
             'the lubricating film breaks down at creep and friction rises',
             'more current, and stick-slip, close to standstill',
             *_stribeck((0.5, 2.0, 8.0), (20.0, 0.05), (0.02, 40.0), at('motor'), 0.05),
             simpler='coulomb_friction')
    into.add(component, 'coulomb_friction', 'bearings or brake rub harder or less than assumed',
             'current offset that changes sign with the direction',
             _one('torque', 'article A', -0.069, 3.0, 0.01, add(*at('motor.coulomb_torque')),
                  healthy=2e-3))
    into.add(component, 'friction_asymmetry', 'a seal or brush rubs more in one direction',
             'current level differs between the directions',
             _one('share', '1', -8.0, 8.0, 0.05, add(*at('motor.friction_asymmetry')),
                  healthy=0.05))
    into.add(component, 'load_dependent_friction',
             'tooth and bearing friction grow with the transmitted torque',
             'current grows by a share of the gear torque, against the direction of motion',
             _one('share', '1', 0.0, 0.6, 5e-3, add(*at('motor.load_dependent_friction')),
                  healthy=5e-3))


def _motor_effects(into: _Catalogue, component: str, motors: tuple[str, ...]) -> None:
    at = partial(_fields, motors)
    into.add(component, 'torque_ripple', 'slots and poles of the motor modulate its torque',
             'rate and current vary with the angle of the rotor',
             wave('N m', 10.0, 0.02, WaveShape('torque_ripple', tuple(at('motor')), motors[0]),
                  MOTOR_ORDERS, healthy=0.02))
    # nobody knows whether the amplifier was trimmed to the motor as it is or as it should be
    into.add(component, 'torque_constant', 'weak or hot magnets, a wrong winding',
             'more or less current for the same motion',
             *(_one(name, '1', -0.6, 0.6, 5e-3, scale(*at('motor.torque_constant'), *other),
                    form=words)
               for name, words, other in (
                   ('change', 'torque and back-EMF', at('armature.back_emf_share')),
                   ('trimmed_change', 'torque and back-EMF, the limiter trimmed to it',
                    at('armature.back_emf_constant')),
                   ('torque_change', 'torque alone', []))))
    into.add(component, 'armature_resistance', 'hot or worn winding, brushes or cable',
             'current follows its demand with another gain and lag',
             _one('change', 'ohm', -0.4, 3.0, 4e-3, add(*at('armature.resistance_change')),
                  form='of the winding'),
             _one('trimmed_change', '1', -0.8, 3.0, 5e-3, scale(*at('armature.resistance')),
                  healthy=0.02, form='of the winding, the amplifier trimmed to it'))
    into.add(component, 'amplifier_gain', 'amplifier 1 set or drifted to another gain',
             'stiffer or softer rate loop: currents at reversals',
             _one('change', '1', -0.8, 1.5, 5e-3, scale(*at('amplifier.rate_gain'))))
    into.add(component, 'amplifier_offset', 'drift of the operational amplifier',
             'a constant rate error, and currents that wind up against each other',
             _one('offset', 'V', -0.5, 0.5, 5e-4, add(*at('amplifier.offset'))))
    into.add(component, 'amplifier_dead_zone',
             'crossover distortion, or a comparator in front of amplifier 1',
             'no answer to small rate errors or demands, hunting at low rates',
             _one('half_width', 'V', 0.0, 0.5, 1e-3, add(*at('amplifier.dead_zone')), healthy=1e-3,
                  form='in front of amplifier 1'),
             _one('crossover', 'article A', 0.0, 2.0, 5e-3, add(*at('amplifier.crossover')),
                  healthy=0.01, form='crossover of amplifier 2'))
    into.add(component, 'current_limit', 'limiter set lower or higher than assumed',
             'current clipped at another level while it saturates',
             _one('change', '1', -0.9, 0.5, 5e-3, scale(*at('motor.current_limit'))))


def _gearbox_effects(into: _Catalogue, m: int) -> None:
    component, motor = f'gearbox_{m}', f'motor_{m}'
    gearbox = f'{motor}.gearbox'
    into.add(component, 'gap', 'worn teeth, or shims set wrong',
             'time to cross the gap at a reversal',
             _one('change', '1', -0.9, 4.0, 5e-3, scale(f'{gearbox}.half_gap')))
    into.add(component, 'stiffness', 'loose housing, cracked shaft or other teeth',
             'frequency of the oscillation after a contact',
             _one('change', '1', -0.8, 4.0, 5e-3, scale(f'{gearbox}.stiffness')))
    into.add(component, 'hysteresis', 'friction within the gear train as it winds up',
             'torque lags behind the wind-up at each change of direction',
             _form(_number('torque', 'N m', 0.0, 10.0, 0.02, add(f'{gearbox}.hysteresis'),
                           healthy=0.02),
                   _number('angle', 'rad', 2e-3, 0.5, 2e-3, set_to(f'{gearbox}.hysteresis_angle'),
                           start=0.03), name='the same at any load'),
             _form(_number('share', '1', 0.0, 0.9, 4e-3, add(f'{gearbox}.hysteresis_share'),
                           healthy=5e-3),
                   _number('share_angle', 'rad', 2e-3, 0.5, 2e-3,
                           set_to(f'{gearbox}.hysteresis_angle'), start=0.03),
                   name='a share of the load'))
    into.add(component, 'transmission_error', 'eccentric or uneven teeth',
             'rate and current vary with the angle of the shaft, while the teeth touch',
             wave('rad', 0.3, 5e-4, WaveShape('transmission_error', (gearbox,), motor),
                  MOTOR_ORDERS, healthy=5e-4))


def _share_effects(into: _Catalogue) -> None:
    component = 'torque_share'
    circuit, filter_1 = f'{component}.circuit', f'{component}.filter_1'

    def relative(name: str, low: float, high: float, *fields: str, form: str = '') -> Form:
        return _one(name, '1', low, high, 5e-3, scale(*fields), form=form)

    into.add(component, 'bias_pot', 'the pot is set otherwise than written down',
             'bias voltage and difference of the currents scaled',
             relative('change', -0.8, 0.5, f'{circuit}.bias_pot'))
    into.add(component, 'fade_out_voltage', 'the fade-out is set otherwise than written down',
             'bias fades at another load',
             relative('change', -0.6, 0.6, f'{circuit}.fade_out_voltage'))
    speed_of_2, speed_of_3 = (f'{circuit}.s_2', f'{circuit}.k_2'), (f'{circuit}.k_3',)
    into.add(component, 'share_filter', 'capacitors of the share circuit drifted',
             'bias follows the load slower or faster',
             relative('load_rate_change', -0.8, 3.0, *speed_of_3, form='transfer function 3'),
             relative('share_rate_change', -0.8, 3.0, *speed_of_2,
                      form='transfer functions 2 and 4'),
             relative('rate_change', -0.8, 3.0, *speed_of_2, *speed_of_3,
                      form='all transfer functions'))
    into.add(component, 'filter_1_gain', 'resistors of Filter 1 set or drifted',
             'difference of the currents follows the bias with another error and speed',
             relative('change', -0.8, 2.0, f'{filter_1}.gain'))
    into.add(component, 'filter_1_pole', 'capacitor of Filter 1 drifted',
             'difference of the currents settles at another level and speed',
             relative('change', -0.8, 3.0, f'{filter_1}.pole'))


def _axis_effects(into: _Catalogue) -> None:
    component, axis = 'axis', 'plant.axis'
    into.add(component, 'coulomb_friction',
             'bearings, seals or cable wrap rub harder or less than assumed',
             'both currents change with the direction',
             _one('change', '1', -0.9, 3.0, 5e-3, scale(f'{axis}.coulomb_torque')))
    into.add(component, 'viscous_friction', 'cold grease', 'both currents grow with the rate',
             _form(_number('torque_per_rate', 'N m s/rad', 0.0, 1e9, 1e5,
                           add(f'{axis}.viscous_friction'), healthy=2e5),
                   _number('flow_index', '1', *_FLOW_INDEX, set_to(f'{axis}.flow_index'),
                           start=1.0)))
    into.add(component, 'stribeck_friction', 'the film of the axis bearing breaks down at creep',
             'stick-slip of the axis, both currents rise close to standstill',
             *_stribeck((4e-5, 2e-4, 8e-4), (6e5, 1e3), (2e-6, 3e-3), [axis], 3e3),
             simpler='coulomb_friction')
    into.add(component, 'position_dependent_friction', 'an uneven rail or bearing',
             'both currents vary with the elevation, against the direction of motion',
             wave('1', 0.9, 5e-3, WaveShape('friction_wave', (axis,), 'axis'), _RAIL_ORDERS,
                  healthy=0.01))
    into.add(component, 'gravity_imbalance', 'counterweight too light or too heavy',
             'both currents shifted, by the cosine of the elevation',
             _one('torque', 'N m', -1e6, 1e6, 500.0, add(f'{axis}.gravity_torque'), healthy=1e3))
    into.add(component, 'wind_steady', 'a steady wind on the dish', 'both currents shifted',
             _one('torque', 'N m', -1e6, 1e6, 500.0, add(f'{axis}.steady_wind_torque'),
                  healthy=1e3))
    into.add(component, 'inertia', 'other counterweight, subreflector or instruments',
             'currents at every change of rate, and the frequencies of the modes',
             _one('change', '1', -0.6, 2.0, 5e-3, scale(f'{axis}.inertia_hub')))

    def of_modes(name: str, low: float, high: float, step: float, field: str) -> list[Form]:
        fields = [f'{axis}.{field}.{j}' for j in range(3)]
        return [*(_one(f'{name}_{j + 1}', '1', low, high, step, scale(fields[j]),
                       form=f'mode {j + 1}') for j in range(3)),
                _one(name, '1', low, high, step, scale(*fields), form='all modes')]

    into.add(component, 'mode_frequency', 'a structural member is stiffer or softer',
             'oscillation after a reversal at another frequency',
             *of_modes('change', -0.5, 0.8, 3e-3, 'mode_frequencies'))
    into.add(component, 'mode_damping', 'bolted joints slip, or dampers were added',
             'oscillation after a reversal decays faster or slower',
             *of_modes('factor', -0.95, 30.0, 0.1, 'mode_damping_ratios'))
    into.add(component, 'extra_mode', 'a part of the structure that the model takes for rigid',
             'an oscillation that the model does not have',
             *(_form(_number('inertia', 'kg m^2', 0.0, 8e6, 2e4,
                             set_to(f'{axis}.mode_inertias.{EXTRA_MODE}'), healthy=2e4),
                     _number('frequency', 'Hz', 0.85 * hertz, 1.18 * hertz, 0.005 * hertz,
                             set_to(f'{axis}.mode_frequencies.{EXTRA_MODE}'), start=hertz),
                     _number('damping', '1', 0.0, 0.2, 2e-3,
                             set_to(f'{axis}.mode_damping_ratios.{EXTRA_MODE}'), start=0.03),
                     name=f'{hertz:.2g} Hz') for hertz in EXTRA_MODES))
    into.add(component, 'bull_gear_backlash', 'worn bull gear: both pinions have more play',
             'longer crossing of both gaps at a reversal',
             _one('half_gap', 'rad', -0.1, 0.6, 1e-3,
                  add('motor_1.gearbox.half_gap', 'motor_2.gearbox.half_gap'), healthy=3e-3))


def _sensor_effects(into: _Catalogue, encoder_digit: float) -> None:
    for m in (1, 2):
        tach, current, motor = f'tach_{m}', f'current_{m}', f'motor_{m}'
        into.add(tach, 'gain', 'the tachometer gives more or less volts per rate',
                 'this motor runs slower or faster than its partner, currents wind up',
                 _one('change', '1', -0.3, 0.3, 5e-4, add(f'{motor}.tachometer.gain'),
                      healthy=3e-3))
        into.add(tach, 'offset', 'drift of the tachometer or its amplifier',
                 'a constant rate error, currents wind up against each other',
                 _one('offset', 'rad/s', -5.0, 5.0, 0.02, add(f'{motor}.tachometer.offset')))
        into.add(tach, 'ripple', 'commutator or coupling of the tachometer',
                 'reading varies with the angle of the rotor, more at higher rate',
                 wave('1', 0.3, 2e-4, WaveShape('ripple', (f'{motor}.tachometer',), motor),
                      MOTOR_ORDERS, healthy=1e-3))
        into.add(current, 'gain', 'shunt or amplifier of the ammeter', 'reading scaled',
                 _one('change', '1', -0.5, 0.5, 1e-3,
                      RecorderError('gain', current, (NAMED[current].gain,))))
        into.add(current, 'offset', 'drift of the ammeter', 'reading shifted',
                 _one('offset', 'article A', -1.0, 1.0, 1e-3,
                      RecorderError('zero', current, (f'{motor}.ammeter.offset',)), healthy=0.02))
    into.add('encoder', 'quantisation', 'bits of the encoder are lost', 'steps in the angle',
             _quantisation(encoder_digit))
    into.add('encoder', 'cyclic_error', 'eccentric scale or uneven interpolation',
             'the angle varies with itself',
             wave('rad', 1e-3, 1e-6, WaveShape('cyclic_error', ('plant.encoder',), 'axis'),
                  _ENCODER_ORDERS, on_readings=True, healthy=2e-6), simpler='offset')
    into.add('encoder', 'offset', 'the encoder was mounted or zeroed otherwise',
             'the angle shifted',
             _one('offset', 'rad', -0.1, 0.1, 1e-6,
                  RecorderError('zero', 'encoder', ('plant.encoder.offset',)), healthy=2e-5))
    into.add('bias_voltage', 'gain', 'divider of the voltmeter', 'reading scaled',
             _one('change', '1', -0.5, 0.5, 1e-3,
                  RecorderError('gain', 'bias_voltage', (NAMED['bias_voltage'].gain,))))


def _quantisation(digit: float) -> Form:
    """
    Return the form of a quantisation, whose digit the readings themselves may tell [rad].

    There is such a digit or there is none: the difference quotient reaches from one to the other.
    """
    digits = Rounding('digit', ('plant.encoder.step',))
    if not digit:
        return _one('step', 'rad', 0.0, 1e-2, 1e-5, digits)
    turn = AntennaParameter('turn', '1', -1.0, 1.0, 0.02, is_shape=True, modifier=Rounding('turn'))
    return _form(_number('step', 'rad', 0.0, digit, digit, digits), turn, name=DIGITS_SEEN)


def catalogue(durations_s: Sequence[float] = (), encoder_digit: float = 0.0) -> dict[str, Effect]:
    """
    Return the catalogue of the drive, by id.

    durations_s : of the tests, in each of which a gust has a course of its own [s]
    encoder_digit : digit that the encoder's readings tell [rad]; 0 if they tell none
    """
    into = _Catalogue()
    for component, motors in MOTORS.items():
        _friction_effects(into, component, motors)
        _motor_effects(into, component, motors)
    for m in (1, 2):
        _gearbox_effects(into, m)
    _share_effects(into)
    _axis_effects(into)
    _sensor_effects(into, encoder_digit)
    into.add('axis', 'wind_gust', 'gusts on the dish, other ones in each test',
             'both currents vary with time, by no angle or rate', gust.gust_form(durations_s))
    into.add('loop', 'delay', 'a computer or a network in the command or in the rate loop',
             'everything comes late, or the rate loop rings',
             _one('time', 's', 0.0, 0.2, 5e-4, add('test_signal.delay'), healthy=5e-4,
                  form='of the command'),
             _one('error_time', 's', 0.0, 0.05, 2e-4,
                  add('motor_1.amplifier.delay', 'motor_2.amplifier.delay'), healthy=2e-4,
                  form='of the rate error'))
    return dict(into)
