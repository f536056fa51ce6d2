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
"""What is no effect and must be fitted beside any: tolerances, places at the start, zeros."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import math

from antenna_drive.machines.antenna.catalogue import ADD, DriveParameter, SCALE
from antenna_drive.machines.antenna.field_test import FieldTest

# What the names of those begin with that no field of the record holds.
SUPPLY, CLOCK, ZERO = 'supply:', 'clock:', 'zero:'
# What numbers of the machine the configuration knows only within the sheet's tolerance.
TOLERANT_MOTOR = (
    'rate_command.k_s', 'rate_command.k_1', 'rate_command.tau_1', 'amplifier.rate_gain',
    'amplifier.integral_time', 'amplifier.lag', 'amplifier.current_feedback_gain',
    'amplifier.forward_gain_share', 'armature.voltage_limit',
    'amplifier.tach_gain', 'amplifier.bias_command_gain', 'armature.inductance',
    'motor.current_limit', 'motor.rotor_inertia', 'motor.coulomb_torque', 'motor.stiction_ratio',
    'gearbox.stiffness', 'gearbox.half_gap', 'gearbox.contact_damping',
)
TOLERANT_DRIVE = (
    'torque_share.circuit.bias_pot', 'torque_share.circuit.fade_out_voltage',
    'torque_share.circuit.current_to_voltage', 'torque_share.circuit.k_2',
    'torque_share.circuit.s_2', 'torque_share.circuit.k_3',
    'torque_share.circuit.g_4', 'torque_share.circuit.saturation_high',
    'torque_share.filter_1.gain', 'torque_share.filter_1.pole',
    'torque_share.filter_1.difference_gain',
    'plant.axis.inertia_hub', 'plant.axis.coulomb_torque', 'plant.axis.stiction_ratio',
    *(f'plant.axis.{name}.{j}' for name in (
        'mode_inertias', 'mode_frequencies', 'mode_damping_ratios') for j in range(3)),
)


def offsets(tests: Sequence[FieldTest], tolerance: float) -> tuple[DriveParameter, ...]:
    """
    Return the offsets of a machine in its tests.

    Parameters
    ----------
    tests
        that were made
    tolerance
        by what share the machine's numbers may be other than configured

    """
    return (*_of_the_machine(tests[0], tolerance),
            *(item for k, test in enumerate(tests) for item in _of_a_test(k, test, tolerance)))


def _of_the_machine(test: FieldTest, tolerance: float) -> Iterator[DriveParameter]:
    spread = tolerance / math.sqrt(3.0)

    def scaled(name: str, *fields: str) -> DriveParameter:
        return DriveParameter(f'offset:{name}', '1', -tolerance, tolerance, 0.3 * tolerance,
                              spread, how=SCALE, fields=fields or (name,))

    for motor in ('motor_1', 'motor_2'):
        for name in TOLERANT_MOTOR:
            yield scaled(f'{motor}.{name}')
        # a motor's magnets make its torque and its back-EMF
        yield scaled(f'{motor}.motor.torque_constant', f'{motor}.motor.torque_constant',
                     f'{motor}.armature.back_emf_share')
        yield scaled(f'{motor}.armature.back_emf_constant')
        # its amplifier is made for the resistance that the winding should have
        ohms = tolerance * float(test.record[motor]['armature']['resistance'][0])
        path = f'{motor}.armature.resistance_change'
        yield DriveParameter(f'offset:{path}', 'ohm', -ohms, ohms, 0.3 * ohms,
                             ohms / math.sqrt(3.0), how=ADD, fields=(path,))
    for name in TOLERANT_DRIVE:
        yield scaled(name)


def _of_a_test(k: int, test: FieldTest, tolerance: float) -> Iterator[DriveParameter]:
    for motor in ('motor_1', 'motor_2'):
        yield DriveParameter(f'start:{test.name}.{motor}', '1', -1.0, 1.0, 0.05, 0.6,
                             experiment=k, how=ADD, fields=(f'{motor}.start_in_gap',))
    if test.record['torque_share']['circuit']['bias_source'][0] == 1:
        yield DriveParameter(f'{SUPPLY}{test.name}', '1', -tolerance, tolerance, 0.3 * tolerance,
                             tolerance / math.sqrt(3.0), experiment=k, how=SCALE)
    yield DriveParameter(f'{CLOCK}{test.name}', 's', -0.01, 0.01, 1e-4, 1e-3, experiment=k,
                         reading=True)
    yield DriveParameter(f'{ZERO}encoder:{test.name}', 'rad', -4e-5, 4e-5, 2e-6, 1e-5,
                         experiment=k, reading=True)
    sensors = test.sensors
    for name, unit, noise in (
            ('current_1', 'A', sensors.current_noise), ('current_2', 'A', sensors.current_noise),
            ('tach_1', 'rad/s', sensors.tach_noise), ('tach_2', 'rad/s', sensors.tach_noise),
            ('bias_voltage', 'V', sensors.bias_noise)):
        yield DriveParameter(f'{ZERO}{name}:{test.name}', unit, -2.0 * noise, 2.0 * noise, noise,
                             0.7 * noise, experiment=k, reading=True)
