# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The effects of a position-controlled servo beyond Coulomb and viscous friction.

`NUMBERS` gives the range of every parameter of the servo and the start of a fit; `catalogue`
combines parameters to effects. A diagnosis starts with a model that has none of them. A new effect
needs a term in physics.py, and a parameter and an effect here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
import math
from types import MappingProxyType
from typing import Final

from lab.servo.physics import ORDER, UNITS
import numpy as np
from simgap.machine.contract import Effect, FloatArray, Form, Parameter

# A parameter's name may end in '@N': a wave of N cycles per turn of the output shaft.
CYCLES_MARK: Final = '@'
# Eccentric wheels cause a few cycles per turn, the teeth of the last stage dozens.
CYCLES: Final = (1, 2, *range(8, 41, 2))


@dataclass(frozen=True)
class Bounds:
    """The range of a parameter of the servo."""

    low: float                  # hard bound
    high: float                 # hard bound
    start: float                # initial value of a global fit
    step: float                 # of difference quotients; relative for a logarithmic parameter
    logarithmic: bool = False   # only the order of magnitude is known beforehand
    shape: bool = False         # without meaning while its effect is absent

    def share(self, value: float) -> float:
        """Return the share of the range at a value, 0 to 1."""
        value = min(max(value, self.low), self.high)
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def value(self, share: float) -> float:
        """Return the value at a share of the range, 0 to 1."""
        share = min(max(share, 0.0), 1.0)
        if self.logarithmic:
            return self.low * (self.high / self.low) ** share
        return self.low + share * (self.high - self.low)


# Parameters of the initial model; none of them is known beforehand.
BASE: Final = ('torque_constant', 'resistance', 'armature_inertia', 'coulomb_torque',
               'viscous_friction')
# One parameter for several: friction that does not depend on whether motor or load drives.
TIED: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType({
    'load_friction': ('load_friction_motor', 'load_friction_external'),
    'load_stribeck': ('load_stribeck_motor', 'load_stribeck_external'),
})
NUMBERS: Final[Mapping[str, Bounds]] = MappingProxyType({
    'torque_constant': Bounds(0.05, 3.0, 0.3, 0.002, logarithmic=True),
    'resistance': Bounds(0.3, 15.0, 2.0, 0.002, logarithmic=True),
    'armature_inertia': Bounds(1e-4, 0.05, 2.5e-3, 0.005, logarithmic=True),
    'coulomb_torque': Bounds(1e-4, 0.3, 0.02, 0.005, logarithmic=True),
    'viscous_friction': Bounds(1e-5, 0.3, 0.01, 0.005, logarithmic=True),
    'stribeck_torque': Bounds(0.0, 0.2, 0.01, 5e-4),
    'stribeck_rate': Bounds(0.02, 5.0, 0.5, 0.02, logarithmic=True, shape=True),
    'stribeck_shape': Bounds(0.5, 4.0, 1.35, 0.02, shape=True),
    'load_friction': Bounds(0.0, 0.6, 0.1, 2e-3),
    'load_friction_motor': Bounds(0.0, 0.6, 0.1, 2e-3),
    'load_friction_external': Bounds(0.0, 0.6, 0.1, 2e-3),
    'load_stribeck': Bounds(0.0, 1.0, 0.05, 2e-3),
    'load_stribeck_motor': Bounds(0.0, 1.0, 0.05, 2e-3),
    'load_stribeck_external': Bounds(0.0, 1.0, 0.05, 2e-3),
    'load_quadratic_motor': Bounds(0.0, 1.0, 0.02, 4e-3),
    'load_quadratic_external': Bounds(0.0, 1.0, 0.02, 4e-3),
    'load_square': Bounds(0.0, 1.5, 0.05, 4e-3),
    'load_square_stribeck': Bounds(0.0, 1.5, 0.05, 4e-3),
    'ageing': Bounds(0.0, 0.15, 0.02, 2e-3),
    'friction_asymmetry': Bounds(-0.5, 0.5, 0.0, 0.01),
    'viscous_quadratic': Bounds(0.0, 0.01, 2e-4, 5e-5),
    'viscous_thinning': Bounds(0.0, 3.0, 0.1, 0.01),
    'friction_temperature': Bounds(-0.03, 0.03, 0.0, 5e-4),
    'friction_cosine': Bounds(-0.3, 0.3, 0.0, 5e-3),
    'friction_sine': Bounds(-0.3, 0.3, 0.0, 5e-3),
    'ripple_cosine': Bounds(-0.03, 0.03, 0.0, 5e-4),
    'ripple_sine': Bounds(-0.03, 0.03, 0.0, 5e-4),
    'backlash': Bounds(0.0, 0.02, 3e-3, 5e-4),
    'compliance': Bounds(0.0, 0.1, 0.01, 1e-3),
    'saturation': Bounds(0.0, 0.3, 0.02, 2e-3),
    'current_limit': Bounds(0.0, 1.0, 0.2, 5e-3),
    'winding_temperature': Bounds(0.0, 6e-3, 0.0, 2e-4),
    'coasting': Bounds(0.0, 1.0, 0.1, 0.01),
    'bridge_drop': Bounds(0.0, 2.0, 0.05, 5e-3),
    'braking': Bounds(0.0, 1.0, 0.02, 5e-3),
    'supply_resistance': Bounds(0.0, 0.5, 0.05, 5e-3),
    'gain_error': Bounds(-0.1, 0.1, 0.0, 2e-3),
    'derivative_gain': Bounds(0.0, 0.02, 0.0, 2e-4),
    'dead_band': Bounds(0.0, 0.05, 2e-3, 5e-4),
    'duty_limit': Bounds(0.0, 0.6, 0.02, 5e-3),
    'goal_slowness': Bounds(0.0, 2.0, 0.05, 5e-3),
    'delay': Bounds(-6e-3, 0.05, 3e-3, 5e-4),
    'position_offset': Bounds(-0.1, 0.1, 0.0, 1e-3),
    'eccentricity_cosine': Bounds(-0.03, 0.03, 0.0, 1e-3),
    'eccentricity_sine': Bounds(-0.03, 0.03, 0.0, 1e-3),
    'load_moment': Bounds(-0.15, 0.15, 0.0, 5e-3),
})


