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
One antenna as records: every physical constant and every imperfection.

The compiled equations read these records. An imperfection is absent at zero; only `effects.py`
and `outside.py` set one.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from antenna_drive.trial import nominal
import numpy as np
from numpy.typing import NDArray

GUST_WAVES = 24
DROPOUTS = 8

# The laws by which effects act: those of effects.py, or those of family_b.py.
LAW_A, LAW_B = 0.0, 1.0

MOTOR = np.dtype([(name, np.float64) for name in (
    'law',                      # LAW_A or LAW_B
    # as built
    'side',                     # -1 for motor 1, +1 for motor 2
    'rate_gain',                # k_r [A/V]
    'integral_time',            # T_2 [s]
    'lag',                      # T_a [s]
    'current_limit',            # i_max [A]
    'tach_gain',                # k_t [V s/rad]
    'loop_gain',                # kappa (R + G_a) as designed [ohm]
    'feedback_gain',            # kappa G_a [ohm]
    'voltage_limit',            # V_max [V]
    'clamp_slope',              # k_e: centre of the current clamp over rate [A s/rad]
    'resistance',               # R [ohm]
    'inductance',               # L [H]
    'back_emf',                 # k_b / kappa [V s/rad per article ampere]
    'ampere_scale',             # kappa
    'torque_constant',          # k_m [N m/A]
    'inertia',                  # J_m [kg m^2]
    'coulomb',                  # [N m]
    'stiction_ratio',           # stiction over Coulomb
    'stiffness',                # k_g [N m/rad]
    'half_gap',                 # b [rad]
    'contact_damping',          # d_g [N m s/rad]
    # imperfections of the catalogue
    'viscous',                  # [N m s/rad] at low rate
    'stribeck',                 # friction at rest above Coulomb [N m]
    'stribeck_rate',            # rate at which it has fallen to half [rad/s]
    'asymmetry',                # Coulomb times 1 + asymmetry * direction
    'load_friction',            # friction per gear torque
    'ripple', 'ripple_cycles', 'ripple_phase',        # [N m], per revolution, [rad]
    'input_offset',             # at the amplifier's input [V]
    'dead_zone',                # half width at the current demand [A]
    'hysteresis',               # share of the elastic gear torque that lags
    'mesh_error', 'mesh_cycles', 'mesh_phase',        # [rad], per revolution, [rad]
    'tach_error',               # relative gain error of the tachometer
    'tach_offset',              # [rad/s]
    'tach_ripple', 'tach_cycles', 'tach_phase',       # relative, per revolution, [rad]
    'delay',                    # of the rate error [s]
    # imperfections outside the catalogue
    'slew_limit',               # largest slope of the current demand [A/s], 0: none
    'bridge_error',             # gain of the power stage times 1 + this * sign of the demand
    'windup',                   # share of the integration that the clamp fails to stop
    'integrator_leak',          # [1/s]
    'current_ripple',           # relative ripple of the torque constant
    'warm_resistance',          # relative rise of the resistance per warmth [1/A^2]
    'warm_torque',              # loss of torque constant: it is 1 / (1 + this * warmth) [1/A^2]
    'warming_time',             # [s]
    'coupling_frequency',       # of the tachometer's coupling [rad/s], 0: rigid
    'hardening',                # stiffness times 1 + hardening * deflection^2 [1/rad^2]
    'tooth_height', 'tooth_ratio', 'tooth_phase',     # damaged tooth [rad], rev/rev, [rad]
    'brake', 'brake_start', 'brake_end',              # dragging brake [N m], [s], [s]
    'dropout_length',           # [s]
    'hum',                      # mains hum at the tachometer [rad/s]
    # imperfections of family B outside the catalogue
    'tach_saturation',          # reading at which the tachometer saturates [rad/s], 0: none
    'tach_dead_band',           # half width of the dead band of its brushes [rad/s]
    'loop_crosstalk',           # share of the other tachometer in this rate loop
    'eddy_brake', 'eddy_rate',  # greatest drag of an eddy-current brake [N m], at [rad/s]
    'magnet_saturation',        # torque constant is 1 / (1 + this * current^2) [1/A^2]
    'mesh_stiffness', 'mesh_stiffness_cycles',        # relative wave of the stiffness, per rev
)] + [('dropout', np.float64, (DROPOUTS,))])

