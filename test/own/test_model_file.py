# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Model files: what they say of numbers, readings and effects, and what is told of mistakes."""

from __future__ import annotations

from pathlib import Path
import sys

from antenna_drive.cli import main
import numpy as np
import pytest
from simgap.machine.contract import FloatArray
from simgap.model import load_model, Log, model_file, ModelError, OwnMachine
from simgap.model.simulator import Ports

TEXT = """\
mujoco: any.xml
inputs: {force: force_N}
starts: {begin: angle_rad}
constants: {mass: mass}
base:
  level: {share: 0.1, unit: N, sets: stiffness}
  free_one: {free: [0.0, 4.0], start: 1.0, sets: {left: -1.0, right: 2.0}}
per_test:
  offset: {known: 0.5, adds: begin}
readings:
  first: {from: stiffness, unit: rad, noise: 0.1, column: angle_rad}
  force: {from: force, unit: N, noise: 0.1, column: angle_rad}
effects:
  shaft.twist:
    cause: it twists
    numbers: {twist: {size: [0.0, 1.0], adds_to_inverse: stiffness}}
  shaft.grows: {simpler: shaft.twist, numbers: {grows: {size: [-1.0, 1.0], scales: stiffness}}}
  bus.delay: {numbers: {delay: {size: [0.0, 1.0], unit: s, step: 0.01, delays: force}}}
push:
  load: {label: a push, unit: N, size: 2.0}
settles_s: 0.1
blocks: [bus, shaft]
"""
LOG = Log('test', np.arange(0.0, 1.0, 0.1), {
    'force_N': np.arange(10.0), 'angle_rad': np.full(10, 0.25)}, {'mass': 3.0})


class StandIn:
    """Gives back what a model file lets a simulation program do; it simulates nothing."""

    parallel = True
    longest_step_s = 0.05
    START = 10.0

    def __init__(self, path: Path, ports: Ports) -> None:
        """Let every place have the same value in the program's own file."""
        self.ports = ports
        self.defaults = np.full(len(ports.places), self.START)
        self.values: dict[str, float] = {}

    def run(self, values: FloatArray, start_s: float, step_s: float,
            inputs: FloatArray) -> FloatArray:
        """Return places and inputs as they were given, by the outputs' names."""
        self.values = dict(zip(self.ports.places, values, strict=True))
        given = dict(zip([*self.ports.inputs, *self.ports.pushes], inputs.T, strict=True))
        return np.column_stack([given.get(name, np.full(len(inputs), self.values.get(name, 0.0)))
                                for name in self.ports.outputs])


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> list[StandIn]:
    made: list[StandIn] = []

    def simulator(program: str, path: Path, ports: Ports) -> StandIn:
        made.append(StandIn(path, ports))
        return made[-1]

    monkeypatch.setattr(model_file, '_simulator', simulator)
    return made


def machine_of(folder: Path, text: str = TEXT) -> OwnMachine:
    (folder / 'm.yaml').write_text(text)
    return OwnMachine(load_model(f'{folder}/m.yaml'), [LOG])


def test_numbers_act_on_readings_and_inputs_and_waves_on_places(
        stand_in: list[StandIn], tmp_path: Path) -> None:
    machine = machine_of(tmp_path, TEXT.replace('  force: {from', '  told: {from').replace(
        'push:', '  sensor.error: {numbers: {error: {size: [-1.0, 1.0], adds: {first: 1.0, '
        'force: 2.0}}}}\n  sensor.gain: {numbers: {gain: {size: [-1.0, 1.0], scales: told}}}\n'
        '  motor.wave: {ripple: {size: [-1.0, 1.0], angle: angle_rad, orders: [3], into: wave}}\n'
        'push:'))
    plain = machine.predict({}, 0)
    np.testing.assert_allclose(machine.predict({'sensor.error.error': 0.5}, 0) - plain,
                               np.tile([0.5, 1.0], (10, 1)))
    np.testing.assert_allclose(machine.predict({'sensor.gain.gain': 0.5}, 0),
                               plain * [1.0, 1.5])
    machine.predict({'motor.wave.motor_wave_sine@3': 0.25}, 0)
    values = stand_in[-1].values
    assert [values[f'wave_{part}'] for part in ('order', 'cosine', 'sine')] == [3.0, 0.0, 0.25]


def test_numbers_effects_and_readings_are_those_of_a_declaration(
        tmp_path: Path, stand_in: list[StandIn]) -> None:
    model = machine_of(tmp_path).model
    # what the file of the program says is known within the share
    assert (model.base['level'].value, model.base['level'].high) == (10.0, 11.0)
    assert model.base['level'].sigma == pytest.approx(0.5)
    assert (model.base['free_one'].value, model.base['free_one'].high) == (1.0, 4.0)
    assert model.per_test['offset'].is_known
    assert [item.name for item in model.effects] == ['shaft.twist', 'shaft.grows', 'bus.delay']
    assert model.effects[0].cause == 'it twists'
    assert [item.simpler for item in model.effects] == ['', 'shaft.twist', '']
    assert model.readings['first'].unit == 'rad'
    assert model.push['load'].size == 2.0
    assert (model.settles_s, model.blocks, model.parallel) == (0.1, ('bus', 'shaft'), True)
    restless = machine_of(tmp_path, TEXT.replace('share: 0.1', 'share: 0.1, spread: 0.3'))
    assert [own.model.base['level'].spread for own in (machine_of(tmp_path), restless)] == [
        0.0, 0.3]


