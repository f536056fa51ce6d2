# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive in one process: bit-identity, order of convergence, live changes, own units."""

from dataclasses import replace
import math
from typing import ClassVar

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator import wiring
from antenna_drive.emulator.run import Emulator, FINE_STEP, simulate
from antenna_drive.emulator.unit import FloatArray, Signal, Unit
from antenna_drive.emulator.units import build
from antenna_drive.parameters import load, ParameterError
from antenna_drive.parameters.sets import changed, Drive
import numpy as np
import pytest
from simgap.inputs.schema import Value

CHANGES: dict[int, dict[str, dict[str, Value]]] = {
    300: {'test_signal': {'waveform': 'saw_tooth', 'amplitude': 0.01, 'period': 0.9}},
    701: {'torque_share': {'bias_pot': 0.9, 'filter_1.gain': 20.0}},
    950: {'test_signal': {'amplitude': 0.004}, 'torque_share': {'fade_out_voltage': -9.0}},
    1203: {'test_signal': {'waveform': 'external', 'external': 0.003}},
}


def test_many_steps_in_one_call_give_the_bits_of_single_steps() -> None:
    drive = experiments()['T3a'].drive()
    fast = Emulator(drive).run(1.5, CHANGES)
    slow = Emulator(drive)
    rows = [slow.now]
    for k in range(1500):
        slow.tune(CHANGES.get(k, {}))
        rows.append(slow.step())
    assert np.array_equal(fast.samples, np.array(rows))
    assert np.array_equal(fast.steps, np.arange(1501))


def test_a_run_can_be_repeated_and_thinned() -> None:
    emulator = Emulator(experiments()['T3b'].drive())
    first = emulator.run(0.6)
    again = emulator.run(0.6, every=7)
    assert np.array_equal(again.steps[1:], np.arange(7, 601, 7))
    assert np.array_equal(first.samples[again.steps], again.samples)


def test_memory_does_not_grow_when_only_statistics_are_kept() -> None:
    emulator = Emulator(experiments()['T3a'].drive())
    column = emulator.names.index('torque_share/bias_voltage')
    highest, largest = 0.0, 0
    for _, samples in emulator.chunks(12.0):
        highest = max(highest, float(samples[:, column, 0].max()))
        largest = max(largest, samples.nbytes)
    assert highest == pytest.approx(10.4, abs=0.2)
    assert largest < 2e6


def test_halving_the_macro_step_divides_the_error_by_four() -> None:
    # everything smooth: preloaded gears that stay in contact, no friction, a sine as command
    drive = changed(load('new_circuit'), {
        'plant.axis.coulomb_torque': 0.0, 'motor_1.motor.coulomb_torque': 0.0,
        'motor_2.motor.coulomb_torque': 0.0, 'torque_share.circuit.bias_source': 'fixed',
        'torque_share.circuit.fixed_voltage': 9.0, 'test_signal.rate.waveform': 'sine',
        'test_signal.rate.amplitude': 2e-4, 'test_signal.rate.period': 0.5,
        'test_signal.rate.start_after': 10.0})

    def end(step_s: float) -> FloatArray:
        run = simulate(drive, 11.0, step_s, every=round(4e-3 / step_s))
        assert np.all(run['motor_1/gear_torque'][-250:] < 0.0)
        assert np.all(run['motor_2/gear_torque'][-250:] > 0.0)
        return run['motor_1/current'][-250:]

    exact = end(FINE_STEP)
    errors = [float(np.sqrt(np.mean((end(h) - exact) ** 2))) for h in (4e-3, 2e-3, 1e-3)]
    assert 3.5 < errors[0] / errors[1] < 5.0
    assert 3.5 < errors[1] / errors[2] < 5.0


def test_a_change_counts_from_its_step_on_and_not_before() -> None:
    drive = experiments()['T4a'].drive()
    plain = simulate(drive, 0.5)
    changes = {200: {'torque_share': {'filter_1.gain': 50.0}}}
    tuned = simulate(drive, 0.5, changes=changes)
    assert np.array_equal(plain.samples[:201], tuned.samples[:201])
    assert not np.array_equal(plain.samples[201], tuned.samples[201])
    assert tuned.changes == changes


@pytest.mark.parametrize(('unit', 'changes', 'said'), [
    ('torque_share', {'bias_pot': 0.9, 'k_2': -3.0}, 'k_2: a physical constant, read-only'),
    ('torque_share', {'bias_pot': 1.9}, r'bias_pot: 1\.9 given, allowed is a number from 0 to 1'),
    ('torque_share', {'bias_pott': 0.9}, r'bias_pott: no such parameter, did you mean bias_pot\?'),
    ('test_signal', {'amplitude': 0.1, 'frequencies': (1.0,)}, r'rate\.weights: 3 numbers given'),
    ('torqueshare', {'bias_pot': 0.9}, 'torqueshare: no such unit'),
])
def test_a_refused_change_says_why_and_changes_nothing(
        unit: str, changes: dict[str, float], said: str) -> None:
    emulator = Emulator(load())
    before = {name: dict(item.settings()) for name, item in emulator.units.items()}
    with pytest.raises(ParameterError, match=said):
        emulator.tune({'torque_share': {'fade_out_voltage': -5.0}, unit: changes}  # type: ignore
                      if unit != 'torque_share' else {unit: changes})
    assert before == {name: dict(item.settings()) for name, item in emulator.units.items()}