STRUCTURE = np.dtype([(name, np.float64) for name in (
    'law',                      # LAW_A or LAW_B
    # as built
    'gear_ratio',               # N
    'inertia',                  # hub J_0 [kg m^2]
    'coulomb',                  # at the axis [N m]
    'stiction_ratio',
    # imperfections of the catalogue
    'viscous',                  # [N m s/rad] at low rate
    'stribeck', 'stribeck_rate',                      # [N m], [rad/s]
    'bump', 'bump_pitch', 'bump_phase',               # share of Coulomb, [rad], [rad]
    'gravity',                  # [N m] at elevation 0
    'wind',                     # [N m]
    'extra_inertia', 'extra_frequency', 'extra_damping',   # [kg m^2], [rad/s], 1
    'bull_gap',                 # half gap of the bull gear, at the motor shaft [rad]
    # imperfections outside the catalogue
    'encoder_frequency', 'encoder_damping',           # encoder coupling [rad/s], 1; 0: rigid
    'dahl',                     # share of the Coulomb friction that acts as a spring first
    'dahl_travel',              # [rad]
    'warming', 'warming_time',                        # loss of Coulomb friction, [s]
    'mode_friction',            # dry friction in the structure [N m]
    'mode_friction_rate',       # [rad/s]
    'ballast', 'ballast_at',    # load that shifts [N m], [s]
    # imperfections of family B outside the catalogue
    'mode_play',                # half of the play in the joint of the first mode [rad]
    'cable',                    # stiffness of a cable wrap [N m/rad]
    'hard_spot', 'hard_spot_at', 'hard_spot_width',   # share of Coulomb, [rad], [rad]
)] + [
    ('mode_inertia', np.float64, (3,)),
    ('mode_frequency', np.float64, (3,)),             # [rad/s]
    ('mode_damping', np.float64, (3,)),
    ('gust', np.float64, (GUST_WAVES,)),              # amplitudes [N m]
    ('gust_frequency', np.float64, (GUST_WAVES,)),    # [rad/s]
    ('gust_phase', np.float64, (GUST_WAVES,)),        # [rad]
])

CIRCUIT = np.dtype([(name, np.float64) for name in (
    'command_gain',             # k_s k_1 [V s/rad]
    'command_lag',              # tau_1 [s]
    'k_2', 's_2', 'k_3', 'g_4',  # transfer functions 2 to 4
    'fade_out',                 # f_o [V]
    'current_to_voltage',       # c_i [V/A]
    'ceiling',                  # of the saturation [V]
    'bias_pot',                 # k_p
    'filter_gain', 'filter_pole',                     # [1/s]
    'difference_gain',          # k_f [V/A]
    'counter_torque_gain',      # s_F
)] + [
    # imperfection of family B outside the catalogue
    ('command_leak', np.float64),                     # of the command into the share [1/s]
])

SENSORS = np.dtype([(name, np.float64) for name in (
    'law',                      # LAW_A or LAW_B
    'current_error_1', 'current_error_2',             # relative gain errors
    'current_offset_1', 'current_offset_2',           # [A]
    'encoder_step',             # [rad], 0: as the test sheet says
    'encoder_cyclic', 'encoder_lines', 'encoder_phase',    # [rad], per revolution, [rad]
    'encoder_offset',           # [rad]
    'bias_error',               # relative gain error
    # of the recorder alone, in every real machine
    'tach_error_1', 'tach_error_2',                   # relative gain errors
    'bias_zero',                # [V]
    # imperfections of family B outside the catalogue
    'ammeter_lag',              # of both ammeters, first order [s]
    'ammeter_crosstalk',        # share of the other current in each ammeter
    'encoder_play',             # half of the play of the encoder's coupling [rad]
)])


class Records(NamedTuple):
    """The records of one antenna: arrays of records, changed in place while it is built."""

    motors: NDArray[Any]        # shape (2,), MOTOR
    structure: NDArray[Any]     # shape (1,), STRUCTURE
    circuit: NDArray[Any]       # shape (1,), CIRCUIT
    sensors: NDArray[Any]       # shape (1,), SENSORS


# Constants with a manufacturing tolerance. A gear ratio is a ratio of tooth counts and has none.
TOLERANCED_MOTOR = (
    'rate_gain', 'integral_time', 'lag', 'current_limit', 'tach_gain', 'feedback_gain',
    'voltage_limit', 'resistance', 'inductance', 'torque_constant', 'inertia', 'coulomb',
    'stiction_ratio', 'stiffness', 'half_gap', 'contact_damping')
TOLERANCED_STRUCTURE = (
    'inertia', 'coulomb', 'stiction_ratio', 'mode_inertia', 'mode_frequency', 'mode_damping')
TOLERANCED_CIRCUIT = (CIRCUIT.names or ())[:-1]


def reference_machine(circuit: str = 'old', filter_1: str = 'old',
                      bias_pot: float = nominal.BIAS_POT.value) -> Records:
    """
    Build the reference drive without any imperfection.

    Parameters
    ----------
    circuit
        torque-share constants of Table 1, 'old' or 'new'
    filter_1
        Filter 1 of Table 1, 'old' or 'new'
    bias_pot
        k_p, unit 1

    """
    machine = Records(np.zeros(2, MOTOR), np.zeros(1, STRUCTURE), np.zeros(1, CIRCUIT),
                      np.zeros(1, SENSORS))
    _build_motors(machine.motors)
    _build_structure(machine.structure[0])
    _build_circuit(machine.circuit[0], circuit, filter_1, bias_pot)
    return machine


