# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The typed parameter sets of the drive: what each parameter is, its unit and what is allowed.

Values come from config/. A parameter with a default here is the term of an effect that the
article's model does not have: its default is neutral, and the physics is then the article's.
Letters in [ ] are the symbols of docs/model.md. Currents are in article amperes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass, replace
import math
from typing import Any, TypeVar

from antenna_drive.parameters.declaring import Choice, effect, given, option
from antenna_drive.parameters.waveforms import TestSignal
from simgap.inputs.schema import Entry, Value

Set = TypeVar('Set')

# The greatest number of flexible modes that a set can hold.
MODES_LIMIT = 6

BIAS_SOURCES = ('circuit', 'fixed')
SHARE_STARTS = ('zero', 'steady')

_PHASE = ('rad', -2.0 * math.pi, 2.0 * math.pi)

# A learnt function has so many values, at even distances from -reach to reach.
LAW_PLACES = 13


def _law(description: str, unit: str = 'N m') -> Any:
    """Declare the values of a learnt function."""
    return option((0.0,) * LAW_PLACES, Entry(
        unit, -1e8, 1e8, description, lengths=(LAW_PLACES, LAW_PLACES)))


@dataclass(frozen=True, kw_only=True)
class RateCommand:
    """Transfer function 1, Table 1."""

    k_s: float = given('1', 0.01, 10.0, 'scale of the rate command')
    k_1: float = given('V s/rad', 1.0, 1e5, 'volts per axis rate')
    tau_1: float = given('s', 1e-4, 10.0, 'time constant')


@dataclass(frozen=True, kw_only=True)
class Amplifier:
    """Amplifiers 1 and 2 of Fig. 6."""

    rate_gain: float = given('article A/V', 1e-3, 1e3, 'proportional gain of amplifier 1 [k_r]')
    integral_time: float = given('s', 1e-3, 100.0, 'integral time of amplifier 1 [T_2]')
    lag: float = given('s', 1e-4, 10.0, 'lag behind amplifier 1 [T_a]')
    current_feedback_gain: float = given('ohm', 0.0, 1e3, 'current feedback of amplifier 2 [G_a]')
    tach_gain: float = given('V s/rad', 1e-6, 10.0, 'volts per tachometer rate [k_t]')
    bias_command_gain: float = given(
        '1', 0.0, 10.0, 'share of the counter torque that reaches amplifier 1 [s_F]')
    offset: float = effect(0.0, 'V', -1.0, 1.0, 'offset at the input of amplifier 1')
    crossover: float = effect(
        0.0, 'article A', 0.0, 10.0, 'demand that the crossover of amplifier 2 swallows')
    forward_gain_share: float = effect(
        1.0, '1', 0.1, 10.0, 'gain of amplifier 2 as a share of R + G_a')
    dead_zone: float = effect(
        0.0, 'V', 0.0, 1.0, 'half the width within which amplifier 1 does not answer')
    delay: float = effect(
        0.0, 's', 0.0, 0.1, 'time by which the rate error comes late, to first order')
    learnt: float = effect(0.0, '1', 0.0, 1.0, 'share of the learnt function that acts')
    current_by_demand: tuple[float, ...] = _law('further current, by demand', 'article A')
    current_by_demand_reach: float = effect(1.0, 'article A', 1e-9, 1e4, 'of its last value')


@dataclass(frozen=True, kw_only=True)
class Armature:
    """The motor's armature, Fig. 6."""

    resistance: float = given('ohm', 1e-3, 1e3, 'armature resistance [R]')
    inductance: float = given('H', 1e-5, 10.0, 'armature inductance [L]')
    back_emf_constant: float = given('V s/rad', 1e-4, 1e3, 'back-EMF constant [k_b]')
    physical_amperes_per_article_ampere: float = given(
        '1', 0.1, 100.0, 'real amperes in one article ampere [kappa]')
    voltage_limit: float = given('V', 1.0, 1e4, 'greatest armature voltage [V_max]')
    back_emf_share: float = effect(
        1.0, '1', 0.1, 10.0, "back-EMF as a share of what the amplifier's limiter is made for")
    resistance_change: float = effect(
        0.0, 'ohm', -1e3, 1e3, 'resistance beyond the one that amplifier 2 is made for')


