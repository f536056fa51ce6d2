# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The emulator against a second program for the same drive, sample by sample.

`lab.antenna` was written from the same equations without a line in common: other states,
another integrator (Dormand-Prince with dense output, tolerance 1e-8), other code for gears and
friction. Where both agree a mistake would have to have been made twice.
"""

from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import simulate
from antenna_drive.parameters.sets import changed
from lab.antenna.machine import LAW_B, reference_machine
from lab.antenna.real_antenna import simulate as simulate_apart
from lab.antenna.sheet import CaseSheet
import numpy as np
import pytest

SQUARE = {'type': 'square', 'amplitude_deg_s': 0.013, 'period_s': 6.3}
TRIANGLE = {'type': 'triangle', 'amplitude_deg_s': 0.685, 'period_s': 5.0}
STEADY = {'type': 'circuit', 'start': 'steady'}
ZERO = {'type': 'circuit', 'start': 'zero'}

# Each experiment of ours, told once more in the words of the other program.
SHEETS: dict[str, tuple[str, dict[str, Any], dict[str, Any], float]] = {
    'T1': ('old', {'type': 'fixed', 'voltage_V': 0.0}, SQUARE, 0.7),
    'T2': ('old', {'type': 'fixed', 'voltage_V': 0.15 * 5.049 * 8.192149}, SQUARE, 0.7),
    'T3a': ('old', STEADY, TRIANGLE, 0.8),
    'T3b': ('new', STEADY, TRIANGLE, 0.892),
    'T4a': ('old', ZERO, {}, 0.7),
    'T4e': ('new', ZERO, {}, 0.7),
}


@pytest.mark.parametrize('name', list(SHEETS))
def test_both_programs_give_the_same_motion(name: str) -> None:
    circuit, bias, waveform, pot = SHEETS[name]
    run = simulate(experiments()[name].drive(), 8.0, 2.5e-4, every=8)
    # the other program holds a jump's old value at its very instant: look just after each sample
    history = simulate_apart(reference_machine(circuit, circuit, pot),
                             CaseSheet(circuit, circuit, {**bias, 'bias_pot': pot}, waveform),
                             run.time + 1e-9)
    for signal, apart in (('motor_1/current', history.current[0]),
                          ('motor_2/current', history.current[1]),
                          ('motor_1/tach_rate', history.tach[0]),
                          ('motor_2/tach_rate', history.tach[1]),
                          ('plant/axis_angle', history.axis_angle),
                          ('plant/axis_rate', history.axis_rate),
                          ('torque_share/bias_voltage', history.bias)):
        ours = run[signal]
        size = np.sqrt(np.mean(apart ** 2))
        error = np.sqrt(np.mean((ours - apart) ** 2))
        assert error <= 1e-3 * size, f'{signal}: {error / size:.2e}'


def test_both_programs_agree_where_a_ripple_drives_a_motor_to_its_limit() -> None:
    """In each ripple the demand meets its limit, where the integral waits for the error."""
    share, cycles, phase = 0.12, 3.0, 0.7
    drive = changed(experiments()['T3b'].drive(), {
        **{f'motor_1.tachometer.ripple{name}': value for name, value in {
            '': share, '_cycles': cycles, '_phase': phase,
            '_second': 0.5 * share, '_second_phase': 2.0 * phase + 0.8}.items()},
        'test_signal.rate.period': 2.0})
    run = simulate(drive, 4.0, 2.5e-4, every=8)
    circuit, bias, waveform, pot = SHEETS['T3b']
    machine = reference_machine(circuit, circuit, pot)
    machine.motors['law'] = LAW_B
    machine.motors['tach_ripple'][0], machine.motors['tach_cycles'][0] = share, cycles
    machine.motors['tach_phase'][0] = phase
    history = simulate_apart(machine, CaseSheet(circuit, circuit, {**bias, 'bias_pot': pot},
                                                {**waveform, 'period_s': 2.0}),
                             run.time + 1e-9)
    limit = drive.motor_1.motor.current_limit
    assert np.abs(run['motor_1/current']).max() > 0.98 * limit
    error = np.abs(run['plant/axis_angle'] - history.axis_angle)
    assert error.max() < 1e-3 * np.abs(history.axis_angle).max()
