# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""One joint in Python, as a MuJoCo model and as FMUs: the same motion and the same verdict."""

from __future__ import annotations

from pathlib import Path
import runpy
import shutil
from typing import Any

import numpy as np
import pytest
from simgap.model import diagnose_logs, load_model, Log, Model, OwnMachine

pytest.importorskip('mujoco', reason="mujoco is not installed, see the extra 'mujoco'")
pytest.importorskip('fmpy', reason="fmpy is not installed, see the extra 'fmu'")
if not shutil.which('cc'):
    pytest.skip('a C compiler is needed to build the FMU', allow_module_level=True)

FOLDER = Path(__file__).resolve().parents[2] / 'examples' / 'robot_joint_files'
MAKER = runpy.run_path(str(FOLDER / 'make_logs.py'))
BUILDER = runpy.run_path(str(FOLDER / 'build_fmu.py'))
# What was asked for: how far the probabilities of two models may be apart.
APART = 0.05
TRUE = {'load': 1e-5, 'coulomb': -5e-3, 'viscous': 2e-4}


@pytest.fixture(scope='module')
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Model]:
    """Return the joint in each way; the first one is Python."""
    made = {'python': load_model(f'{FOLDER}/machine.py'),
            'mujoco': load_model(f'{FOLDER}/mujoco.yaml')}
    for version in (2, 3):
        folder = tmp_path_factory.mktemp(f'fmi{version}')
        BUILDER['build'](version, folder)
        shutil.copy(FOLDER / 'fmu.yaml', folder)
        made[f'fmi {version}'] = load_model(f'{folder}/fmu.yaml')
    return made


def logs_of(fault: str) -> list[Log]:
    made = []
    for seed, name in enumerate(('steps', 'sweep')):
        rows: Any = MAKER['log_of'](MAKER[name], MAKER['FAULTS'][fault], seed)
        made.append(Log(name, rows[:, 0], {'reference_rad': rows[:, 1], 'motor_rad': rows[:, 2],
                                           'torque_Nm': rows[:, 3]}))
    return made


@pytest.mark.parametrize(('fault', 'effect'), [
    ('nothing', {}), ('compliance', {'gearbox.compliance.compliance': 0.3}),
    ('backlash', {'gearbox.backlash.half_gap': 0.04}),
    ('load_friction', {'load.friction.load_friction': 0.02}),
    ('delay', {'controller.delay.delay': 0.004})])
def test_with_the_true_numbers_each_way_leaves_the_noise(
        fault: str, effect: dict[str, float], models: dict[str, Model]) -> None:
    """Within a tenth of the rms of the noise, of a log from another integrator."""
    logs = logs_of(fault)
    for model in models.values():
        machine = OwnMachine(model, logs)
        for k, experiment in enumerate(machine.experiments):
            left = (experiment.measured - machine.predict({**TRUE, **effect}, k)
                    ) / experiment.noise
            np.testing.assert_allclose(np.sqrt(np.mean(left ** 2, axis=0)), 1.0, atol=0.1)


@pytest.mark.trial
@pytest.mark.timeout(1200)
@pytest.mark.parametrize('fault', MAKER['FAULTS'])
def test_the_verdict_is_the_same_in_each_way(fault: str, models: dict[str, Model]) -> None:
    """The probabilities agree, and so does what is likeliest; the page has those in Python."""
    logs = logs_of(fault)
    found = {}
    for way, model in models.items():
        which = diagnose_logs(model, logs).as_data()['which']
        found[way] = {'+'.join(item['effects']): item['probability'] for item in which}
    for probabilities in found.values():
        assert max(probabilities, key=lambda name: probabilities[name]) == max(
            found['python'], key=lambda name: found['python'][name])
        for effect in {*probabilities, *found['python']}:
            assert abs(probabilities.get(effect, 0.0)
                       - found['python'].get(effect, 0.0)) < APART
