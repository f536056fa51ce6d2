# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue: every effect that the drive may have and its model lacks, each at its neutral value.

An effect has a tolerance (`healthy`): a size that a machine in good order may have. Where the test
sheet or the configuration gives a tolerance for the same number, the larger of the two counts.

A new effect takes one term in `physics` (with a neutral default in `parameters.sets`), one entry
here with its numbers and what they do (see `modifiers`), and its words in `words.yaml`.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from antenna_drive.diagnosis.modifiers import (
    add, AntennaParameter, KnownModifiers, Modifier, RecorderError, Rounding, scale, set_to,
    WaveShape,
)
from antenna_drive.diagnosis.waves import likely_orders, Wave, wave
from antenna_drive.diagnosis.words import row_of
from antenna_drive.readings import NAMED
from simgap.machine.contract import Catalogue, Effect, Experiment, FloatArray, Form

# The motors of an effect, for one motor or both.
MOTORS: Mapping[str, tuple[str, ...]] = {
    'motor_1': ('motor_1',), 'motor_2': ('motor_2',), 'motors': ('motor_1', 'motor_2'),
}
# Cycles per revolution, and frequencies of an additional mode [Hz], that are looked for.
MOTOR_ORDERS = tuple(float(k) for k in range(1, 49))
_RAIL_ORDERS = tuple(20.0 * 1.03 ** k for k in range(200))
_ENCODER_ORDERS = tuple(20.0 * 1.01 ** k for k in range(830))
EXTRA_MODES = tuple(0.6 * 1.14 ** k for k in range(23))
# The mode of that effect: the record has room for it, the configuration does not have it.
EXTRA_MODE = 3
# Orders that are tried of each wave.
_ORDERS = 3
# The form of a quantisation whose digit the readings tell.
DIGITS_SEEN = 'digits seen'


def _effect(component: str, name: str, *forms: Form | AntennaParameter,
            simpler: str = '') -> Effect:
    """Return an effect, whose id its numbers get before their names; one alone is a form."""
    key, words = f'{component}.{name}', row_of(component, name)
    whole = [Form('', (form,)) if isinstance(form, AntennaParameter) else form for form in forms]
    named = (replace(form, parameters=tuple(
        replace(p, name=f'{key}.{p.name}') for p in form.parameters)) for form in whole)
    parts = tuple(f'{motor}.{name}' for motor in MOTORS['motors']) * (component == 'motors')
    return Effect(key, component, words['cause'], tuple(named), parts,
                  (f'{component}.{simpler}',) * bool(simpler))


def _number(name: str, unit: str, low: float, high: float, step: float, modifier: Modifier,
            start: float = 0.0, healthy: float = 0.0) -> AntennaParameter:
    """Return a number of an effect; one with a start is a shape."""
    return AntennaParameter(name, unit, low, high, step, start=start, is_shape=start != 0.0,
                            modifier=modifier, tolerance=healthy)


def _share(low: float, high: float, *fields: str, name: str = 'change', step: float = 5e-3,
           healthy: float = 0.0) -> AntennaParameter:
    """Return a number that scales fields of the configuration by 1 + its value."""
    return _number(name, '1', low, high, step, scale(*fields), healthy=healthy)


def _fields(owners: Sequence[str], *names: str) -> list[str]:
    """Return the dotted names of fields that all of the owners have."""
    return [f'{owner}.{name}' for name in names for owner in owners]


def _viscous(high: float, step: float, healthy: float, owners: Sequence[str]) -> Form:
    """Return viscous friction; grease thins as it is sheared, windage grows with the square."""
    return Form('', (
        _number('torque_per_rate', 'N m s/rad', 0.0, high, step,
                add(*_fields(owners, 'viscous_friction')), healthy=healthy),
        _number('flow_index', '1', 0.5, 2.0, 0.02, set_to(*_fields(owners, 'flow_index')), 1.0)))


def _stribeck(high: float, step: float, healthy: float, rates: tuple[float, float],
              starts: Sequence[float], owners: Sequence[str]) -> tuple[Form, ...]:
    """Return Stribeck friction within some rates [rad/s], in forms that start at several."""
    at = partial(_fields, owners)
    return tuple(Form(f'from {start:g} rad/s', (
        _number('torque', 'N m', 0.0, high, step, add(*at('stribeck_torque')), healthy=healthy),
        _number('rate', 'rad/s', *rates, 0.02 * start, set_to(*at('stribeck_rate')), start),
        _number('shape', '1', 0.3, 2.5, 0.05, set_to(*at('stribeck_shape')), 1.0),
    )) for start in starts)


