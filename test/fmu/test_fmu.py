# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive as an FMU, in programs of others: valid, and the emulator's own bits."""

from __future__ import annotations

from collections.abc import Mapping
import json
import math
import os
from pathlib import Path
import shutil
import subprocess
import sys
import sysconfig
from typing import Any
from xml.etree import ElementTree
from zipfile import ZipFile

from antenna_drive import cli
from antenna_drive.article.experiments import DriveExperiment
from antenna_drive.article.measures import Results, with_circuits
from antenna_drive.article.published import rows
from antenna_drive.emulator.run import Run, simulate
from antenna_drive.emulator.units import build, home
from antenna_drive.emulator.wiring import DRIVE
from antenna_drive.fmu.effects import numbers, with_effects
from antenna_drive.fmu.stepped import SteppedDrive
from antenna_drive.parameters import load, ParameterError
from antenna_drive.parameters.sets import changed, Drive
from installations import ROOT
import numpy as np
import pytest
from simgap.command.programs import BAD_INPUT, NOT_INSTALLED, OK

STEP = 1e-3
NAMES = [name.replace('/', '.') for name in DRIVE.signals]
COMMANDS = ('rate_command', 'external_torque')
# A motion with reversals, so that gaps open and rotors stick.
MOTION = {'test_signal.rate.waveform': 'saw_tooth', 'test_signal.rate.amplitude': 0.01,
          'test_signal.rate.period': 0.5, 'test_signal.torque.waveform': 'sine',
          'test_signal.torque.amplitude': 2e4, 'test_signal.torque.period': 0.3}
# Importers: each makes 300 steps and tells what it reads after each.
COSIM = """
import json, os, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

path, target, outputs, starts = *sys.argv[1:3], *map(json.loads, sys.argv[3:])
execution = CosimExecution.from_step_size(step_size=1_000_000)  # [ns]
drive = execution.add_local_slave(CosimLocalSlave(path, 'drive'))
for number, value in starts.items():
    put = execution.string_initial_value if isinstance(
        value, str) else execution.real_initial_value
    assert put(drive, int(number), value)
observer = CosimObserver.create_last_value()
assert execution.add_observer(observer)
with open(target, 'w') as stream:
    for k in range(1, 301):
        assert execution.simulate_until(target_time=k * 1_000_000)
        print(json.dumps(observer.last_real_values(drive, outputs)), file=stream)
os._exit(0)
"""
HOST = r"""
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
static void logged(void *e, const char *n, int s, const char *c, const char *told, ...) {
    fprintf(stderr, "%s\n", told);
}
int main(int count, char **given) {
    void *fmu = dlopen(given[1], RTLD_NOW);
    if (!fmu) return fprintf(stderr, "%s\n", dlerror());
    void *(*begin)(const char *, int, const char *, const char *, const void *, int, int)
        = dlsym(fmu, "fmi2Instantiate");
    int (*set_up)(void *, int, double, double, int, double) = dlsym(fmu, "fmi2SetupExperiment");
    int (*enter)(void *) = dlsym(fmu, "fmi2EnterInitializationMode");
    int (*leave)(void *) = dlsym(fmu, "fmi2ExitInitializationMode");
    int (*set)(void *, const unsigned *, size_t, const double *) = dlsym(fmu, "fmi2SetReal");
    int (*get)(void *, const unsigned *, size_t, double *) = dlsym(fmu, "fmi2GetReal");
    int (*step)(void *, double, double, int) = dlsym(fmu, "fmi2DoStep");
    int (*terminate)(void *) = dlsym(fmu, "fmi2Terminate");
    void (*release)(void *) = dlsym(fmu, "fmi2FreeInstance");
    struct { void *told, *allocate, *release, *stepped, *own; } calls = {logged, calloc, free};
    void *drive = begin("drive", 1, given[2], given[3], &calls, 0, 1);
    unsigned input = atoi(given[4]), output = atoi(given[5]);
    double value = 5e-3;
    if (!drive || set_up(drive, 0, 0.0, 0.0, 0, 0.0) || enter(drive) || leave(drive)
        || set(drive, &input, 1, &value)) return 2;
    for (int k = 0; k < 300; k++) {
        if (step(drive, 1e-3 * k, 1e-3, 1) || get(drive, &output, 1, &value)) return 3;
        printf("%a\n", value);
    }
    if (terminate(drive)) return 4;
    release(drive);
    return dlclose(fmu);
}
"""


