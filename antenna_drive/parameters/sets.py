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
The typed parameter sets of the drive.

sets.yaml says what each parameter is, its unit and what is allowed. Values come from config/. A
parameter with a default here is the term of an effect that the article's model does not have: its
default is neutral, and the physics is then the article's.
Currents are in article amperes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass, replace
import math
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from antenna_drive.parameters.schema import Entry, Value
import yaml

Set = TypeVar('Set')
# A choice is a text in a set; in the set's record it is the text's place among the choices.
Choice = Any

_TABLE: dict[str, dict[str, dict[str, Any]]] = yaml.load(
    Path(__file__).with_suffix('.yaml').read_text(encoding='utf-8'),
    Loader=getattr(yaml, 'CSafeLoader', yaml.SafeLoader))
# The greatest numbers of flexible modes and of sines in a multisine that a set can hold.
MODES_LIMIT: int = _TABLE['Axis']['mode_inertias']['lengths'][1]
SINES_LIMIT: int = _TABLE['Waveform']['frequencies']['lengths'][1]


def _described(kind: type[Set]) -> type[Set]:
    """Give each parameter of a set its entry, which sets.yaml holds under the set's name."""
    for item in fields(kind):  # type: ignore[arg-type]
        row = _TABLE[kind.__name__].get(item.name)
        if row is not None:
            given: dict[str, Any] = {
                key: tuple(value) if isinstance(value, list) else value
                for key, value in row.items()}
            item.metadata = MappingProxyType({'entry': Entry(**given)})
    return kind


@_described
@dataclass(frozen=True, kw_only=True)
class RateCommand:
    """Transfer function 1, Table 1."""

    k_s: float
    k_1: float
    tau_1: float


@_described
@dataclass(frozen=True, kw_only=True)
class Amplifier:
    """Amplifiers 1 and 2 of Fig. 6."""

    rate_gain: float
    integral_time: float
    lag: float
    current_feedback_gain: float
    tach_gain: float
    bias_command_gain: float
    offset: float = 0.0
    crossover: float = 0.0
    forward_gain_share: float = 1.0
    dead_zone: float = 0.0
    delay: float = 0.0


@_described
@dataclass(frozen=True, kw_only=True)
class Armature:
    """The motor's armature, Fig. 6."""

    resistance: float
    inductance: float
    back_emf_constant: float
    physical_amperes_per_article_ampere: float
    voltage_limit: float
    back_emf_share: float = 1.0
    resistance_change: float = 0.0


@_described
@dataclass(frozen=True, kw_only=True)
class Motor:
    """The motor's mechanics, Fig. 7."""

    torque_constant: float
    friction_torque_per_ampere: float
    current_limit: float
    rotor_inertia: float
    coulomb_torque: float
    stiction_ratio: float
    velocity_threshold: float
    viscous_friction: float = 0.0
    viscous_rate: float = 10.0
    flow_index: float = 1.0
    stribeck_torque: float = 0.0
    stribeck_rate: float = 5.0
    stribeck_shape: float = 2.0
    friction_asymmetry: float = 0.0
    load_dependent_friction: float = 0.0
    torque_ripple: float = 0.0
    torque_ripple_cycles: float = 12.0
    torque_ripple_phase: float = 0.0
    torque_ripple_second: float = 0.0
    torque_ripple_second_phase: float = 0.0
    torque_ripple_third: float = 0.0
    torque_ripple_third_phase: float = 0.0


@_described
@dataclass(frozen=True, kw_only=True)
class Gearbox:
    """The gearbox with backlash, Eq. (1), referred to the motor shaft."""

    stiffness: float
    half_gap: float
    contact_damping: float
    hysteresis: float = 0.0
    hysteresis_share: float = 0.0
    hysteresis_angle: float = 0.02
    transmission_error: float = 0.0
    transmission_error_cycles: float = 1.0
    transmission_error_phase: float = 0.0
    transmission_error_second: float = 0.0
    transmission_error_second_phase: float = 0.0
    transmission_error_third: float = 0.0
    transmission_error_third_phase: float = 0.0


@_described
@dataclass(frozen=True, kw_only=True)
class Tachometer:
    """The motor's tachometer; amplifier 1 sees its errors."""

    gain: float = 1.0
    offset: float = 0.0
    ripple: float = 0.0
    ripple_cycles: float = 1.0
    ripple_phase: float = 0.0
    ripple_second: float = 0.0
    ripple_second_phase: float = 0.0
    ripple_third: float = 0.0
    ripple_third_phase: float = 0.0


@_described
@dataclass(frozen=True, kw_only=True)
class Ammeter:
    """The reading of the motor current; no loop sees its errors."""

    gain: float = 1.0
    offset: float = 0.0