def _rotor_effects(component: str, owners: Sequence[str]) -> Iterator[Effect]:
    at = partial(_fields, owners)
    yield _effect(component, 'viscous_friction', _viscous(0.5, 2e-3, 1e-3, owners))
    yield _effect(component, 'stribeck_friction', *_stribeck(
        20.0, 0.05, 0.05, (0.02, 40.0), (0.5, 2.0, 8.0), owners), simpler='coulomb_friction')
    yield _effect(component, 'coulomb_friction', _number(
        'torque', 'article A', -0.069, 3.0, 0.01, add(*at('coulomb_torque')), healthy=2e-3))
    yield _effect(component, 'friction_asymmetry', _number(
        'share', '1', -8.0, 8.0, 0.05, add(*at('friction_asymmetry')), healthy=0.05))
    yield _effect(component, 'load_dependent_friction', _number(
        'share', '1', 0.0, 0.6, 5e-3, add(*at('load_dependent_friction')), healthy=5e-3))
    yield _effect(component, 'torque_ripple', wave(
        'N m', 10.0, 0.02, WaveShape('torque_ripple', tuple(owners), owners[0].partition('.')[0]),
        MOTOR_ORDERS, healthy=0.02))


def _amplifier_effects(component: str, motors: Sequence[str]) -> Iterator[Effect]:
    at = partial(_fields, motors)
    torque, back_emf = 'motor.torque_constant', 'armature.back_emf_share'
    # nobody knows whether the amplifier was trimmed to the motor as it is or as it should be
    yield _effect(component, 'torque_constant', *(
        Form(form, (_share(-0.6, 0.6, *at(*fields), name=name),)) for form, name, *fields in (
            ('torque and back-EMF', 'change', torque, back_emf),
            ('torque and back-EMF, the limiter trimmed to it', 'trimmed_change', torque,
             'armature.back_emf_constant'),
            ('torque alone', 'torque_change', torque))))
    yield _effect(component, 'armature_resistance', Form('of the winding', (_number(
        'change', 'ohm', -0.4, 3.0, 4e-3, add(*at('armature.resistance_change'))),
    )), Form('of the winding, the amplifier trimmed to it', (_share(
        -0.8, 3.0, *at('armature.resistance'), name='trimmed_change', healthy=0.02),)))
    yield _effect(component, 'amplifier_gain', _share(-0.8, 1.5, *at('amplifier.rate_gain')))
    yield _effect(component, 'amplifier_offset', _number(
        'offset', 'V', -0.5, 0.5, 5e-4, add(*at('amplifier.offset'))))
    yield _effect(component, 'amplifier_dead_zone', Form('in front of amplifier 1', (_number(
        'half_width', 'V', 0.0, 0.5, 1e-3, add(*at('amplifier.dead_zone')), healthy=1e-3),
    )), Form('crossover of amplifier 2', (_number(
        'crossover', 'article A', 0.0, 2.0, 5e-3, add(*at('amplifier.crossover')),
        healthy=0.01),)))
    yield _effect(component, 'current_limit', _share(-0.9, 0.5, *at('motor.current_limit')))


def _gearbox_effects(m: int) -> Iterator[Effect]:
    component, gearbox = f'gearbox_{m}', f'motor_{m}.gearbox'
    angle = set_to(f'{gearbox}.hysteresis_angle')
    yield _effect(component, 'gap', _share(-0.9, 4.0, f'{gearbox}.half_gap'))
    yield _effect(component, 'stiffness', _share(-0.8, 4.0, f'{gearbox}.stiffness'))
    yield _effect(component, 'hysteresis', Form('the same at any load', (
        _number('torque', 'N m', 0.0, 10.0, 0.02, add(f'{gearbox}.hysteresis'), healthy=0.02),
        _number('angle', 'rad', 2e-3, 0.5, 2e-3, angle, 0.03),
    )), Form('a share of the load', (
        _number('share', '1', 0.0, 0.9, 4e-3, add(f'{gearbox}.hysteresis_share'), healthy=5e-3),
        _number('share_angle', 'rad', 2e-3, 0.5, 2e-3, angle, 0.03))))
    yield _effect(component, 'transmission_error', wave(
        'rad', 0.3, 5e-4, WaveShape('transmission_error', (gearbox,), f'motor_{m}'), MOTOR_ORDERS,
        healthy=5e-4))