@dataclass(frozen=True, kw_only=True)
class Motor:
    """The motor's mechanics, Fig. 7."""

    torque_constant: float = given('N m/article A', 1e-3, 1e3, 'torque per article ampere [k_m]')
    friction_torque_per_ampere: float = given(
        'N m/article A', 1e-3, 1e3, 'what one article ampere of friction counts as a torque')
    current_limit: float = given('article A', 1e-2, 1e3, 'greatest current [i_max]')
    rotor_inertia: float = given('kg m^2', 1e-6, 1e3, 'rotor inertia [J_m]')
    coulomb_torque: float = given('article A', 0.0, 100.0, 'Coulomb friction of the motor [T_c]')
    stiction_ratio: float = given('1', 1.0, 5.0, 'stiction over Coulomb friction, Eq. (4)')
    velocity_threshold: float = given(
        'rad/s', 0.0, 1.0, 'rate below which friction can stop the rotor [v_t]')
    viscous_friction: float = effect(
        0.0, 'N m s/rad', 0.0, 1.0, 'friction torque per rate, at viscous_rate')
    viscous_rate: float = effect(
        10.0, 'rad/s', 1e-3, 1e3, 'rate at which the flow index makes no difference')
    flow_index: float = effect(
        1.0, '1', 0.1, 3.0, 'exponent of the rate in viscous friction: below 1 it thins')
    stribeck_torque: float = effect(
        0.0, 'N m', 0.0, 10.0, 'friction above the Coulomb level at creep')
    stribeck_rate: float = effect(
        5.0, 'rad/s', 1e-3, 1e3, 'rate at which the Stribeck torque has fallen to 1/e')
    stribeck_shape: float = effect(
        2.0, '1', 0.1, 4.0, 'exponent of the rate in the fall of the Stribeck torque')
    friction_asymmetry: float = effect(
        0.0, '1', -0.9, 0.9, 'share by which forward friction exceeds the mean of both ways')
    load_dependent_friction: float = effect(0.0, '1', 0.0, 0.5, 'friction torque per gear torque')
    torque_ripple: float = effect(0.0, 'N m', 0.0, 20.0, 'amplitude of the torque ripple')
    torque_ripple_cycles: float = effect(
        12.0, '1', 0.1, 200.0, 'cycles of the torque ripple per motor revolution')
    torque_ripple_phase: float = effect(0.0, *_PHASE, 'phase of the torque ripple')
    torque_ripple_second: float = effect(0.0, 'N m', 0.0, 20.0, 'amplitude of its second harmonic')
    torque_ripple_second_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    torque_ripple_third: float = effect(0.0, 'N m', 0.0, 20.0, 'amplitude of its third harmonic')
    torque_ripple_third_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    learnt: float = effect(0.0, '1', 0.0, 1.0, 'share of the learnt functions that acts')
    friction_by_rate: tuple[float, ...] = _law('further friction, by rate')
    friction_by_rate_reach: float = effect(1.0, 'rad/s', 1e-9, 1e4, 'rate of its last value')
    friction_by_load: tuple[float, ...] = _law('further friction, by gear torque')
    friction_by_load_reach: float = effect(1.0, 'N m', 1e-9, 1e4, 'torque of its last value')
    torque_by_current: tuple[float, ...] = _law('further torque, by current')
    torque_by_current_reach: float = effect(1.0, 'article A', 1e-9, 1e4, 'of its last value')


