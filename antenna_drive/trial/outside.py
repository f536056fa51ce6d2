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
Effects outside the catalogue, which a diagnosis must answer with 'unknown'.

Even at its smallest size each leaves a gap that the tolerances cannot explain.
"""

from __future__ import annotations

from antenna_drive.trial.effect import Defect, Parameters, PHASE, Quantity
from antenna_drive.trial.effects import Change, setting
from antenna_drive.trial.machine import DROPOUTS, Records
import numpy as np

MOTOR = Quantity('motor', '1', 1, 2, 'whole')
SEED = Quantity('seed', '1', 1, 1000000, 'whole')


def _which(values: Parameters) -> int:
    return int(values['motor']) - 1


def motor_values(**fields: str) -> Change:
    """Return a change that sets fields of the motor that the numbers name."""
    def change(machine: Records, values: Parameters) -> None:
        for field, quantity in fields.items():
            machine.motors[field][_which(values)] = values[quantity]
    return change


def _dropouts(machine: Records, values: Parameters) -> None:
    random = np.random.default_rng(int(values['seed']))
    which = _which(values)
    machine.motors['dropout_length'][which] = values['length']
    slots = 1.0 + (28.0 / DROPOUTS) * (np.arange(DROPOUTS) + random.uniform(0.0, 0.8, DROPOUTS))
    machine.motors['dropout'][which] = slots


def _brake(machine: Records, values: Parameters) -> None:
    which = _which(values)
    machine.motors['brake'][which] = values['torque']
    machine.motors['brake_start'][which] = values['start']
    machine.motors['brake_end'][which] = values['start'] + values['length']


def _warm_motor(machine: Records, values: Parameters) -> None:
    which = _which(values)
    machine.motors['warm_torque'][which] = values['torque_loss']
    machine.motors['warm_resistance'][which] = 2.0 * values['torque_loss']
    machine.motors['warming_time'][which] = values['time']


OUTSIDE: dict[str, Defect] = {effect.key: effect for effect in (
    Defect('outside.damaged_tooth', 'one raised tooth on a slower shaft of a gearbox',
           (Quantity('height', 'rad', 0.04, 0.3), MOTOR,
            Quantity('ratio', 'rev/rev', 2.2, 6.3), PHASE),
           motor_values(tooth_height='height', tooth_ratio='ratio', tooth_phase='phase')),
    Defect('outside.warming_motor', 'torque constant falls and resistance rises with the '
           'heat of the current, first order',
           (Quantity('torque_loss', '1/A^2', 0.006, 0.06), MOTOR,
            Quantity('time', 's', 5.0, 20.0)), _warm_motor),
    Defect('outside.tach_dropouts', 'cable contact: the tachometer reads zero eight times in '
           '30 s, inside the loop',
           (Quantity('length', 's', 0.015, 0.15), MOTOR, SEED), _dropouts),
    Defect('outside.slew_limit', "slope of an amplifier's current demand limited, smoothly",
           (Quantity('limit', 'A/s', 120.0, 8.0), MOTOR), motor_values(slew_limit='limit')),
    Defect('outside.windup', 'the clamp does not stop the integrator, which also leaks',
           (Quantity('leak', '1/s', 0.1, 3.0), Quantity('share', '1', 0.7, 1.0, 'even')),
           setting('motors', integrator_leak='leak', windup='share')),
    Defect('outside.encoder_coupling', 'the encoder hangs on a spring',
           (Quantity('frequency', 'rad/s', 40.0, 6.0), Quantity('damping_ratio', '1', 0.02, 0.2)),
           setting('structure', encoder_frequency='frequency', encoder_damping='damping_ratio')),
    Defect('outside.hardening_gear', 'gear stiffness grows with the square of its deflection',
           (Quantity('hardening', '1/rad^2', 0.5, 30.0),),
           setting('motors', hardening='hardening')),
    Defect('outside.dahl_friction', 'part of the axis friction acts as a spring before it slides',
           (Quantity('travel', 'rad', 1.5e-5, 4e-4), Quantity('share', '1', 0.5, 0.9, 'even')),
           setting('structure', dahl_travel='travel', dahl='share')),
    Defect('outside.unequal_bridges', 'gain of a power stage differs with the direction of '
           'the current, v (1 + error tanh(v / 0.3 A))',
           (Quantity('error', '1', 0.05, 0.3, turned='sign'), MOTOR),
           motor_values(bridge_error='error')),
    Defect('outside.structural_friction', 'dry friction in the joints of the first mode',
           (Quantity('torque', 'N m', 4e3, 8e4), Quantity('rate', 'rad/s', 2e-5, 1e-4)),
           setting('structure', mode_friction='torque', mode_friction_rate='rate')),
    Defect('outside.current_ripple', 'torque constant ripples with the angle: '
           'the ripple grows with the current',
           (Quantity('share', '1', 0.05, 0.4), MOTOR, Quantity('cycles', '1/rev', 2, 24, 'whole'),
            PHASE), motor_values(current_ripple='share', ripple_cycles='cycles',
                                 ripple_phase='phase')),
    Defect('outside.warming_lubricant', 'axis friction falls exponentially with time',
           (Quantity('loss', '1', 0.1, 0.6), Quantity('time', 's', 5.0, 20.0)),
           setting('structure', warming='loss', warming_time='time')),
    Defect('outside.dragging_brake', "a motor's brake drags for some seconds",
           (Quantity('torque', 'N m', 0.5, 6.0), MOTOR, Quantity('start', 's', 3.0, 18.0),
            Quantity('length', 's', 3.0, 9.0)), _brake),
    Defect('outside.tach_coupling', 'a tachometer hangs on an elastic coupling, inside the loop',
           (Quantity('frequency', 'rad/s', 220.0, 110.0), MOTOR),
           motor_values(coupling_frequency='frequency')),
    Defect('outside.mains_hum', '50 Hz on a tachometer, inside the loop',
           (Quantity('amplitude', 'rad/s', 0.02, 0.6), MOTOR), motor_values(hum='amplitude')),
    Defect('outside.shifting_ballast', 'a load shifts once: gravity jumps',
           (Quantity('torque', 'N m', 2e4, 2e5, turned='sign'), Quantity('at', 's', 5.0, 15.0)),
           setting('structure', ballast='torque', ballast_at='at')),
)}