def moving(**changes: Any) -> Drive:
    """Return the reference drive in motion; names of changes have __ for each dot."""
    return changed(load(), {**MOTION, **{
        name.replace('__', '.'): value for name, value in changes.items()}})


def starts(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings, by dotted name in `Drive`, as an importer sets them."""
    return {f'parameters.{".".join(home(path))}': value for path, value in settings.items()}


@pytest.fixture(scope='module', params=[2, 3])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the FMU of the reference drive with the article's new circuit, of FMI 2 or 3."""
    pytest.importorskip('fmpy', reason="fmpy is not installed, see the extra 'fmu'")
    return written(tmp_path_factory.mktemp('fmu'), request.param, '--config', 'new_circuit')


def written(folder: Path, fmi: int, *options: str) -> Path:
    pytest.importorskip('pythonfmu', reason="pythonfmu is not installed, see the extra 'fmu'")
    path = folder / f'drive{fmi}.fmu'
    assert cli.main(['fmu', str(path), '--fmi', str(fmi), *options]) == OK
    return path


def simulated(path: Path, seconds: float, settings: Mapping[str, Any] | None = None,
              **options: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the signals of a run in FMPy, shape (steps + 1, signals)."""
    from fmpy import simulate_fmu
    found = simulate_fmu(str(path), stop_time=seconds, output=NAMES, start_values=settings or {},
                         **{'output_interval': STEP, **options})
    return np.array([found[name] for name in NAMES]).T


@pytest.mark.slow
def test_it_is_valid(fmu: Path) -> None:
    from fmpy.validation import validate_fmu
    assert validate_fmu(str(fmu)) == []


def test_every_setting_and_every_effect_is_a_parameter(fmu: Path) -> None:
    """Each has unit, range, description and the very value that the configuration has."""
    from fmpy import read_model_description
    described = read_model_description(str(fmu))
    units = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    known = {item.name: item for item in described.modelVariables}
    assert set(NAMES) == {name for name, item in known.items() if item.causality == 'output'}
    wanted = {f'parameters.{unit}.{name}': found for unit in DRIVE.units
              for name, found in build(unit, load('new_circuit')).settings().items()}
    wanted |= {f'effects.{name}': found for name, found in numbers().items()}
    assert len(wanted) > 350
    for name, (entry, value) in wanted.items():
        several = isinstance(value, tuple)
        for i, part in enumerate(value if isinstance(value, tuple) else (value,), 1):
            item = known.pop(f'{name}[{i}]' if several else name)
            assert item.causality == 'parameter' and item.description.startswith(entry.description)
            assert item.variability == ('tunable' if entry.live else 'fixed')
            assert item.start == part if entry.choices else float(item.start) == part
            assert entry.choices or item.unit in units and float(item.min) == entry.low
    assert not [name for name, item in known.items() if item.causality == 'parameter']
    stiffness = units['N m/rad']
    assert (stiffness.kg, stiffness.m, stiffness.s, stiffness.rad) == (1, 2, -2, -1)
    assert units['article A'] is None  # which is no ampere
    assert known['rate_command'].unit == 'rad/s' and known['external_torque'].unit == 'N m'


@pytest.mark.slow
def test_the_articles_saw_tooth(fmu: Path) -> None:
    """T3b gives the published figures, and every sample of our own run."""
    def run(experiment: DriveExperiment, drive: Drive) -> Run:
        own = simulate(drive, experiment.duration)
        found = simulated(fmu, experiment.duration, starts(experiment.settings))
        np.testing.assert_array_equal(found, own.samples[:, :, 0])
        return Run(STEP, own.steps, own.names, np.stack([found, own.samples[:, :, 1]], axis=2))

    compared = rows(Results(with_circuits(), run=run), ['T3b'])
    assert len(compared) >= 3 and all(row.passed for row in compared), compared


def test_commands_from_outside(fmu: Path) -> None:
    """What is given as inputs with their slopes moves the drive as the test signal does."""
    own = simulate(changed(load('new_circuit'), MOTION), 0.6)
    given = {'time': np.arange(601) * STEP}
    for name in COMMANDS:
        given[name] = own[f'test_signal/{name}']
        given[f'{name}_slope'] = own.derivative(f'test_signal/{name}')
    table = np.empty(601, [(name, float) for name in given])
    for name, values in given.items():
        table[name] = values
    found = simulated(fmu, 0.6, input=table)
    np.testing.assert_array_equal(found[:, 2:], own.samples[:, 2:, 0])
    # within a longer step they are held by their slopes, which is exact but for the corners
    longer = simulated(fmu, 0.6, input=table, output_interval=0.005)
    reached = np.ptp(own.samples[:, 2:, 0], axis=0)
    assert (np.abs(longer - found[::5])[:, 2:] < 0.05 * reached).all()


def test_a_late_command_from_outside() -> None:
    own = simulate(moving(test_signal__delay=0.0404), 0.5)
    clear = simulate(moving(), 0.5)
    late = SteppedDrive(load(), STEP)
    late.set('effects.loop.delay.time', 0.0404)
    for k in range(500):
        for row, name in enumerate(COMMANDS):
            late.set(name, clear.samples[k, row, 0])
            late.set(f'{name}_slope', clear.samples[k, row, 1])
        late.step(STEP)
    found = np.array([late.get(name) for name in NAMES], float)
    off = np.abs(found - own.samples[-1, :, 0])
    assert (off < 1e-3 * np.ptp(own.samples[:, :, 0], axis=0)).all()


def test_a_parameter_turned_while_it_runs(fmu: Path) -> None:
    own = simulate(changed(load('new_circuit'), MOTION), 0.6, changes={
        300: {'torque_share': {'bias_pot': 0.4, 'filter_1.gain': 9.0}}})
    table = np.empty(3, [(name, float) for name in (
        'time', 'parameters.torque_share.bias_pot', 'parameters.torque_share.filter_1.gain')])
    circuit = load('new_circuit').torque_share
    table[:] = [(0.0, circuit.circuit.bias_pot, circuit.filter_1.gain), (0.3, 0.4, 9.0),
                (0.6, 0.4, 9.0)]
    np.testing.assert_array_equal(
        simulated(fmu, 0.6, starts(MOTION), input=table), own.samples[:, :, 0])


@pytest.mark.parametrize('effects, changes', [
    ({'gearbox_1.gap.change': 0.5}, {'motor_1.gearbox.half_gap': 0.148 * 1.5}),
    ({'motor_2.viscous_friction.torque_per_rate': 0.02,
      'motor_2.viscous_friction.flow_index': 0.7},
     {'motor_2.motor.viscous_friction': 0.02, 'motor_2.motor.flow_index': 0.7}),
    ({'motors.torque_ripple.sine': 0.3, 'motors.torque_ripple.cosine': 0.4,
      'motors.torque_ripple.cycles': 12.0},
     {f'motor_{m}.motor.torque_ripple{end}': value for m in (1, 2) for end, value in {
         '': 0.5, '_cycles': 12.0, '_phase': math.atan2(0.4, 0.3)}.items()}),
    ({'axis.extra_mode.inertia': 1e6, 'axis.extra_mode.frequency': 9.0,
      'axis.extra_mode.damping': 0.02},
     {'plant.axis.mode_inertias': (2.82e6, 1.55e6, 0.99e6, 1e6),
      'plant.axis.mode_frequencies': (2.2, 3.7, 5.6, 9.0),
      'plant.axis.mode_damping_ratios': (0.01, 0.01, 0.01, 0.02),
      'plant.axis.pointing_elevation': (1.0, 0.6, 0.3, 0.0),
      'plant.axis.pointing_cross_elevation': (0.1, -0.2, 0.3, 0.0)}),
    ({'encoder.quantisation.step': 1e-3}, {'plant.encoder.step': 1e-3}),
    ({'loop.delay.time': 0.05}, {'test_signal.delay': 0.05})])
def test_an_effect(fmu: Path, effects: Mapping[str, float], changes: Mapping[str, Any]) -> None:
    own = simulate(changed(load('new_circuit'), {**MOTION, **changes}), 0.4)
    found = simulated(fmu, 0.4, {**starts(MOTION), **{
        f'effects.{name}': value for name, value in effects.items()}})
    np.testing.assert_array_equal(found, own.samples[:, :, 0])
    without = simulate(changed(load('new_circuit'), MOTION), 0.4)
    assert not np.array_equal(found, without.samples[:, :, 0])


def test_every_size_of_every_effect_acts() -> None:
    """Alone it makes another drive; none of them makes the drive as it is."""
    known, drive = numbers(), load()
    neutral = {name: start for name, (_, start) in known.items()}
    assert with_effects(drive, neutral) == drive
    sizes = [name for name, start in neutral.items() if start == 0.0 and not name.endswith(
        ('cycles_change', 'second_sine', 'second_cosine', 'third_sine', 'third_cosine'))]
    assert len({name.rpartition('.')[0] for name in sizes}) == 75
    for name in sizes:
        half = 0.5 * known[name][0].high
        assert with_effects(drive, {**neutral, name: half}) != drive, name


def test_two_of_them_in_one_program_do_not_mix(fmu: Path, tmp_path: Path) -> None:
    (tmp_path / 'other.yaml').write_text('gearbox: {half_gap: 0.2}\n')
    other = written(tmp_path, 2, '--config', str(tmp_path / 'other.yaml'))
    own = simulate(moving(motor_1__gearbox__half_gap=0.2, motor_2__gearbox__half_gap=0.2), 0.2)
    first = simulated(fmu, 0.2, starts(MOTION))
    np.testing.assert_array_equal(simulated(other, 0.2, starts(MOTION)), own.samples[:, :, 0])
    np.testing.assert_array_equal(simulated(fmu, 0.2, starts(MOTION)), first)


def test_a_second_importer(tmp_path: Path) -> None:
    """The libcosim of the Open Simulation Platform, in C++ with the FMI Library: FMI 2."""
    pytest.importorskip('libcosimpy', reason='libcosimpy is not installed')
    path = written(tmp_path, 2)
    number = numbers_of(path)
    done = subprocess.run(
        [sys.executable, '-c', COSIM, path, tmp_path / 'read',
         json.dumps([number[name] for name in NAMES]),
         json.dumps({number[name]: value for name, value in starts(MOTION).items()})],
        capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = [json.loads(line) for line in (tmp_path / 'read').read_text().splitlines()]
    np.testing.assert_array_equal(found, simulate(moving(), 0.3).samples[1:, :, 0])


def numbers_of(path: Path) -> dict[str, int]:
    """Return the value references of an FMU of FMI 2 by name."""
    with ZipFile(path) as archive, archive.open('modelDescription.xml') as text:
        return {item.attrib['name']: int(item.attrib['valueReference'])
                for item in ElementTree.parse(text).iter('ScalarVariable')}


def test_a_program_without_python(tmp_path: Path) -> None:
    """A program in C finds Python by its environment, and gets the same bits: FMI 2."""
    python = Path(sysconfig.get_config_var('LIBDIR'), sysconfig.get_config_var('INSTSONAME') or '')
    if not shutil.which('cc') or not python.is_file():
        pytest.skip('a C compiler and a Python with a shared library are needed')
    with ZipFile(written(tmp_path, 2)) as archive:
        archive.extractall(tmp_path)
    number = numbers_of(tmp_path / 'drive2.fmu')
    token = ElementTree.parse(tmp_path / 'modelDescription.xml').getroot().attrib['guid']
    (tmp_path / 'host.c').write_text(HOST)
    subprocess.run(['cc', 'host.c', '-o', 'host', '-ldl'], cwd=tmp_path, check=True)
    done = subprocess.run(
        [tmp_path / 'host', tmp_path / 'binaries' / 'linux64' / 'AntennaDrive.so',
         token, (tmp_path / 'resources').as_uri(), str(number['rate_command']),
         str(number['plant.axis_rate'])],
        env={**os.environ, 'LD_PRELOAD': str(python), 'PYTHONHOME': sys.base_prefix,
             'PYTHONPATH': os.pathsep.join((str(ROOT), sysconfig.get_path('purelib')))},
        capture_output=True, text=True)
    own = simulate(moving(test_signal__rate__waveform='external', test_signal__rate__external=5e-3,
                          test_signal__torque__waveform='zero'), 0.3)
    assert done.returncode == 0, done.stdout + done.stderr
    assert [*map(float.fromhex, done.stdout.split())] == own['plant/axis_rate'][1:].tolist()


def test_what_is_fixed_while_it_runs() -> None:
    drive = SteppedDrive(load(), STEP)
    drive.set('parameters.plant.inertia_hub', 9e6)
    drive.step(STEP)
    drive.set('parameters.plant.inertia_hub', 9e6)  # an importer may repeat what it has set
    with pytest.raises(ParameterError, match='parameters.plant.inertia_hub: fixed while'):
        drive.set('parameters.plant.inertia_hub', 8e6)


def run_elsewhere(text: str) -> list[str]:
    """Return what a Python says on standard error; an FMU that has failed may spoil its end."""
    done = subprocess.run([sys.executable, '-c', text], capture_output=True, text=True)
    assert done.returncode, done.stdout
    return done.stderr.splitlines()


@pytest.mark.parametrize('options, said', [
    ("start_values={'parameters.torque_share.bias_pot': 3.0}",
     'parameters.torque_share.bias_pot: 3.0 given, allowed is a number from 0 to 1'),
    ("start_values={'parameters.test_signal.waveform': 'triangle'}",
     "parameters.test_signal.waveform: 'triangle' given, allowed is one of zero, square"),
    ('output_interval=0.0015', 'allowed are whole multiples of the macro-step, 0.001 s')])
def test_what_is_not_allowed(fmu: Path, options: str, said: str) -> None:
    told = [line for line in run_elsewhere(
        f'import fmpy\nfmpy.simulate_fmu({str(fmu)!r}, stop_time=0.01, {options})')
        if line.startswith('antenna_drive: ')]
    assert len(told) == 1 and said in told[0], told


def test_a_python_without_the_drive(fmu: Path) -> None:
    """The FMU says in a line what it needs."""
    told = [line for line in run_elsewhere(
        'import sys\nsys.modules["antenna_drive"] = None\nimport fmpy\n'
        f'fmpy.simulate_fmu({str(fmu)!r}, stop_time=0.01)') if line.startswith('this FMU needs')]
    assert len(told) == 1
    assert f'needs antenna_drive in the Python that runs it, {sys.executable}' in told[0]


@pytest.mark.parametrize('name, options, said', [
    ('drive.zip', (), 'an FMU has a name that ends in .fmu'),
    ('there.fmu', (), 'there.fmu: exists already; remove it or choose another name'),
    ('none/drive.fmu', (), 'drive.fmu: cannot be written, No such file'),
    ('drive.fmu', ('--step', '0'), 'step_s: 0.0 given, allowed is a number above 0 s'),
    ('drive.fmu', ('--config', 'new_circle'), 'did you mean new_circuit?')])
def test_bad_use(name: str, options: tuple[str, ...], said: str, tmp_path: Path,
                 capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('pythonfmu', reason="pythonfmu is not installed, see the extra 'fmu'")
    (tmp_path / 'there.fmu').touch()
    assert cli.main(['fmu', str(tmp_path / name), *options]) == BAD_INPUT
    told = capsys.readouterr().err
    assert said in told and told.count('\n') == 1
    assert [path.name for path in tmp_path.iterdir()] == ['there.fmu']


@pytest.mark.parametrize('fmi, library', [('2', 'pythonfmu'), ('3', 'pythonfmu3')])
def test_a_missing_library(fmi: str, library: str, tmp_path: Path,
                           monkeypatch: pytest.MonkeyPatch,
                           capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    assert cli.main(['fmu', str(tmp_path / 'drive.fmu'), '--fmi', fmi]) == NOT_INSTALLED
    told = capsys.readouterr().err
    assert f'pip install {library}' in told and told.count('\n') == 1