@dataclass(frozen=True, kw_only=True)
class Gearbox:
    """The gearbox with backlash, Eq. (1), referred to the motor shaft."""

    stiffness: float = given('N m/rad', 1e-3, 1e6, 'torsional stiffness [k_g]')
    half_gap: float = given('rad', 0.0, 10.0, 'half the backlash gap [b]')
    contact_damping: float = given('N m s/rad', 0.0, 1e3, 'damping of the touching flanks [d_g]')
    hysteresis: float = effect(0.0, 'N m', 0.0, 20.0, 'torque of the internal friction')
    hysteresis_share: float = effect(
        0.0, '1', 0.0, 0.9, 'internal friction as a share of the elastic torque')
    hysteresis_angle: float = effect(
        0.02, 'rad', 1e-4, 1.0, 'wind-up over which the internal friction builds up')
    transmission_error: float = effect(0.0, 'rad', 0.0, 1.0, 'amplitude of the transmission error')
    transmission_error_cycles: float = effect(
        1.0, '1', 0.001, 200.0, 'cycles of the transmission error per motor revolution')
    transmission_error_phase: float = effect(0.0, *_PHASE, 'phase of the transmission error')
    transmission_error_second: float = effect(0.0, 'rad', 0.0, 1.0, 'its second harmonic')
    transmission_error_second_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    transmission_error_third: float = effect(0.0, 'rad', 0.0, 1.0, 'its third harmonic')
    transmission_error_third_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    learnt: float = effect(0.0, '1', 0.0, 1.0, 'share of the learnt function that acts')
    torque_by_load: tuple[float, ...] = _law('further torque of teeth, by what they carry')
    torque_by_load_reach: float = effect(1.0, 'N m', 1e-9, 1e4, 'torque of its last value')


@dataclass(frozen=True, kw_only=True)
class Tachometer:
    """The motor's tachometer; amplifier 1 sees its errors."""

    gain: float = effect(1.0, '1', 0.1, 10.0, 'reading per rate')
    offset: float = effect(0.0, 'rad/s', -10.0, 10.0, 'reading at standstill')
    ripple: float = effect(0.0, '1', 0.0, 1.0, 'amplitude of the ripple, as a share of the rate')
    ripple_cycles: float = effect(1.0, '1', 0.1, 200.0, 'cycles of the ripple per revolution')
    ripple_phase: float = effect(0.0, *_PHASE, 'phase of the ripple')
    ripple_second: float = effect(0.0, '1', 0.0, 1.0, 'amplitude of its second harmonic')
    ripple_second_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    ripple_third: float = effect(0.0, '1', 0.0, 1.0, 'amplitude of its third harmonic')
    ripple_third_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')


@dataclass(frozen=True, kw_only=True)
class Ammeter:
    """The reading of the motor current; no loop sees its errors."""

    gain: float = effect(1.0, '1', 0.1, 10.0, 'reading per current')
    offset: float = effect(0.0, 'article A', -10.0, 10.0, 'reading at no current')


@dataclass(frozen=True, kw_only=True)
class MotorDrive:
    """One motor with its amplifiers and its gearbox: G_o of Fig. 6."""

    sign: float = given('1', -1.0, 1.0, 'sign of the counter torque in this motor [s]')
    gear_ratio: float = given('1', 1.0, 1e6, 'motor turns per turn of the axis [N]')
    start_in_gap: float = option(
        0.0, Entry('1', -1.0, 1.0, 'place of the motor in its gap at the start, -1 to 1'))
    rate_command: RateCommand
    amplifier: Amplifier
    armature: Armature
    motor: Motor
    gearbox: Gearbox
    tachometer: Tachometer
    ammeter: Ammeter