def test_each_number_does_what_it_says(tmp_path: Path, stand_in: list[StandIn]) -> None:
    machine = machine_of(tmp_path)
    machine.predict({'level': 0.5, 'free_one': 2.0}, 0)
    assert stand_in[0].values == pytest.approx({
        'stiffness': 10.5, 'left': -3.0, 'right': 6.0, 'begin': 0.75, 'mass': 3.0})
    machine.predict({'shaft.twist.twist': 0.4}, 0)
    assert stand_in[0].values['stiffness'] == pytest.approx(1.0 / (1.0 / 10.0 + 0.4))
    # a share first, then the compliance in series
    machine.predict({'shaft.twist.twist': 0.4, 'shaft.grows.grows': -0.5}, 0)
    assert stand_in[0].values['stiffness'] == pytest.approx(1.0 / (1.0 / 5.0 + 0.4))


def test_an_input_is_held_and_late(tmp_path: Path, stand_in: list[StandIn]) -> None:
    machine = machine_of(tmp_path)
    np.testing.assert_allclose(machine.predict({}, 0)[:, 1], np.arange(10.0))
    # the steps are half a sample; a quarter of a step mixes one value with the one before
    late = machine.predict({'bus.delay.delay': 0.1125}, 0)[:, 1]
    np.testing.assert_allclose(late[2:], np.arange(1.0, 9.0) - 0.25, atol=1e-9)
    assert late[0] == 0.0


def test_a_push_is_fed_in(tmp_path: Path, stand_in: list[StandIn]) -> None:
    machine = machine_of(tmp_path, TEXT.replace('from: force,', 'from: load,'))
    place, = machine.disturbance_inputs
    found = machine.simulate_disturbed({}, place, [lambda time: time])[0]
    np.testing.assert_allclose(found[:, 1], 2.0 * LOG.time)


@pytest.mark.parametrize(('old', 'new', 'words'), [
    ('mujoco: any.xml', '', 'give one of mujoco and fmu'),
    ('inputs:', 'input:', 'input: no such entry, did you mean inputs'),
    ('share: 0.1, ', '', 'base.level: nothing given, allowed is one of known, share, by, free'),
    ('share: 0.1, ', 'share: 0.1, known: 2.0, ', 'base.level: known and share given'),
    ('share: 0.1', 'share: 1e-', "base.level.share: '1e-' given, allowed is a number"),
    (', sets: stiffness', '', 'base.level: give one of sets'),
    ('known: 0.5, adds: begin', 'known: 0.5, sets: left', 'per_test.offset.sets: left: '
     'base.free_one.sets sets it'),
    ('delays: force', 'delays: forse', 'effects.bus.delay.numbers.delay.delays: forse is no inp'),
    ('free: [0.0, 4.0]', 'free: [0.0]', 'base.free_one.free: '),
    ('start: 1.0', 'start: 9.0', 'base: free_one: 9 given, allowed is 0 to 4'),
    ('noise: 0.1, ', '', 'readings.first: noise: none is given'),
    ('size: [-1.0', 'shape: [-1.0', 'effects.shaft.grows.numbers.grows.start: None given'),
    ('size: 2.0', 'size: 0.0', 'push.load.size: 0.0 given'),
    ('size: [0.0, 1.0], adds', 'known: 2.0, adds', 'twist: known given, allowed is one of size'),
    ('blocks: [bus, shaft]', 'blocks: bus', "blocks: 'bus' given, allowed is a list"),
    ('settles_s: 0.1', 'settles_s: [', 'line 2'),
])
def test_a_mistake_is_told_with_file_and_entry(old: str, new: str, words: str, tmp_path: Path,
                                               stand_in: list[StandIn]) -> None:
    assert old in TEXT
    with pytest.raises(ModelError) as refusal:
        machine_of(tmp_path, TEXT.replace(old, new, 1))
    assert str(refusal.value).startswith(f'{tmp_path}/m.yaml: ')
    assert words in str(refusal.value)
    assert str(refusal.value).count(str(tmp_path)) == 1


def test_a_constant_that_the_sheet_lacks_is_told(tmp_path: Path,
                                                 stand_in: list[StandIn]) -> None:
    machine = machine_of(tmp_path, TEXT.replace('constants: {mass: mass}',
                                                'constants: {mass: weight}'))
    with pytest.raises(ModelError, match='test: constants: weight: not in the sheet'):
        machine.predict({}, 0)


def test_a_stiffness_of_nothing_has_no_compliance(tmp_path: Path,
                                                  stand_in: list[StandIn]) -> None:
    machine = machine_of(tmp_path)
    with pytest.raises(ModelError, match='twist.adds_to_inverse: stiffness: it is 0'):
        machine.predict({'level': -10.0}, 0)


def test_a_number_adds_only_to_what_has_a_value(tmp_path: Path, stand_in: list[StandIn],
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StandIn, 'START', np.nan)
    with pytest.raises(ModelError, match='grows.scales: other: any.xml gives it no value'):
        machine_of(tmp_path, TEXT.replace('scales: stiffness', 'scales: other').replace(
            'share: 0.1', 'value: 10.0, share: 0.1'))


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match='mujoco: .*any.xml: no such file'):
        machine_of(tmp_path)
    with pytest.raises(ModelError, match='none.yaml: No such file'):
        load_model(f'{tmp_path}/none.yaml')


@pytest.mark.parametrize(('program', 'package'), [('mujoco', 'mujoco'), ('fmu', 'fmpy')])
def test_a_missing_package_is_told_with_its_remedy(
        program: str, package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(sys.modules, f'simgap.model.{program}_model',
                        raising=False)
    (tmp_path / 'any.xml').write_text('')
    (tmp_path / 'm.yaml').write_text(TEXT.replace('mujoco:', f'{program}:'))
    assert main(['check-model', f'{tmp_path}/m.yaml', f'{tmp_path}/a.csv']) == 3
    error = capsys.readouterr().err
    assert f'needs {package}: pip install {package}' in error
    assert error.count('\n') == 1
