# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The reference set holds the reference model's numbers, one for one, typed here anew."""

from __future__ import annotations

from typing import Any

from antenna_drive.parameters import load
from antenna_drive.parameters.sets import values
import pytest

# The reference model's own table, section by section.
REFERENCE: dict[str, Any] = {
    'plant.axis.gear_ratio': 14868.0,
    'plant.axis.inertia_hub': 8.74e6,
    'plant.axis.mode_inertias': (2.82e6, 1.55e6, 0.99e6),
    'plant.axis.mode_frequencies': (2.2, 3.7, 5.6),
    'plant.axis.mode_damping_ratios': (0.01, 0.01, 0.01),
    'plant.axis.coulomb_torque': 1.862,
    'plant.axis.stiction_ratio': 1.25,
    'plant.axis.velocity_threshold': 1.0e-9,
    'torque_share.circuit.fade_out_voltage': -10.74,
    'torque_share.circuit.current_to_voltage': 0.925,
    'torque_share.circuit.saturation_low': 0.0,
    'torque_share.circuit.saturation_high': 13.0,
    'torque_share.circuit.bias_pot': 0.7,
    'torque_share.filter_1.difference_gain': 8.192149,
}
# The same in both motors.
MOTOR = {
    'gear_ratio': 14868.0,
    'motor.torque_constant': 6.892,
    'motor.current_limit': 5.049,
    'motor.rotor_inertia': 0.0748,
    'motor.coulomb_torque': 0.069,
    'motor.stiction_ratio': 1.25,
    'motor.velocity_threshold': 1.0e-3,
    'armature.resistance': 0.46,
    'armature.inductance': 0.0125,
    'armature.back_emf_constant': 1.148681,
    'armature.physical_amperes_per_article_ampere': 6.0,
    'armature.voltage_limit': 260.0,
    'amplifier.rate_gain': 3.87,
    'amplifier.integral_time': 0.0218,
    'amplifier.lag': 0.0098,
    'amplifier.current_feedback_gain': 2.35,
    'amplifier.tach_gain': 0.03853629,
    'amplifier.bias_command_gain': 0.01304006,
    'gearbox.stiffness': 23.6,
    'gearbox.half_gap': 0.148,
    'gearbox.contact_damping': 0.133,
    'rate_command.k_s': 0.8,
    'rate_command.k_1': 716.197,
    'rate_command.tau_1': 6.37e-3,
}
CIRCUITS = {
    'old_circuit': {'k_2': -3.502, 's_2': 1.093, 'k_3': 2.0, 'g_4': 2.8,
                    'gain': 4.54, 'pole': 1.369863},
    'new_circuit': {'k_2': -2.114, 's_2': 0.8895, 'k_3': 3.831, 'g_4': 1.617,
                    'gain': 66.67, 'pole': 8.889},
}
SIGNS = {'motor_1': -1.0, 'motor_2': 1.0}


@pytest.mark.parametrize('circuit', CIRCUITS)
def test_every_number_is_the_reference_models(circuit: str) -> None:
    found = {name: value for name, _, value in values(load('reference', circuit))}
    expected = dict(REFERENCE)
    for motor, sign in SIGNS.items():
        expected[f'{motor}.sign'] = sign
        expected.update({f'{motor}.{name}': value for name, value in MOTOR.items()})
    for name, value in CIRCUITS[circuit].items():
        part = 'filter_1' if name in ('gain', 'pole') else 'circuit'
        expected[f'torque_share.{part}.{name}'] = value
    assert {name: found[name] for name in expected} == expected


def test_the_reference_is_what_loads_without_a_name() -> None:
    assert load() == load('reference')