@_described
@dataclass(frozen=True, kw_only=True)
class MotorDrive:
    """One motor with its amplifiers and its gearbox: G_o of Fig. 6."""

    sign: float
    gear_ratio: float
    start_in_gap: float = 0.0
    rate_command: RateCommand
    amplifier: Amplifier
    armature: Armature
    motor: Motor
    gearbox: Gearbox
    tachometer: Tachometer
    ammeter: Ammeter


@_described
@dataclass(frozen=True, kw_only=True)
class Axis:
    """The antenna about one axis: hub, friction and flexible modes."""

    gear_ratio: float
    inertia_hub: float
    mode_inertias: tuple[float, ...]
    mode_frequencies: tuple[float, ...]
    mode_damping_ratios: tuple[float, ...]
    pointing_elevation: tuple[float, ...]
    pointing_cross_elevation: tuple[float, ...]
    coulomb_torque: float
    friction_torque_per_ampere: float
    stiction_ratio: float
    velocity_threshold: float
    start_elevation: float = math.pi / 4
    viscous_friction: float = 0.0
    viscous_rate: float = 0.001
    flow_index: float = 1.0
    stribeck_torque: float = 0.0
    stribeck_rate: float = 0.0001
    stribeck_shape: float = 2.0
    friction_wave: float = 0.0
    friction_wave_cycles: float = 100.0
    friction_wave_phase: float = 0.0
    friction_wave_second: float = 0.0
    friction_wave_second_phase: float = 0.0
    friction_wave_third: float = 0.0
    friction_wave_third_phase: float = 0.0
    gravity_torque: float = 0.0
    steady_wind_torque: float = 0.0

    @property
    def mode_inertias_count(self) -> int:
        """Return the number of flexible modes."""
        return len(self.mode_inertias)


@_described
@dataclass(frozen=True, kw_only=True)
class Encoder:
    """The reading of the axis angle; no loop sees its errors."""

    offset: float = 0.0
    step: float = 0.0
    cyclic_error: float = 0.0
    cyclic_error_cycles: float = 4096.0
    cyclic_error_phase: float = 0.0
    cyclic_error_second: float = 0.0
    cyclic_error_second_phase: float = 0.0
    cyclic_error_third: float = 0.0
    cyclic_error_third_phase: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Plant:
    """The rate-loop plant: structure, axis friction and encoder, Fig. 4."""

    axis: Axis
    encoder: Encoder


@_described
@dataclass(frozen=True, kw_only=True)
class TorqueShare:
    """The torque-share circuit, Fig. 14 and Table 1."""

    bias_pot: float
    fade_out_voltage: float
    current_to_voltage: float
    saturation_low: float
    saturation_high: float
    k_2: float
    s_2: float
    k_3: float
    g_4: float
    bias_source: Choice = 'circuit'
    fixed_voltage: float = 0.0
    start: Choice = 'zero'
    voltmeter_gain: float = 1.0


@_described
@dataclass(frozen=True, kw_only=True)
class Filter1:
    """Filter 1, Eq. (15), as k' / (s + p)."""

    gain: float
    pole: float
    difference_gain: float


@dataclass(frozen=True, kw_only=True)
class Share:
    """The torque-share unit: the circuit with Filter 1 behind it."""

    circuit: TorqueShare
    filter_1: Filter1


@_described
@dataclass(frozen=True, kw_only=True)
class Waveform:
    """A test signal over time; amplitude in the unit of what it commands."""

    waveform: Choice = 'zero'
    amplitude: float = 0.0
    offset: float = 0.0
    period: float = 5.0
    phase: float = 0.0
    start_after: float = 0.0
    sweep_from: float = 0.1
    sweep_to: float = 5.0
    sweep_time: float = 30.0
    frequencies: tuple[float, ...] = (0.3, 0.7, 1.5)
    weights: tuple[float, ...] = (0.4, 0.3, 0.3)
    phases: tuple[float, ...] = (0.0, 0.0, 0.0)
    bit_time: float = 0.2
    external: float = 0.0

    @property
    def frequencies_count(self) -> int:
        """Return the number of sines of a multisine."""
        return len(self.frequencies)


@_described
@dataclass(frozen=True, kw_only=True)
class TestSignal:
    """What the drive is commanded: a rate [rad/s], and a torque on the axis [N m]."""

    __test__ = False  # not a test case, whatever its name suggests to pytest

    rate: Waveform = field(default_factory=Waveform)
    torque: Waveform = field(default_factory=Waveform)
    delay: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Every parameter of the drive, unit by unit, as the units take them."""

    test_signal: TestSignal
    motor_1: MotorDrive
    motor_2: MotorDrive
    torque_share: Share
    plant: Plant


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

    Raises
    ------
    AttributeError : a name does not exist

    """
    for name, value in changes.items():
        head, _, rest = name.partition('.')
        old = getattr(parameters, head)
        new = changed(old, {rest: value}) if rest else value
        parameters = replace(parameters, **{head: new})  # type: ignore[type-var]
    return parameters