def _share_effects() -> Iterator[Effect]:
    component = 'torque_share'
    circuit, filter_1 = f'{component}.circuit', f'{component}.filter_1'
    yield _effect(component, 'bias_pot', _share(-0.8, 0.5, f'{circuit}.bias_pot'))
    yield _effect(component, 'fade_out_voltage', _share(-0.6, 0.6, f'{circuit}.fade_out_voltage'))
    speed_of_2, speed_of_3 = (f'{circuit}.s_2', f'{circuit}.k_2'), (f'{circuit}.k_3',)
    yield _effect(component, 'share_filter', *(
        Form(form, (_share(-0.8, 3.0, *fields, name=name),)) for form, name, fields in (
            ('transfer function 3', 'load_rate_change', speed_of_3),
            ('transfer functions 2 and 4', 'share_rate_change', speed_of_2),
            ('all transfer functions', 'rate_change', (*speed_of_2, *speed_of_3)))))
    yield _effect(component, 'filter_1_gain', _share(-0.8, 2.0, f'{filter_1}.gain'))
    yield _effect(component, 'filter_1_pole', _share(-0.8, 3.0, f'{filter_1}.pole'))


def _axis_effects() -> Iterator[Effect]:
    component, axis = 'axis', 'plant.axis'
    yield _effect(component, 'coulomb_friction', _share(-0.9, 3.0, f'{axis}.coulomb_torque'))
    yield _effect(component, 'viscous_friction', _viscous(1e9, 1e5, 2e5, [axis]))
    yield _effect(component, 'stribeck_friction', *_stribeck(
        6e5, 1e3, 3e3, (2e-6, 3e-3), (4e-5, 2e-4, 8e-4), [axis]), simpler='coulomb_friction')
    yield _effect(component, 'position_dependent_friction', wave(
        '1', 0.9, 5e-3, WaveShape('friction_wave', (axis,), 'axis'), _RAIL_ORDERS, healthy=0.01))
    for name, field in (('gravity_imbalance', 'gravity_torque'),
                        ('wind_steady', 'steady_wind_torque')):
        yield _effect(component, name, _number(
            'torque', 'N m', -1e6, 1e6, 500.0, add(f'{axis}.{field}'), healthy=1e3))
    yield _effect(component, 'inertia', _share(-0.6, 2.0, f'{axis}.inertia_hub'))
    for name, field, number, low, high, step in (
            ('mode_frequency', 'mode_frequencies', 'change', -0.5, 0.8, 3e-3),
            ('mode_damping', 'mode_damping_ratios', 'factor', -0.95, 30.0, 0.1)):
        fields = [f'{axis}.{field}.{j}' for j in range(3)]
        yield _effect(component, name, *(
            Form(f'mode {j}', (_share(low, high, path, name=f'{number}_{j}', step=step),))
            for j, path in enumerate(fields, 1)),
            Form('all modes', (_share(low, high, *fields, name=number, step=step),)))
    inertia, frequency, damping = (set_to(f'{axis}.{field}.{EXTRA_MODE}') for field in (
        'mode_inertias', 'mode_frequencies', 'mode_damping_ratios'))
    yield _effect(component, 'extra_mode', *(Form(f'{hertz:.2g} Hz', (
        _number('inertia', 'kg m^2', 0.0, 8e6, 2e4, inertia, healthy=2e4),
        _number('frequency', 'Hz', 0.85 * hertz, 1.18 * hertz, 0.005 * hertz, frequency, hertz),
        _number('damping', '1', 0.0, 0.2, 2e-3, damping, 0.03))) for hertz in EXTRA_MODES))
    yield _effect(component, 'bull_gear_backlash', _number(
        'half_gap', 'rad', -0.1, 0.6, 1e-3, add(*_fields(MOTORS['motors'], 'gearbox.half_gap')),
        healthy=3e-3))