class ConstantShare(Unit):
    """A torque share that asks for nothing, whatever flows."""

    inputs: ClassVar[tuple[str, ...]] = ('motor_1/current',)
    outputs: ClassVar[tuple[Signal, ...]] = wiring.OUTPUTS['torque_share']

    def start(self, step_s: float) -> FloatArray:
        """Give zero."""
        return np.zeros((2, 2))

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Give zero."""
        assert inputs.shape == (1, 2)
        return np.zeros((2, 2))


def test_a_unit_of_ones_own_takes_the_place_of_ours() -> None:
    drive = experiments()['T1'].drive()
    run = Emulator(drive, replaced={'torque_share': ConstantShare('torque_share')}).run(0.5)
    assert np.all(run['torque_share/bias_voltage'] == 0.0)
    assert np.any(run['motor_1/current'] != 0.0)
    # zero bias from a source, and Filter 1 with no gain, is the same drive
    muted = changed(drive, {'torque_share.filter_1.gain': 0.0})
    assert np.array_equal(simulate(muted, 0.5)['motor_1/current'], run['motor_1/current'])


class Ramp(Unit):
    """Test signals in plain Python: a command that grows, and no torque."""

    outputs: ClassVar[tuple[Signal, ...]] = wiring.OUTPUTS['test_signal']

    def start(self, step_s: float) -> FloatArray:
        """Begin at zero."""
        self._step_s = step_s
        return np.array([[0.0, 1e-3], [0.0, 0.0]])

    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """Give the command at t_k+1."""
        return np.array([[1e-3 * (k + 1) * self._step_s, 1e-3], [0.0, 0.0]])


def test_test_signals_of_ones_own_drive_the_compiled_loop_to_the_same_bits() -> None:
    drive = load('new_circuit')
    fast = Emulator(drive, replaced={'test_signal': Ramp('test_signal')}).run(0.3)
    slow = Emulator(drive, replaced={'test_signal': Ramp('test_signal')})
    rows = [slow.now, *(slow.step() for _ in range(300))]
    assert np.array_equal(fast.samples, np.array(rows))
    np.testing.assert_allclose(fast['test_signal/rate_command'], 1e-3 * fast.time, rtol=1e-12)


class Stray(ConstantShare):
    """A torque share that wants what nobody puts out."""

    inputs: ClassVar[tuple[str, ...]] = ('motor_3/current',)


def test_a_unit_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ParameterError, match='no unit puts out its input motor_3/current'):
        Emulator(load(), replaced={'torque_share': Stray('torque_share')})
    with pytest.raises(ParameterError, match='torqueshare: no such unit'):
        Emulator(load(), replaced={'torqueshare': Stray('torqueshare')})
    with pytest.raises(ParameterError, match='step_s'):
        Emulator(load(), 0.0)


def _symmetric(drive: Drive) -> Drive:
    rate = drive.test_signal.rate
    return replace(drive, test_signal=replace(drive.test_signal,
                                              rate=replace(rate, amplitude=-rate.amplitude)))


def test_the_mirrored_command_gives_the_mirrored_motion_with_the_motors_exchanged() -> None:
    drive = experiments()['T3b'].drive()
    run, mirrored = simulate(drive, 3.0), simulate(_symmetric(drive), 3.0)
    np.testing.assert_allclose(run['motor_1/current'], -mirrored['motor_2/current'], atol=1e-6)
    np.testing.assert_allclose(run['plant/axis_rate'], -mirrored['plant/axis_rate'], atol=1e-9)
    np.testing.assert_allclose(run['torque_share/bias_voltage'],
                               mirrored['torque_share/bias_voltage'], atol=1e-6)


def test_build_knows_the_units_of_the_wiring_alone() -> None:
    for name in wiring.UNITS:
        unit = build(name, load())
        assert unit.name == name
        assert unit.inputs == wiring.DRIVE.units[name].sources
        assert unit.outputs == wiring.OUTPUTS[name]
    with pytest.raises(KeyError):
        build('motor_3', load())


def test_a_longer_macro_step_still_integrates_the_fast_states() -> None:
    drive = experiments()['T4e'].drive()
    reference = simulate(drive, 2.0, FINE_STEP, every=160)
    coarse = simulate(drive, 2.0, 4e-3)
    difference = reference['motor_2/current'] - reference['motor_1/current']
    error = coarse['motor_2/current'] - coarse['motor_1/current'] - difference
    assert math.sqrt(np.mean(error ** 2) / np.mean(difference ** 2)) < 0.01


def test_a_run_shows_itself_in_two_lines() -> None:
    run = simulate(load(), 0.5, changes={7: {'torque_share': {'bias_pot': 0.5}}})
    for text in (repr(run), str(run)):
        assert len(text.splitlines()) == 2
        assert max(map(len, text.splitlines())) < 100
        assert '501 steps of 0.001 s kept from 0 to 0.5 s, live changes: 1' in text
        assert f'{len(run.names)} signals' in text and 'test_signal/rate_command, ' in text