def base_name(name: str) -> str:
    """Return a parameter's name without the cycles of its wave."""
    return name.partition(CYCLES_MARK)[0]


def number(name: str) -> Bounds:
    """Return the range of a parameter; its name may have cycles."""
    return NUMBERS[base_name(name)]


def unit(name: str) -> str:
    """Return a parameter's unit."""
    name = base_name(name)
    return UNITS[TIED[name][0] if name in TIED else name]


def vector(values: Mapping[str, float]) -> FloatArray:
    """
    Return the parameters in the order of the physics, zero where none is given.

    Values are by name in the units of `UNITS`; tied names and cycles are resolved. KeyError if
    unknown.
    """
    row = np.zeros(len(ORDER))
    for name, rest in (('stribeck_rate', 1.0), ('stribeck_shape', 1.0)):
        row[_INDEX[name]] = rest  # divisors, which must not be zero
    for name, value in values.items():
        plain, _, cycles = name.partition(CYCLES_MARK)
        for target in TIED.get(plain, (plain,)):
            row[_INDEX[target]] = value
        if cycles:
            row[_INDEX[plain.partition('_')[0] + '_cycles']] = float(cycles)
    return row


_INDEX: Final = {name: i for i, name in enumerate(ORDER)}


def parameter(name: str) -> Parameter:
    """Return a parameter of an absent effect, at zero or at the start of a shape."""
    item = number(name)
    return Parameter(name, unit(name), item.low, item.high, item.step,
                     start=item.start if item.shape else 0.0, is_shape=item.shape)


def _form(name: str, *numbers: str) -> Form:
    return Form(name, tuple(parameter(item) for item in numbers))


def _waves(kind: str) -> tuple[Form, ...]:
    return tuple(replace(_form(f'{cycles} cycles', f'{kind}_cosine@{cycles}',
                               f'{kind}_sine@{cycles}'), scanned=True) for cycles in CYCLES)


def catalogue(without: Iterable[str] = ()) -> dict[str, Effect]:
    """Return the effects by id, except those in `without`; KeyError where one does not exist."""
    effects = {effect.id: effect for effect in _EFFECTS}
    for name in without:
        del effects[name]
    return effects


def _effect(name: str, cause: str, *forms: Form) -> Effect:
    return Effect(name, name.partition('.')[0], cause, forms)