def _build_motors(motors: NDArray[Any]) -> None:
    scale = nominal.AMPERE_SCALE.value
    built_resistance = nominal.RESISTANCE.value + nominal.CURRENT_FEEDBACK_GAIN.value
    motors['side'] = (-1.0, 1.0)
    for name in ('rate_gain', 'integral_time', 'current_limit', 'tach_gain', 'voltage_limit',
                 'resistance', 'inductance', 'torque_constant', 'stiction_ratio', 'half_gap',
                 'contact_damping'):
        motors[name] = getattr(nominal, name.upper()).value
    motors['lag'] = nominal.AMPLIFIER_LAG.value
    motors['loop_gain'] = scale * built_resistance
    motors['feedback_gain'] = scale * nominal.CURRENT_FEEDBACK_GAIN.value
    motors['clamp_slope'] = nominal.BACK_EMF.value / scale / built_resistance
    motors['back_emf'] = nominal.BACK_EMF.value / scale
    motors['ampere_scale'] = scale
    motors['inertia'] = nominal.ROTOR_INERTIA.value
    motors['coulomb'] = nominal.MOTOR_COULOMB.value * nominal.TORQUE_CONSTANT.value
    motors['stiffness'] = nominal.GEAR_STIFFNESS.value
    for name in ('stribeck_rate', 'warming_time', 'tooth_ratio', 'eddy_rate'):
        motors[name] = 1.0
    motors['dropout'] = -1.0


def _build_structure(structure: Any) -> None:
    structure['gear_ratio'] = nominal.GEAR_RATIO.value
    structure['inertia'] = nominal.HUB_INERTIA.value
    structure['coulomb'] = (nominal.AXIS_COULOMB.value * nominal.TORQUE_CONSTANT.value
                            * nominal.GEAR_RATIO.value)
    structure['stiction_ratio'] = nominal.STICTION_RATIO.value
    structure['mode_inertia'] = [fact.value for fact in nominal.MODE_INERTIA]
    structure['mode_frequency'] = [
        2.0 * math.pi * fact.value for fact in nominal.MODE_FREQUENCY]
    structure['mode_damping'] = nominal.MODE_DAMPING.value
    for length in ('stribeck_rate', 'bump_pitch', 'dahl_travel', 'warming_time',
                   'mode_friction_rate', 'hard_spot_width'):
        structure[length] = 1.0
    structure['ballast_at'] = -1.0


def _build_circuit(record: Any, circuit: str, filter_1: str, bias_pot: float) -> None:
    record['command_gain'] = nominal.COMMAND_SCALE.value * nominal.COMMAND_GAIN.value
    record['command_lag'] = nominal.COMMAND_LAG.value
    for name, value in nominal.SHARE[circuit]._asdict().items():
        record[name] = value
    record['fade_out'] = nominal.FADE_OUT_VOLTAGE.value
    record['current_to_voltage'] = nominal.CURRENT_TO_VOLTAGE.value
    record['ceiling'] = nominal.BIAS_CEILING.value
    record['bias_pot'] = bias_pot
    record['filter_gain'] = nominal.FILTER_1[filter_1].gain
    record['filter_pole'] = nominal.FILTER_1[filter_1].pole
    record['difference_gain'] = nominal.DIFFERENCE_GAIN.value
    record['counter_torque_gain'] = nominal.COUNTER_TORQUE_GAIN.value


class Tolerances(NamedTuple):
    """Factors near 1 for all toleranced constants, in a fixed order."""

    motors: NDArray[np.float64]         # shape (2, len(TOLERANCED_MOTOR))
    structure: NDArray[np.float64]      # shape (n,), modes one by one
    circuit: NDArray[np.float64]        # shape (len(TOLERANCED_CIRCUIT),)


def draw_tolerances(tolerance: float, random: np.random.Generator) -> Tolerances:
    """
    Draw the deviations of one antenna from the reference, uniform within +-tolerance.

    Parameters
    ----------
    tolerance
        largest relative deviation, unit 1
    random
        source of randomness

    """
    def factors(*shape: int) -> NDArray[np.float64]:
        return 1.0 + tolerance * random.uniform(-1.0, 1.0, shape)

    width = sum(max(1, math.prod(STRUCTURE[name].shape)) for name in TOLERANCED_STRUCTURE)
    return Tolerances(factors(2, len(TOLERANCED_MOTOR)), factors(width),
                      factors(len(TOLERANCED_CIRCUIT)))


def apply_tolerances(machine: Records, tolerances: Tolerances) -> None:
    """Multiply every toleranced constant of the machine by its factor."""
    for column, name in enumerate(TOLERANCED_MOTOR):
        machine.motors[name] *= tolerances.motors[:, column]
    # A stronger magnet raises torque and back-EMF together.
    strength = tolerances.motors[:, TOLERANCED_MOTOR.index('torque_constant')]
    machine.motors['back_emf'] *= strength
    at = 0
    for name in TOLERANCED_STRUCTURE:
        width = max(1, math.prod(STRUCTURE[name].shape))
        factor = tolerances.structure[at:at + width]
        machine.structure[name] *= factor if width > 1 else factor[0]
        at += width
    for column, name in enumerate(TOLERANCED_CIRCUIT):
        machine.circuit[name] *= tolerances.circuit[column]