@dataclass(frozen=True, kw_only=True)
class Axis:
    """The antenna about one axis: hub, friction and flexible modes."""

    gear_ratio: float = given('1', 1.0, 1e6, 'motor turns per turn of the axis [N]')
    inertia_hub: float = given('kg m^2', 1.0, 1e12, 'inertia of the hub [J_0]')
    mode_inertias: tuple[float, ...] = field(metadata={'entry': Entry(
        'kg m^2', 1e-3, 1e12, 'inertia of each mode [m_j]', lengths=(1, MODES_LIMIT))})
    mode_frequencies: tuple[float, ...] = field(metadata={'entry': Entry(
        'Hz', 1e-3, 100.0, 'frequency of each mode, hub held [omega_j / 2 pi]',
        lengths=(1, MODES_LIMIT))})
    mode_damping_ratios: tuple[float, ...] = field(metadata={'entry': Entry(
        '1', 0.0, 1.0, 'damping ratio of each mode [zeta_j]', lengths=(1, MODES_LIMIT))})
    pointing_elevation: tuple[float, ...] = field(metadata={'entry': Entry(
        '1', -100.0, 100.0, 'elevation error per bend of each mode', lengths=(1, MODES_LIMIT))})
    pointing_cross_elevation: tuple[float, ...] = field(metadata={'entry': Entry(
        '1', -100.0, 100.0, 'cross-elevation error per bend of each mode',
        lengths=(1, MODES_LIMIT))})
    coulomb_torque: float = given(
        'article A', 0.0, 1e3, 'Coulomb friction, as current of both motors together')
    friction_torque_per_ampere: float = given(
        'N m/article A', 1e-3, 1e3, 'what one article ampere of friction counts as a motor torque')
    stiction_ratio: float = given('1', 1.0, 5.0, 'stiction over Coulomb friction, Eq. (4)')
    velocity_threshold: float = given(
        'rad/s', 0.0, 1e-3, 'rate below which friction can stop the axis [v_t]')
    start_elevation: float = option(math.pi / 4, Entry('rad', -0.2, 3.4, 'elevation at the start'))
    viscous_friction: float = effect(
        0.0, 'N m s/rad', 0.0, 1e10, 'friction torque per rate, at viscous_rate')
    viscous_rate: float = effect(
        1e-3, 'rad/s', 1e-7, 1.0, 'rate at which the flow index makes no difference')
    flow_index: float = effect(
        1.0, '1', 0.1, 3.0, 'exponent of the rate in viscous friction: below 1 it thins')
    stribeck_torque: float = effect(
        0.0, 'N m', 0.0, 1e7, 'friction above the Coulomb level at creep')
    stribeck_rate: float = effect(
        1e-4, 'rad/s', 1e-7, 1.0, 'rate at which the Stribeck torque has fallen to 1/e')
    stribeck_shape: float = effect(
        2.0, '1', 0.1, 4.0, 'exponent of the rate in the fall of the Stribeck torque')
    friction_wave: float = effect(
        0.0, '1', 0.0, 0.9, 'share by which friction varies with the angle')
    friction_wave_cycles: float = effect(
        100.0, '1', 0.1, 1e5, 'cycles of that variation per turn of the axis')
    friction_wave_phase: float = effect(0.0, *_PHASE, 'phase of that variation')
    friction_wave_second: float = effect(0.0, '1', 0.0, 0.9, 'amplitude of its second harmonic')
    friction_wave_second_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    friction_wave_third: float = effect(0.0, '1', 0.0, 0.9, 'amplitude of its third harmonic')
    friction_wave_third_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    gravity_torque: float = effect(
        0.0, 'N m', -1e7, 1e7, 'imbalance: torque at zero elevation, pulling down')
    steady_wind_torque: float = effect(0.0, 'N m', -1e7, 1e7, 'torque of a steady wind')
    learnt: float = effect(0.0, '1', 0.0, 1.0, 'share of the learnt functions that acts')
    friction_by_rate: tuple[float, ...] = _law('further friction, by rate')
    friction_by_rate_reach: float = effect(1.0, 'rad/s', 1e-9, 1e4, 'rate of its last value')
    torque_by_angle: tuple[float, ...] = _law('further torque, by angle')
    torque_by_angle_reach: float = effect(1.0, 'rad', 1e-9, 1e4, 'of its last value')
    torque_by_angle_middle: float = effect(0.0, 'rad', -10.0, 10.0, 'angle of its middle value')

    @property
    def mode_inertias_count(self) -> int:
        """Return the number of flexible modes."""
        return len(self.mode_inertias)


@dataclass(frozen=True, kw_only=True)
class Encoder:
    """The reading of the axis angle; no loop sees its errors."""

    offset: float = effect(0.0, 'rad', -1.0, 1.0, 'reading at angle zero')
    step: float = effect(0.0, 'rad', 0.0, 0.1, 'size of one count')
    cyclic_error: float = effect(0.0, 'rad', 0.0, 0.1, 'amplitude of the cyclic error')
    cyclic_error_cycles: float = effect(
        4096.0, '1', 1.0, 1e6, 'cycles of the cyclic error per turn')
    cyclic_error_phase: float = effect(0.0, *_PHASE, 'phase of the cyclic error')
    cyclic_error_second: float = effect(0.0, 'rad', 0.0, 0.1, 'amplitude of its second harmonic')
    cyclic_error_second_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')
    cyclic_error_third: float = effect(0.0, 'rad', 0.0, 0.1, 'amplitude of its third harmonic')
    cyclic_error_third_phase: float = effect(0.0, *_PHASE, 'phase of that harmonic')