_EFFECTS: Final = (
    _effect('motor.saturation',
            'at a large current the iron saturates or the brushes heat up: less torque per ampere',
            _form('i / (1 + s |i|)', 'saturation')),
    _effect('motor.winding_temperature',
            "copper's resistance grows with its temperature",
            _form('linear', 'winding_temperature')),
    _effect('motor.torque_ripple',
            'slots and commutation, or gravity of an eccentric wheel, add a torque by angle',
            *_waves('ripple')),
    _effect('bridge.coasting',
            'between pulses the bridge lets the current decay instead of braking',
            _form('share', 'coasting')),
    _effect('bridge.dead_zone',
            'brushes, transistors and dead time take a voltage against the current',
            _form('voltage', 'bridge_drop')),
    _effect('bridge.braking',
            'a servo without torque may short its windings instead of opening them',
            _form('share', 'braking')),
    _effect('bridge.current_limit',
            'the bridge or the firmware cuts the current',
            _form('limit, as 1/A', 'current_limit')),
    _effect('supply.internal_resistance',
            'supply, cable and plugs have a resistance',
            _form('resistance', 'supply_resistance')),
    _effect('controller.delay',
            'bus and firmware take time before a goal acts',
            _form('time', 'delay')),
    _effect('controller.gain',
            "the firmware's unit of the position gain differs",
            _form('share', 'gain_error')),
    _effect('controller.derivative_gain',
            'the firmware has a derivative gain, or filters the position',
            _form('time', 'derivative_gain')),
    _effect('controller.dead_band',
            'the firmware ignores a small position error',
            _form('width', 'dead_band')),
    _effect('controller.duty_limit',
            'the firmware allows less than the full duty',
            _form('share', 'duty_limit')),
    _effect('controller.goal_slew',
            'the firmware limits the rate of the goal',
            _form('time per angle', 'goal_slowness')),
    _effect('gearbox.stribeck_friction',
            'the grease film carries load only while the teeth move',
            _form('Stribeck', 'stribeck_torque', 'stribeck_rate', 'stribeck_shape')),
    _effect('gearbox.load_dependent_friction',
            'teeth and bearings rub in proportion to what they carry',
            _form('alike', 'load_friction'),
            _form('by direction', 'load_friction_motor', 'load_friction_external')),
    _effect('gearbox.load_dependent_stribeck',
            'under load the grease film breaks down at low rates',
            _form('alike', 'load_stribeck', 'stribeck_rate', 'stribeck_shape'),
            _form('by direction', 'load_stribeck_motor', 'load_stribeck_external',
                  'stribeck_rate', 'stribeck_shape')),
    _effect('gearbox.quadratic_load_friction',
            'wheels and shafts bend under load and touch elsewhere',
            _form('square', 'load_square'),
            _form('square, at rest', 'load_square_stribeck', 'stribeck_rate', 'stribeck_shape'),
            _form('by direction, at rest', 'load_quadratic_motor', 'load_quadratic_external',
                  'stribeck_rate', 'stribeck_shape')),
    _effect('gearbox.stiction_ageing',
            'contacts creep while they are at rest',
            _form('logarithm of time', 'ageing')),
    _effect('gearbox.friction_asymmetry',
            'the two flanks of the teeth differ',
            _form('share', 'friction_asymmetry')),
    _effect('gearbox.viscous_nonlinearity',
            'grease thins under shear, or churns at high rates',
            _form('quadratic', 'viscous_quadratic'),
            _form('thinning', 'viscous_thinning')),
    _effect('gearbox.friction_temperature',
            'warm grease is thinner',
            _form('linear', 'friction_temperature')),
    _effect('gearbox.position_dependent_friction',
            'wheels are eccentric, and the meshing varies from tooth to tooth',
            *_waves('friction')),
    _effect('gearbox.backlash',
            'there is a gap between the teeth',
            _form('gap', 'backlash')),
    _effect('gearbox.elasticity',
            'wheels, shafts and the horn twist',
            _form('compliance', 'compliance')),
    _effect('encoder.offset',
            'the horn is mounted off the zero of the encoder',
            _form('angle', 'position_offset')),
    _effect('encoder.eccentricity',
            "the encoder's magnet is mounted off the axis",
            _form('once a turn', 'eccentricity_cosine', 'eccentricity_sine')),
    _effect('load.moment',
            'the arm, screws or horn have mass too, or the arm is longer',
            _form('share', 'load_moment')),
)
