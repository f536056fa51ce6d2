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
The catalogue's effects in this program's own forms, with the range of each.

The smallest sizes are just detectable in the standard test programme through noise and
tolerances (docs/trial.md explains the measurement); the largest would call for a repair. A
tachometer is inside the rate loop; errors of current, encoder and bias affect the recording
only.
"""

from __future__ import annotations

from collections.abc import Callable
import math

from antenna_drive.trial.effect import Defect, Parameters, PHASE, Quantity
from antenna_drive.trial.machine import GUST_WAVES, Records
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
MOTORS = {'motor_1': slice(0, 1), 'motor_2': slice(1, 2), 'motors': slice(0, 2)}
Change = Callable[[Records, Parameters], None]


def _factor(low: float, high: float, *, up_only: bool = False) -> Quantity:
    return Quantity('factor', '1', low, high, turned='' if up_only else 'inverse')


def _cycles(low: int, high: int) -> Quantity:
    return Quantity('cycles', '1/rev', low, high, 'whole')


def setting(part: str, which: slice = slice(None), **fields: str) -> Change:
    """Return a change that sets fields of `part` of a machine to the numbers of these names."""
    def change(machine: Records, values: Parameters) -> None:
        for field, quantity in fields.items():
            getattr(machine, part)[field][which] = values[quantity]
    return change


def _scaling(part: str, *fields: str, which: slice = slice(None)) -> Change:
    def change(machine: Records, values: Parameters) -> None:
        for field in fields:
            getattr(machine, part)[field][which] *= values['factor']
    return change


def _motor_effects(name: str, which: slice) -> tuple[Defect, ...]:
    """Return the effects of one motor or of both."""
    return (
        Defect(f'{name}.viscous_friction', 'drag of a lubricant that thins under shear: '
               'c w (1 + (w / 20 rad/s)^2)^-0.075',
               (Quantity('coefficient', 'N m s/rad', 0.004, 0.06),),
               setting('motors', which, viscous='coefficient')),
        Defect(f'{name}.stribeck_friction',
               'hyperbola over Coulomb: rise / (1 + |w| / half_rate), at rest too',
               (Quantity('rise', 'N m', 0.15, 2.0), Quantity('half_rate', 'rad/s', 0.5, 4.0)),
               setting('motors', which, stribeck='rise', stribeck_rate='half_rate')),
        Defect(f'{name}.coulomb_friction', 'kinetic and static level times a factor',
               (_factor(1.35, 8.0, up_only=True),), _scaling('motors', 'coulomb', which=which)),
        Defect(f'{name}.friction_asymmetry',
               'level times 1 + share when positive, 1 - share when negative',
               (Quantity('share', '1', 0.2, 0.9, turned='sign'),),
               setting('motors', which, asymmetry='share')),
        Defect(f'{name}.load_dependent_friction',
               'share (sqrt(T_g^2 + 0.25) - 0.5), T_g the gear torque in N m',
               (Quantity('share', '1', 0.015, 0.2),),
               setting('motors', which, load_friction='share')),
        Defect(f'{name}.torque_ripple',
               'two harmonics of the shaft angle, the second 0.3 of the first',
               (Quantity('torque', 'N m', 0.05, 1.5), _cycles(2, 24), PHASE),
               setting('motors', which, ripple='torque', ripple_cycles='cycles',
                       ripple_phase='phase')),
        Defect(f'{name}.torque_constant',
               'torque and back-EMF constants together, as a weaker magnet does',
               (_factor(1.06, 1.5),),
               _scaling('motors', 'torque_constant', 'back_emf', which=which)),
        Defect(f'{name}.armature_resistance',
               'resistance times a factor; the amplifier keeps its design value',
               (_factor(1.2, 4.0, up_only=True),),
               _scaling('motors', 'resistance', which=which)),
        Defect(f'{name}.amplifier_gain', 'k_r times a factor', (_factor(1.06, 2.0),),
               _scaling('motors', 'rate_gain', which=which)),
        Defect(f'{name}.amplifier_offset', "voltage at the amplifier's input",
               (Quantity('voltage', 'V', 0.0015, 0.2, turned='sign'),),
               setting('motors', which, input_offset='voltage')),
        Defect(f'{name}.amplifier_dead_zone',
               'smooth crossover: v - d tanh(v / d) of the current demand',
               (Quantity('half_width', 'A', 0.03, 0.6),),
               setting('motors', which, dead_zone='half_width')),
        Defect(f'{name}.current_limit', 'hard limit times a factor',
               (Quantity('factor', '1', 0.9, 0.35),),
               _scaling('motors', 'current_limit', which=which)))


def _gearbox_effects(name: str, which: slice) -> tuple[Defect, ...]:
    return (
        Defect(f'{name}.gap', 'gap times a factor', (_factor(1.15, 3.5),),
               _scaling('motors', 'half_gap', which=which)),
        Defect(f'{name}.stiffness', 'stiffness times a factor', (_factor(1.08, 2.5),),
               _scaling('motors', 'stiffness', which=which)),
        Defect(f'{name}.hysteresis', 'elastic torque times 1 + share z, '
               "z' = (v - |v| z) / 0.03 rad, v the rate of deflection",
               (Quantity('share', '1', 0.012, 0.5),),
               setting('motors', which, hysteresis='share')),
        Defect(f'{name}.transmission_error', 'rounded saw-tooth of the motor angle, '
               'sum of sin(n a) / (n 2^(n-1)), added to the deflection',
               (Quantity('angle', 'rad', 0.002, 0.1), _cycles(1, 16), PHASE),
               setting('motors', which, mesh_error='angle', mesh_cycles='cycles',
                       mesh_phase='phase')))


def _fade_out(machine: Records, values: Parameters) -> None:
    machine.circuit['fade_out'] += values['shift']


_TORQUE_SHARE = (
    Defect('torque_share.bias_pot', 'k_p times a factor', (_factor(1.07, 1.5),),
           _scaling('circuit', 'bias_pot')),
    Defect('torque_share.fade_out_voltage', 'f_o shifted',
           (Quantity('shift', 'V', 0.5, 5.0, turned='sign'),), _fade_out),
    Defect('torque_share.share_filter', 'speed of transfer functions 2 to 4 times a factor, '
           'steady gains unchanged', (_factor(1.12, 3.0),),
           _scaling('circuit', 'k_2', 's_2', 'k_3')),
    Defect('torque_share.filter_1_gain', "k' times a factor", (_factor(1.12, 2.0),),
           _scaling('circuit', 'filter_gain')),
    Defect('torque_share.filter_1_pole', "p times a factor, k' unchanged",
           (_factor(1.12, 3.0),), _scaling('circuit', 'filter_pole')),
)


def gust_of(machine: Records, values: Parameters,
            spectrum: Callable[[FloatArray], FloatArray]) -> None:
    """
    Set a gust as a sum of sines.

    Parameters
    ----------
    machine
        whose gust is set
    values
        rms [N m], corner [Hz] and seed
    spectrum
        power per unit of ln f, from frequency over corner

    """
    frequency = np.geomspace(0.02, 3.0, GUST_WAVES)     # even in ln f
    amplitude = np.sqrt(spectrum(frequency / values['corner']))
    amplitude *= values['rms'] / math.sqrt(0.5 * float(np.sum(amplitude**2)))
    random = np.random.default_rng(int(values['seed']))
    structure = machine.structure[0]
    structure['gust'] = amplitude
    structure['gust_frequency'] = 2.0 * math.pi * frequency
    structure['gust_phase'] = random.uniform(0.0, 2.0 * math.pi, GUST_WAVES)


def _gust(machine: Records, values: Parameters) -> None:
    # Davenport's spectrum of wind speed, S ~ x^2 / (f (1 + x^2)^(4/3)).
    gust_of(machine, values, lambda x: x**2 / (1.0 + x**2)**(4.0 / 3.0))


def _one_mode(machine: Records, values: Parameters) -> None:
    machine.structure['mode_frequency'][0, int(values['mode']) - 1] *= values['factor']


def _extra_mode(machine: Records, values: Parameters) -> None:
    machine.structure['extra_inertia'] = values['inertia']
    machine.structure['extra_frequency'] = 2.0 * math.pi * values['frequency']
    machine.structure['extra_damping'] = values['damping_ratio']


_AXIS = (
    Defect('axis.coulomb_friction', 'kinetic and static level times a factor',
           (_factor(1.07, 2.0),), _scaling('structure', 'coulomb')),
    Defect('axis.viscous_friction', 'drag of a lubricant that thins under shear: '
           'c w (1 + (w / 1.3 mrad/s)^2)^-0.075',
           (Quantity('coefficient', 'N m s/rad', 8e5, 3e7),),
           setting('structure', viscous='coefficient')),
    Defect('axis.stribeck_friction', 'hyperbola over Coulomb: rise / (1 + |w| / half_rate); '
           'stiction rises too',
           (Quantity('rise', 'N m', 1e4, 1.5e5), Quantity('half_rate', 'rad/s', 4e-5, 4e-4)),
           setting('structure', stribeck='rise', stribeck_rate='half_rate')),
    Defect('axis.position_dependent_friction', 'tight spots: level times '
           '1 + share (2 exp(2 cos(a) - 2) - 0.617), a one turn per pitch',
           (Quantity('share', '1', 0.02, 0.6), Quantity('pitch', 'rad', 0.002, 0.015), PHASE),
           setting('structure', bump='share', bump_pitch='pitch', bump_phase='phase')),
    Defect('axis.gravity_imbalance', 'torque at the horizon times the cosine of elevation',
           (Quantity('torque', 'N m', 5e3, 2e5, turned='sign'),),
           setting('structure', gravity='torque')),
    Defect('axis.wind_steady', 'constant torque',
           (Quantity('torque', 'N m', 3e3, 1.5e5, turned='sign'),),
           setting('structure', wind='torque')),
    Defect('axis.wind_gust', "24 sines with Davenport's spectrum, another draw per recording",
           (Quantity('rms', 'N m', 1.5e3, 6e4), Quantity('corner', 'Hz', 0.1, 0.5),
            Quantity('seed', '1', 1, 1000000, 'whole')), _gust),
    Defect('axis.inertia', 'hub inertia times a factor', (_factor(1.08, 1.8),),
           _scaling('structure', 'inertia')),
    Defect('axis.mode_frequency', 'frequency of one of the three modes times a factor',
           (_factor(1.06, 1.5), Quantity('mode', '1', 1, 3, 'whole')), _one_mode),
    Defect('axis.mode_damping', 'damping of all modes times a factor',
           (_factor(1.4, 15.0, up_only=True),), _scaling('structure', 'mode_damping')),
    Defect('axis.extra_mode', 'a fourth appendage on the hub',
           (Quantity('inertia', 'kg m^2', 5e4, 2.5e6), Quantity('frequency', 'Hz', 1.2, 8.0),
            Quantity('damping_ratio', '1', 0.005, 0.03)), _extra_mode),
    Defect('axis.bull_gear_backlash', 'both gaps wider by one half gap, '
           'which wear changes by a fifth along the bull gear',
           (Quantity('half_gap', 'rad at the motor', 0.01, 0.4),),
           setting('structure', bull_gap='half_gap')),
)


def _channel_effects(number: int) -> tuple[Defect, ...]:
    which = slice(number - 1, number)
    return (
        Defect(f'tach_{number}.gain', 'relative error, inside the loop',
               (Quantity('error', '1', 0.006, 0.2, turned='sign'),),
               setting('motors', which, tach_error='error')),
        Defect(f'tach_{number}.offset', 'inside the loop',
               (Quantity('offset', 'rad/s', 0.015, 2.0, turned='sign'),),
               setting('motors', which, tach_offset='offset')),
        Defect(f'tach_{number}.ripple', 'commutation: a rectified wave with rounded feet, '
               'in proportion to the rate, inside the loop',
               (Quantity('share', '1', 0.003, 0.2), _cycles(2, 24), PHASE),
               setting('motors', which, tach_ripple='share', tach_cycles='cycles',
                       tach_phase='phase')),
        Defect(f'current_{number}.gain', 'relative error of the recorder',
               (Quantity('error', '1', 0.04, 0.4, turned='sign'),),
               setting('sensors', slice(None), **{f'current_error_{number}': 'error'})),
        Defect(f'current_{number}.offset', 'of the recorder',
               (Quantity('offset', 'A', 0.04, 0.6, turned='sign'),),
               setting('sensors', slice(None), **{f'current_offset_{number}': 'offset'})))


_SENSORS = (
    *_channel_effects(1), *_channel_effects(2),
    Defect('encoder.quantisation', 'digits of this size instead of those on the sheet',
           (Quantity('step', 'rad', 1.5e-5, 5e-4),), setting('sensors', encoder_step='step')),
    Defect('encoder.cyclic_error', 'two harmonics, the second a quarter of the first',
           (Quantity('angle', 'rad', 5e-6, 2e-4), _cycles(600, 6000), PHASE),
           setting('sensors', encoder_cyclic='angle', encoder_lines='cycles',
                   encoder_phase='phase')),
    Defect('encoder.offset', 'constant',
           (Quantity('offset', 'rad', 6e-5, 2e-3, turned='sign'),),
           setting('sensors', encoder_offset='offset')),
    Defect('bias_voltage.gain', 'relative error of the recorder',
           (Quantity('error', '1', 0.04, 0.4, turned='sign'),),
           setting('sensors', bias_error='error')),
)
_LOOP = (
    Defect('loop.delay', 'of the rate error of both motors, as a [3/4] Pade approximant',
           (Quantity('delay', 's', 8e-4, 7e-3),), setting('motors', delay='delay')),
)

CATALOGUE: dict[str, Defect] = {effect.key: effect for effect in (
    *(effect for name, which in MOTORS.items() for effect in _motor_effects(name, which)),
    *_gearbox_effects('gearbox_1', slice(0, 1)), *_gearbox_effects('gearbox_2', slice(1, 2)),
    *_TORQUE_SHARE, *_AXIS, *_SENSORS, *_LOOP)}