@dataclass(frozen=True, kw_only=True)
class Plant:
    """The rate-loop plant: structure, axis friction and encoder, Fig. 4."""

    axis: Axis
    encoder: Encoder


@dataclass(frozen=True, kw_only=True)
class TorqueShare:
    """The torque-share circuit, Fig. 14 and Table 1."""

    bias_pot: float = given('1', 0.0, 1.0, 'bias pot, scales the bias voltage [k_p]', live=True)
    fade_out_voltage: float = given(
        'V', -50.0, 0.0, 'voltage that widens the flat part of the bias [f_o]', live=True)
    current_to_voltage: float = given('V/article A', 1e-3, 100.0, 'volts per current [c_i]')
    saturation_low: float = given('V', -50.0, 50.0, 'lower limit of Eq. (10)')
    saturation_high: float = given('V', -50.0, 50.0, 'upper limit of Eq. (10)')
    k_2: float = given('1/s', -100.0, 0.0, 'gain of transfer function 2')
    s_2: float = given('1/s', 1e-3, 100.0, 'pole of transfer functions 2 and 4')
    k_3: float = given('1/s', 1e-3, 100.0, 'gain and pole of transfer function 3')
    g_4: float = given('1', 0.0, 100.0, 'transfer function 4 over transfer function 2')
    bias_source: Choice = option('circuit', Entry(
        '', description='where the bias voltage comes from', live=True, choices=BIAS_SOURCES))
    fixed_voltage: float = option(0.0, Entry(
        'V', -50.0, 50.0, 'bias voltage of a fixed source', live=True))
    start: Choice = option('zero', Entry(
        '', description='state of the circuit at the start', choices=SHARE_STARTS))
    voltmeter_gain: float = effect(1.0, '1', 0.1, 10.0, 'reading per bias voltage')


@dataclass(frozen=True, kw_only=True)
class Filter1:
    """Filter 1, Eq. (15), as k' / (s + p)."""

    gain: float = given('1/s', 0.0, 1e4, "gain [k']", live=True)
    pole: float = given('1/s', 0.0, 1e3, 'pole [p]', live=True)
    difference_gain: float = given(
        'V/article A', 1e-3, 1e3, 'volts per difference of the currents [k_f]')


@dataclass(frozen=True, kw_only=True)
class Share:
    """The torque-share unit: the circuit with Filter 1 behind it."""

    circuit: TorqueShare
    filter_1: Filter1


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Every parameter of the drive, unit by unit, as the units take them."""

    test_signal: TestSignal
    motor_1: MotorDrive
    motor_2: MotorDrive
    torque_share: Share
    plant: Plant

    @property
    def greatest_rate(self) -> float:
        """Return the rate of the axis at which the back-EMF is all of the voltage [rad/s]."""
        armature = self.motor_1.armature
        return armature.voltage_limit / armature.back_emf_constant / self.motor_1.gear_ratio


def entries(kind: type) -> Iterator[tuple[str, Entry]]:
    """Yield name and entry of each parameter that a set holds itself, not in sets within it."""
    for item in fields(kind):
        if 'entry' in item.metadata:
            yield item.name, item.metadata['entry']


def values(parameters: Any, prefix: str = '') -> Iterator[tuple[str, Entry, Value]]:
    """Yield dotted name, entry and value of each parameter of a set and of the sets within it."""
    for item in fields(parameters):
        value = getattr(parameters, item.name)
        if is_dataclass(value):
            yield from values(value, f'{prefix}{item.name}.')
        elif 'entry' in item.metadata:
            yield f'{prefix}{item.name}', item.metadata['entry'], value


def changed(parameters: Set, changes: dict[str, Any]) -> Set:
    """
    Return the set with the parameters of these dotted names changed; values are not checked.

    Raises AttributeError: a name does not exist.
    """
    for name, value in changes.items():
        head, _, rest = name.partition('.')
        old = getattr(parameters, head)
        new = changed(old, {rest: value}) if rest else value
        parameters = replace(parameters, **{head: new})  # type: ignore[type-var]
    return parameters