def _sensor_effects(encoder_digit: float) -> Iterator[Effect]:
    for m in (1, 2):
        tach, current, motor = f'tach_{m}', f'current_{m}', f'motor_{m}'
        tachometer = f'{motor}.tachometer'
        yield _effect(tach, 'gain', _number(
            'change', '1', -0.3, 0.3, 5e-4, add(f'{tachometer}.gain'), healthy=3e-3))
        yield _effect(tach, 'offset', _number(
            'offset', 'rad/s', -5.0, 5.0, 0.02, add(f'{tachometer}.offset')))
        yield _effect(tach, 'ripple', wave(
            '1', 0.3, 2e-4, WaveShape('ripple', (tachometer,), motor), MOTOR_ORDERS, healthy=1e-3))
        yield _effect(current, 'gain', _recorder_gain(current))
        yield _effect(current, 'offset', _number(
            'offset', 'article A', -1.0, 1.0, 1e-3,
            RecorderError('zero', current, (f'{motor}.ammeter.offset',)), healthy=0.02))
    yield _effect('encoder', 'quantisation', _quantisation(encoder_digit))
    yield _effect('encoder', 'cyclic_error', wave(
        'rad', 1e-3, 1e-6, WaveShape('cyclic_error', ('plant.encoder',), 'axis'), _ENCODER_ORDERS,
        on_readings=True, healthy=2e-6), simpler='offset')
    yield _effect('encoder', 'offset', _number(
        'offset', 'rad', -0.1, 0.1, 1e-6,
        RecorderError('zero', 'encoder', ('plant.encoder.offset',)), healthy=2e-5))
    yield _effect('bias_voltage', 'gain', _recorder_gain('bias_voltage'))


def _recorder_gain(reading: str) -> AntennaParameter:
    return _number('change', '1', -0.5, 0.5, 1e-3,
                   RecorderError('gain', reading, (NAMED[reading].gain,)))


def _quantisation(digit: float) -> Form | AntennaParameter:
    """
    Return the form of a quantisation, whose digit the readings themselves may tell [rad].

    There is such a digit or there is none: the difference quotient reaches from one to the other.
    """
    digits = Rounding('digit', ('plant.encoder.step',))
    if not digit:
        return _number('step', 'rad', 0.0, 1e-2, 1e-5, digits)
    turn = AntennaParameter('turn', '1', -1.0, 1.0, 0.02, is_shape=True, modifier=Rounding('turn'))
    return Form(DIGITS_SEEN, (_number('step', 'rad', 0.0, digit, digit, digits), turn))


def catalogue(encoder_digit: float = 0.0) -> dict[str, Effect]:
    """Return the catalogue, by id; the encoder's readings tell a digit [rad], or 0 for none."""
    found: list[Effect] = []
    for component, motors in MOTORS.items():
        found += _rotor_effects(component, _fields(motors, 'motor'))
        found += _amplifier_effects(component, motors)
    for m in (1, 2):
        found += _gearbox_effects(m)
    found += (*_share_effects(), *_axis_effects(), *_sensor_effects(encoder_digit))
    delay = _number('time', 's', 0.0, 0.2, 5e-4, add('test_signal.delay'), healthy=5e-4)
    later = _number('error_time', 's', 0.0, 0.05, 2e-4,
                    add(*_fields(MOTORS['motors'], 'amplifier.delay')), healthy=2e-4)
    found.append(_effect('loop', 'delay', Form('of the command', (delay,)),
                         Form('of the rate error', (later,))))
    return {effect.id: effect for effect in found}


class AntennaCatalogue(Catalogue):
    """
    The effects of the antenna drive, and the orders of its waves.

    What their parameters do is registered in `modifiers`, which grows as orders are chosen.
    """

    def __init__(self, effects: Iterable[Effect], modifiers: KnownModifiers) -> None:
        super().__init__(effects)
        self._modifiers = modifiers
        modifiers.register(p for effect in self.values() for form in effect.forms
                           for p in form.parameters)

    def forms(self, effect: Effect, experiments: Sequence[Experiment],
              residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return an effect's forms; those of a wave with its likeliest orders."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return [self.wave_at(form, order) for order in likely_orders(
                form, experiments, residuals, _ORDERS)]
        return effect.forms

    def typical_form(self, effect: Effect) -> Form:
        """Return the first form of an effect; of a wave, one of a middle order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self.wave_at(form, form.orders[min(11, len(form.orders) - 1)])
        return form

    def form_named(self, effect: Effect, name: str) -> Form:
        """Return the form of an effect by its name; that of a wave says its order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self.wave_at(form, form.order_of(name))
        if name == DIGITS_SEEN:
            return form  # a planned test has no readings to see digits in: it is rounded
        return super().form_named(effect, name)

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        if not isinstance(form, Wave):
            return part.forms[effect.forms.index(form)]
        same = part.forms[0]
        assert isinstance(same, Wave)
        return self.wave_at(same, form.shape.order)

    def wave_at(self, form: Wave, order: float) -> Wave:
        """Return the form of a wave of one order, whose parameters then are known."""
        chosen = form.at(order)
        self._modifiers.register(chosen.parameters)
        return chosen
