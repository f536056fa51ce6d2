# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The example's sixth unit in one process: compiled with the others, right, and in a batch too."""

from pathlib import Path
import shutil
import subprocess
import sys
from typing import Any

from antenna_drive.emulator import batch
from antenna_drive.emulator.run import Emulator, FINE_STEP, simulate
from antenna_drive.emulator.wiring import DRIVE, find, Wired, Wiring
from antenna_drive.parameters import load, ParameterError
from antenna_drive.parameters.records import record_of
from antenna_drive.parameters.sets import changed
from antenna_drive.physics.block import Interface, Signal
import numpy as np
import pytest
from scipy import integrate
from simgap.errors import UserError

PACKAGE = Path(__file__).parents[2] / 'examples' / 'own_position_loop'
TRACK: dict[int, dict[str, dict[str, Any]]] = {
    200: {'position_loop': {'angle': 1e-4, 'track_rate': 5e-5}},
    900: {'position_loop': {'proportional_gain': 2.0}, 'torque_share': {'bias_pot': 0.6}}}


@pytest.fixture
def pointed(monkeypatch: pytest.MonkeyPatch) -> Wiring:
    """Return the example's wiring."""
    monkeypatch.syspath_prepend(str(PACKAGE))
    return find('own_position_loop.wiring:POINTED')


def test_six_units_are_compiled_to_the_bits_of_single_steps(pointed: Wiring) -> None:
    drive = pointed.load('new_circuit')
    fast = Emulator(drive, wiring=pointed).run(1.5, TRACK)
    slow = Emulator(drive, wiring=pointed)
    rows = [slow.now]
    for k in range(1500):
        slow.tune(TRACK.get(k, {}))
        rows.append(slow.step())
    assert fast.names == (*DRIVE.signals, 'position_loop/rate_command',
                          'position_loop/angle_error')
    assert np.array_equal(fast.samples, np.array(rows))


def test_the_rate_command_is_a_proportional_and_an_integral_part(pointed: Wiring) -> None:
    drive = changed(pointed.load('new_circuit'), {
        'position_loop.angle': 3e-5, 'position_loop.track_rate': 2e-5})
    run = simulate(drive, 60.0, wiring=pointed)
    loop = drive.position_loop  # type: ignore[attr-defined]
    error = loop.angle + loop.track_rate * run.time - run['plant/encoder']
    np.testing.assert_allclose(run['position_loop/angle_error'], error, rtol=0.0, atol=1e-7)
    summed = integrate.cumulative_simpson(error, x=run.time, initial=0.0)
    expected = (loop.track_rate + loop.proportional_gain * error + loop.integral_gain * summed)
    # the loop knows the encoder of a macro-step ago, and extrapolates it
    np.testing.assert_allclose(run['position_loop/rate_command'], expected, rtol=0.0, atol=1e-7)
    assert np.ptp(expected) > 1e-5
    assert abs(error[-1]) < 0.1 * loop.angle
    assert np.array_equal(run['test_signal/rate_command'], np.zeros(run.time.size))


def test_at_its_limit_the_integral_stands_still(pointed: Wiring) -> None:
    drive = changed(pointed.load('new_circuit'), {
        'position_loop.angle': 0.01, 'position_loop.rate_limit': 1e-4})
    run = simulate(drive, 5.0, wiring=pointed)
    assert np.all(run['position_loop/rate_command'] == 1e-4)
    assert np.all(run.derivative('position_loop/rate_command')[1:] == 0.0)


