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
The drive's units, their signals, and which signal feeds which unit: Figs. 4 and 5, once, as data.

Signal names are 'unit/signal'. Currents are in article amperes, see docs/model.md.
"""

from __future__ import annotations

from antenna_drive.emulator.unit import Signal

TEST_SIGNAL = 'test_signal'
MOTORS = ('motor_1', 'motor_2')
TORQUE_SHARE = 'torque_share'
PLANT = 'plant'
UNITS = (TEST_SIGNAL, *MOTORS, TORQUE_SHARE, PLANT)

TEST_SIGNAL_OUTPUTS = (
    Signal('rate_command', 'rad/s', 'axis rate command'),
    Signal('external_torque', 'N m', 'test torque at the axis, zero unless asked for'),
)
MOTOR_OUTPUTS = (
    Signal('current', 'A', 'motor current, article amperes'),
    Signal('gear_torque', 'N m', 'gearbox torque at the motor shaft, positive drives the axis'),
    Signal('missed_impulse', 'N m s', 'impulse of the gear torque that its extrapolation missed'),
    Signal('tach_rate', 'rad/s', 'tachometer reading', exchanged=False),
    Signal('ammeter', 'A', 'ammeter reading, article amperes', exchanged=False),
)
TORQUE_SHARE_OUTPUTS = (
    Signal('counter_torque', 'V', 'output of Filter 1'),
    Signal('bias_voltage', 'V', 'torque bias asked for, output of the torque-share circuit',
           exchanged=False),
)
PLANT_OUTPUTS = (
    Signal('axis_angle', 'rad', 'elevation of the hub from its start'),
    Signal('axis_rate', 'rad/s', 'elevation rate of the hub'),
    Signal('encoder', 'rad', 'elevation encoder reading', exchanged=False),
    Signal('pinion_rate', 'rad/s', 'axis rate times the gear ratio', exchanged=False),
    Signal('pointing_error_elevation', 'rad', 'beam minus encoder in elevation',
           exchanged=False),
    Signal('pointing_error_cross_elevation', 'rad', 'beam offset in cross-elevation',
           exchanged=False),
)

OUTPUTS: dict[str, tuple[Signal, ...]] = {
    TEST_SIGNAL: TEST_SIGNAL_OUTPUTS,
    MOTORS[0]: MOTOR_OUTPUTS,
    MOTORS[1]: MOTOR_OUTPUTS,
    TORQUE_SHARE: TORQUE_SHARE_OUTPUTS,
    PLANT: PLANT_OUTPUTS,
}

# The order of a unit's inputs is the order in which its compiled step reads them.
MOTOR_INPUTS = (
    f'{TEST_SIGNAL}/rate_command',
    f'{TORQUE_SHARE}/counter_torque',
    f'{PLANT}/axis_angle',
    f'{PLANT}/axis_rate',
)
INPUTS: dict[str, tuple[str, ...]] = {
    TEST_SIGNAL: (),
    MOTORS[0]: MOTOR_INPUTS,
    MOTORS[1]: MOTOR_INPUTS,
    TORQUE_SHARE: tuple(f'{motor}/current' for motor in MOTORS),
    PLANT: (*(f'{motor}/gear_torque' for motor in MOTORS),
            *(f'{motor}/missed_impulse' for motor in MOTORS), f'{TEST_SIGNAL}/external_torque'),
}


def signal_names() -> tuple[str, ...]:
    """Return every signal of the drive as 'unit/signal', unit by unit in the order of UNITS."""
    return tuple(f'{unit}/{signal.name}' for unit in UNITS for signal in OUTPUTS[unit])
