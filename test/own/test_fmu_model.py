# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""An FMU as a machine: FMI 2 and 3, and what is told of mistakes."""

from __future__ import annotations

from pathlib import Path
import runpy
import shutil
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from simgap.model import check_model, load_model, Log, ModelError, OwnMachine

pytest.importorskip('fmpy', reason="fmpy is not installed, see the extra 'fmu'")
if not shutil.which('cc'):
    pytest.skip('a C compiler is needed to build the FMU', allow_module_level=True)

from fmpy.fmi1 import FMICallException  # noqa: E402, I100
from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402

FOLDER = Path(__file__).resolve().parents[2] / 'examples' / 'robot_joint_files'
BUILDER = runpy.run_path(str(FOLDER / 'build_fmu.py'))
YAML = (FOLDER / 'fmu.yaml').read_text()
POINTS = [{}, {'load': 2e-5, 'coulomb': -0.01}, {'gearbox.backlash.half_gap': 0.02}, {}]


@pytest.fixture(scope='module', params=[2, 3])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the FMU of the joint, of FMI 2 or 3."""
    made: Path = tmp_path_factory.mktemp(f'fmi{request.param}')
    BUILDER['build'](request.param, made)
    return made


def log_of(seconds: float = 0.6, begin: float = 0.0) -> Log:
    time = np.arange(0.0, seconds, 0.004)
    return Log('swing', time + begin, {
        'reference_rad': 0.3 * np.sin(20.0 * time) * (time > 0.1),
        'motor_rad': np.zeros(time.size), 'torque_Nm': np.zeros(time.size)})


def machine_of(folder: Path, yaml: str = YAML, begin: float = 0.0) -> OwnMachine:
    (folder / 'fmu.yaml').write_text(yaml)
    return OwnMachine(load_model(f'{folder}/fmu.yaml'), [log_of(begin=begin)])


def test_an_fmu_moves_as_the_same_joint_in_python(folder: Path) -> None:
    fmu, python = machine_of(folder), OwnMachine(load_model(f'{FOLDER}/machine.py'), [log_of()])
    for point in POINTS:
        found, expected = fmu.predict(point, 0), python.predict(point, 0)
        assert np.ptp(expected, axis=0).min() > 0.1
        np.testing.assert_allclose(found, expected, atol=2e-4)


def test_runs_leave_nothing_behind(folder: Path) -> None:
    machine = machine_of(folder)
    first, *others, again = [machine.predict(point, 0) for point in POINTS]
    np.testing.assert_array_equal(first, again)
    assert all(np.abs(first - other).max() > 1e-3 for other in others)


def test_an_fmu_that_cannot_be_reset_begins_as_another_instance(
        folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = machine_of(folder)
    expected = [machine.predict(point, 0) for point in POINTS]

    def refuses(slave: Any) -> None:
        raise FMICallException('reset', 3)

    for slave in (FMU2Slave, FMU3Slave):
        monkeypatch.setattr(slave, 'reset', refuses)
    for point, before in zip(POINTS, expected, strict=True):
        np.testing.assert_array_equal(machine.predict(point, 0), before)


def test_a_log_may_begin_at_any_time(folder: Path) -> None:
    early, late = (machine_of(folder, begin=begin).predict({}, 0) for begin in (0.0, 100.0))
    np.testing.assert_allclose(late, early, atol=1e-9)


def test_a_push_enters(folder: Path) -> None:
    machine = machine_of(folder)
    pushed = machine.simulate_disturbed({}, machine.disturbance_inputs[0], [np.ones_like])[0]
    assert np.abs(pushed - machine.predict({}, 0)).max() > 1e-3


def test_check_model_finds_nothing_wrong(folder: Path) -> None:
    assert check_model(machine_of(folder).model, [log_of()]).faults == []


@pytest.mark.parametrize(('old', 'new', 'words'), [
    ('sets: coulomb', 'sets: culomb', 'base.coulomb.sets: culomb: no such variable, did you mean '
     'coulomb?'),
    ('{reference: ', '{torque: ', 'inputs: torque: its causality is output, allowed is input'),
    ('into: push', 'into: reference', 'push.load: reference: a column of the log is fed into it'),
    ('  torque: {', '  torques: {', 'readings.torques: torques: no such variable'),
])
def test_a_name_that_the_fmu_lacks_is_told(old: str, new: str, words: str, folder: Path) -> None:
    yaml = YAML.replace('delays: reference', 'delays: torque') if 'torque: ' in new else YAML
    with pytest.raises(ModelError) as refusal:
        machine_of(folder, yaml.replace(old, new, 1))
    assert str(refusal.value).startswith(f'{folder}/fmu.yaml: ')
    assert words in str(refusal.value)


def changed(folder: Path, into: Path, old: str, new: str) -> Path:
    """Copy the FMU with another modelDescription.xml."""
    with ZipFile(folder / 'joint.fmu') as archive, ZipFile(into / 'joint.fmu', 'w') as other:
        for name in archive.namelist():
            data = archive.read(name)
            if name == 'modelDescription.xml':
                assert old in data.decode()
                data = data.decode().replace(old, new).encode()
            other.writestr(name, data)
    return into


@pytest.mark.parametrize(('old', 'new', 'words'), [
    ('<CoSimulation ', '<ModelExchange ', 'for model exchange given, allowed is FMI 2 or 3'),
    ('modelIdentifier="joint"', 'modelIdentifier="joints"', 'Cannot find shared library'),
    ('<ModelVariables>', '<ModelVariable>', 'no FMU that can be read'),
])
def test_an_fmu_that_cannot_serve_is_told(old: str, new: str, words: str, folder: Path,
                                          tmp_path: Path) -> None:
    with pytest.raises(ModelError) as refusal:
        machine_of(changed(folder, tmp_path, old, new))
    assert str(refusal.value).startswith(f'{tmp_path}/fmu.yaml: ')
    assert words in str(refusal.value)


def test_what_is_no_archive_is_told(tmp_path: Path) -> None:
    (tmp_path / 'joint.fmu').write_text('no archive')
    with pytest.raises(ModelError, match='joint.fmu: no FMU that can be read'):
        machine_of(tmp_path)


def test_a_run_that_fails_ends_in_no_number(folder: Path, tmp_path: Path) -> None:
    """The FMU refuses to set an output, here in the place of a parameter."""
    broken = changed(folder, tmp_path, 'name="coulomb" valueReference="3"',
                     'name="coulomb" valueReference="8"')
    assert np.isnan(machine_of(broken).predict({}, 0)).all()