def test_the_continuous_run_agrees_with_the_converged_lock_step(pointed: Wiring) -> None:
    drive = changed(pointed.load('new_circuit'), {
        'position_loop.angle': 3e-5, 'position_loop.track_rate': 5e-5})
    run = simulate(drive, 2.0, FINE_STEP, every=400, wiring=pointed)
    steps = np.zeros((1000, batch.COLUMNS))
    steps[:, batch.LENGTH] = 2e-3
    keep = np.where(np.arange(1001) % 5 == 0, np.arange(1001) // 5, -1)
    channels = ('plant/encoder', 'motor_2/ammeter', 'position_loop/rate_command')
    samples = batch.run(record_of(drive), batch.Schedule(steps, keep), pointed, channels)
    for column, name in enumerate(channels):
        size = np.sqrt(np.mean(run[name] ** 2))
        assert np.sqrt(np.mean((samples[:, column, 0] - run[name]) ** 2)) < 2e-3 * size


def test_units_that_feed_each_other_without_a_state_are_refused(pointed: Wiring) -> None:
    unit = pointed.units['position_loop']
    # a loop that follows its own command, value for value
    own = unit.fed(encoder='position_loop/rate_command')
    record = record_of(pointed.load())
    schedule = batch.Schedule(np.zeros((1, batch.COLUMNS)), np.zeros(2, np.int64))
    with pytest.raises(UserError, match='position_loop.*feed each other in a loop'):
        batch.run(record, schedule, pointed.plus(position_loop=own))


def test_a_wiring_that_does_not_fit_is_refused(pointed: Wiring) -> None:
    unit = pointed.units['position_loop']
    with pytest.raises(UserError, match='position_loop: the input encoder is fed by nothing'):
        DRIVE.plus(position_loop=Wired(unit.interface, ''))
    with pytest.raises(UserError, match='position_loop: the input angle does not exist'):
        DRIVE.plus(position_loop=unit.fed(angle='plant/axis_angle'))
    with pytest.raises(UserError, match='no unit puts out its input plant/angle'):
        DRIVE.plus(position_loop=unit.fed(encoder='plant/angle'))
    with pytest.raises(UserError, match='own_position_loop.wiring:POINTET: .*POINTET'):
        find('own_position_loop.wiring:POINTET')
    with pytest.raises(UserError, match='no_such_package'):
        find('no_such_package:WIRING')
    with pytest.raises(UserError, match='allowed is a Wiring'):
        find('own_position_loop.wiring:Path')


def test_a_unit_without_physics_has_to_be_given(pointed: Wiring) -> None:
    unit = pointed.units['position_loop']
    bare = Interface(kind=unit.interface.kind, outputs=(Signal('rate_command', 'rad/s', ''),))
    wiring = pointed.plus(position_loop=Wired(bare, ''))
    with pytest.raises(ParameterError, match='position_loop: has no physics of its own'):
        Emulator(pointed.load(), wiring=wiring)


def test_its_parameters_are_read_and_checked_like_ours(pointed: Wiring, tmp_path: Path) -> None:
    file = tmp_path / 'mine.yaml'
    file.write_text('position_loop: {integral_gain: 0.3}\ngearbox: {half_gap: 0.16}\n')
    drive = pointed.load(file)
    assert drive.position_loop.integral_gain == 0.3
    assert drive.position_loop.proportional_gain == 0.8
    assert drive.motor_1.gearbox.half_gap == 0.16
    with pytest.raises(ParameterError, match='position_loop: no such entry'):
        load(file)
    file.write_text('position_loop: {integral_gian: 0.3}\n')
    with pytest.raises(ParameterError, match='mine.yaml: position_loop.integral_gian'):
        pointed.load(file)


def test_a_change_of_the_sources_of_ones_own_unit_counts(tmp_path: Path) -> None:
    shutil.copytree(PACKAGE, tmp_path / 'copy')
    physics = tmp_path / 'copy' / 'own_position_loop' / 'physics.py'
    program = ('from antenna_drive.emulator.units import build\n'
               'from own_position_loop.wiring import POINTED\n'
               "unit = build('position_loop', POINTED.load(), {'angle': 2e-4}, POINTED)\n"
               'print(unit.start(1e-3)[0, 0])')

    def said() -> float:
        done = subprocess.run([sys.executable, '-c', program], cwd=tmp_path / 'copy', text=True,
                              capture_output=True, check=True)
        return float(done.stdout)

    assert said() == pytest.approx(0.8 * 2e-4)
    assert said() == pytest.approx(0.8 * 2e-4)
    text = physics.read_text()
    physics.write_text(text.replace('p.proportional_gain * _error', '2.0 * _error'))
    assert said() == pytest.approx(2.0 * 2e-4)
