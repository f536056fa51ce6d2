# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The servo as a model: fits and diagnoses of servos that another integrator has moved.

The servos here are made with SciPy's adaptive Runge-Kutta method, stops and breakaways located
as events: nothing of it is the model's.
"""

from __future__ import annotations

from collections.abc import Mapping
import json
import math
from pathlib import Path

from lab import cli
from lab.servo import refit as servo_refit
from lab.servo.catalogue import BASE, catalogue, number, NUMBERS, TIED, vector
from lab.servo.firmware import firmware_of
from lab.servo.log import read_bam, ServoLog
from lab.servo.machine import ServoMachine
from lab.servo.physics import GRAVITY, ORDER
from lab.servo.ranking import rank_hypotheses
from lab.servo.rounds import FitEffort, folds, lacking, numbers
from lab.servo.study import compared, Direction, directions, summed
import numpy as np
from numpy.typing import NDArray
import pytest
from scipy.integrate import solve_ivp
from simgap.command.programs import BAD_INPUT

LOGS = Path(__file__).resolve().parents[3] / 'shared' / 'data' / 'bam_xl330'
MASS, LENGTH, SUPPLY = 0.5, 0.1, 7.4
TRUTH = {'torque_constant': 0.32, 'resistance': 2.3, 'armature_inertia': 0.002,
         'coulomb_torque': 0.02, 'viscous_friction': 0.012}
FloatArray = NDArray[np.float64]


def goal_of(name: str, time: FloatArray) -> FloatArray:
    """Return the goal's course."""
    courses = {'sweep': np.sin(1.2 * time ** 2), 'slow': 1.2 * np.sin(2.0 * time),
               'mixed': np.sin(2.0 * time) + 0.5 * np.sin(7.0 * time)}
    return np.asarray(courses[name])


def made(kp: float, name: str, seconds: float = 3.0, *, delay: float = 0.0,
         load_friction: float = 0.0, sag: float = 0.0, offset: float = 0.0) -> ServoLog:
    """Return the log of a servo with known numbers and perhaps one effect."""
    firmware = firmware_of('xl330')
    gain = kp * firmware.error_gain
    time = np.arange(0.0, seconds, 0.01)
    goal = goal_of(name, time)
    kt, resistance = TRUTH['torque_constant'], TRUTH['resistance']
    inertia = MASS * LENGTH ** 2 + TRUTH['armature_inertia']

    def torques(q: float, w: float, asked: float) -> tuple[float, float]:
        """Return what drives the shaft and what friction can hold."""
        duty = min(max(gain * (asked - q), -1.0), 1.0)
        volts = (SUPPLY + sag * duty * kt * w / resistance) / (1.0 + sag * duty ** 2 / resistance)
        torque = kt * (duty * volts - kt * w) / resistance
        gravity = -MASS * GRAVITY * LENGTH * math.sin(q + offset)
        return torque + gravity, TRUTH['coulomb_torque'] + load_friction * abs(gravity - torque)

    def slope(_: float, state: FloatArray, asked: float, way: float) -> list[float]:
        q, w = state
        driving, level = torques(q, w, asked)
        return [w, (driving - way * level - TRUTH['viscous_friction'] * w) / inertia]

    def halts(_: float, state: FloatArray, asked: float, way: float) -> float:
        return float(way * state[1])

    halts.terminal, halts.direction = True, -1.0  # type: ignore[attr-defined]
    # every change of the goal begins a new piece
    changes = time + delay
    stops = np.unique(np.r_[time, changes[changes < time[-1]]])
    q, w, course = 0.0, 0.0, {0.0: 0.0}
    for begin, end in zip(stops[:-1], stops[1:], strict=True):
        k = int(np.searchsorted(changes, 0.5 * (begin + end), side='right')) - 1
        asked, t = float(goal[max(k, 0)]), float(begin)
        while t < end:
            driving, level = torques(q, w, asked)
            if w == 0.0 and abs(driving) <= level:
                break  # it sticks, and nothing changes within the piece
            way = math.copysign(1.0, w if w != 0.0 else driving)
            piece = solve_ivp(slope, (t, end), [q, w], args=(asked, way), events=halts,
                              rtol=1e-7, atol=1e-9)
            t, q, w = float(piece.t[-1]), float(piece.y[0, -1]), float(piece.y[1, -1])
            if piece.status == 1:
                w = 0.0
        course[float(end)] = q
    position = np.array([course[float(t)] for t in time])
    past = np.interp(time - 0.04, time, position)
    late = goal[np.maximum(np.searchsorted(changes, time, side='right') - 1, 0)]
    step = firmware.position_step
    measured = np.column_stack([
        np.round(position / step) * step,
        np.round((position - past) / 0.04 / firmware.rate_step) * firmware.rate_step,
        np.round(np.clip(gain * (late - position), -1.0, 1.0) * firmware.duty_count)
        / firmware.duty_count])
    return ServoLog(f'{name} {kp:g}', kp, name, MASS, LENGTH, gain, SUPPLY, firmware, time,
                    goal, np.ones(time.size), np.full(time.size, 25.0), measured)


@pytest.fixture(scope='module')
def plain_tests() -> list[ServoLog]:
    """Return logs of a servo that is as the base model has it."""
    return [made(200.0, 'sweep'), made(600.0, 'mixed')]


def log_of(test: ServoLog, path: Path) -> None:
    """Write a log as the BAM project does."""
    entries = [{'timestamp': t, 'position': p, 'speed': s, 'load': int(round(d * 885.0)) % 65536,
                'input_volts': SUPPLY, 'temp': 25, 'goal_position': g, 'torque_enable': True}
               for t, (p, s, d), g in zip(test.time.tolist(), test.measured.tolist(),
                                          test.goal.tolist(), strict=True)]
    path.write_text(json.dumps({
        'mass': MASS, 'length': LENGTH, 'kp': test.kp, 'vin': SUPPLY, 'motor': 'xl330',
        'trajectory': test.trajectory, 'entries': entries}))


def test_the_true_numbers_give_the_course_of_the_other_integrator(
        plain_tests: list[ServoLog]) -> None:
    # what is left is the resolution, a quarter of a count on the mean
    assert servo_refit.error(plain_tests, TRUTH) < 0.5e-3
    # and others do not
    assert servo_refit.error(plain_tests, {**TRUTH, 'torque_constant': 0.35}) > 3e-3


@pytest.mark.parametrize(('name', 'effect'), [
    ('delay', {'delay': 0.015}), ('load_friction', {'load_friction': 0.2}),
    ('supply_resistance', {'sag': 0.4}), ('position_offset', {'offset': 0.05})])
def test_an_effect_is_that_of_the_other_integrator(name: str, effect: dict[str, float]) -> None:
    tests = [made(400.0, 'mixed', **effect)]
    there = servo_refit.error(tests, {**TRUTH, name: next(iter(effect.values()))})
    assert there < 0.7e-3
    assert servo_refit.error(tests, TRUTH) > 5.0 * there


def stall_torque(of: Mapping[str, float]) -> float:
    """Return the torque for a volt at rest [N m/V]."""
    return of['torque_constant'] / of['resistance']


def drag(of: Mapping[str, float]) -> float:
    """Return the torque lost for each rad/s [N m s/rad]."""
    return of['torque_constant'] ** 2 / of['resistance'] + of['viscous_friction']


@pytest.mark.slow
def test_a_refit_finds_the_numbers_of_the_servo(plain_tests: list[ServoLog]) -> None:
    fit = servo_refit.refit(plain_tests, BASE, (), 2500)
    assert fit.error < 0.7e-3
    # motion tells the torque at stall and the drag, which back-EMF and friction share: of k_t, R
    # and the viscous friction only these two are to be found
    for told in (stall_torque, drag):
        assert told(fit.values) == pytest.approx(told(TRUTH), rel=0.1)
    for name in ('coulomb_torque', 'armature_inertia'):
        assert fit.values[name] == pytest.approx(TRUTH[name], rel=0.1), name


@pytest.mark.slow
@pytest.mark.parametrize(('hidden', 'effect'), [
    ('controller.delay', {'delay': 0.015}),
    ('gearbox.load_dependent_friction', {'load_friction': 0.15}),
    ('encoder.offset', {'offset': 0.05}),
])
def test_the_generic_search_names_the_hidden_effect(hidden: str,
                                                    effect: dict[str, float]) -> None:
    tests = [made(kp, name, **effect) for kp, name in (
        (200.0, 'sweep'), (600.0, 'mixed'), (400.0, 'slow'))]
    # noise: the resolution, and what the model's coarse steps make of stops
    model = ServoMachine(tests, TRUTH, BASE, noise=[2e-3, 0.05, 0.01])
    found = [answer.hypothesis for answer in rank_hypotheses(model).answers]
    assert hidden in found[0].effects
    alone = [h for h in found if h.effects == (hidden,)]
    none = [h for h in found if not h.effects]
    assert alone[0].cost < 0.3 * none[0].cost


def test_a_servo_without_effects_lacks_nothing(plain_tests: list[ServoLog]) -> None:
    model = ServoMachine(plain_tests, TRUTH, BASE, noise=[2e-3, 0.05, 0.01])
    assert rank_hypotheses(model).answers[0].hypothesis.effects == ()


def test_the_model_keeps_to_the_protocol(plain_tests: list[ServoLog]) -> None:
    model = ServoMachine(plain_tests, TRUTH, BASE)
    everything = model.simulate([{}, {'delay': 0.01}])
    one = model.simulate([{'delay': 0.01}], [1])
    assert one[0][0] is None
    np.testing.assert_array_equal(one[0][1], everything[1][1])
    for k, experiment in enumerate(model.experiments):
        first = everything[0][k]
        assert first is not None and first.shape == experiment.measured.shape
    early = model.simulate([{}], until=1.0)[0][0]
    assert early is not None
    assert np.isnan(early[model.experiments[0].time > 1.0]).all()
    assert np.isfinite(early[model.experiments[0].time <= 1.0]).all()


def test_threads_change_no_figure(plain_tests: list[ServoLog]) -> None:
    points = [{}, {'delay': 0.01}, {'load_friction': 0.1}]
    alone = ServoMachine(plain_tests, TRUTH, BASE).simulate(points)
    together = ServoMachine(plain_tests, TRUTH, BASE, threads=2).simulate(points)
    for a, b in zip(alone, together, strict=True):
        for x, y in zip(a, b, strict=True):
            np.testing.assert_array_equal(x, y)


def test_an_effect_that_is_there_is_no_candidate(plain_tests: list[ServoLog]) -> None:
    values = {**TRUTH, 'load_friction': 0.1, 'ripple_cosine@8': 0.01, 'ripple_sine@8': 0.0}
    model = ServoMachine(plain_tests, values, tuple(values))
    assert 'gearbox.load_dependent_friction' not in model.catalogue
    assert 'motor.torque_ripple' not in model.catalogue  # the physics has one wave of each kind
    assert 'gearbox.position_dependent_friction' in model.catalogue
    # an offset of nought is the value itself, for logarithmic numbers too
    assert model.numbers(dict.fromkeys(values, 0.0)) == pytest.approx(values)


def test_every_number_of_the_catalogue_is_one_of_the_physics() -> None:
    names = {p.name for e in catalogue().values() for f in e.forms for p in f.parameters}
    plain = {name.partition('@')[0] for name in names} | set(BASE)
    assert plain == set(NUMBERS)
    reached = {t for name in plain for t in TIED.get(name, (name,))}
    assert reached | {'friction_cycles', 'ripple_cycles'} == set(ORDER)
    row = vector({'ripple_cosine@12': 0.01})
    assert row[ORDER.index('ripple_cycles')] == 12.0
    for name in names:
        item = number(name)
        assert item.low <= (item.start if item.shape else 0.0) <= item.high
        assert item.value(item.share(item.start)) == pytest.approx(item.start, abs=1e-12)


def test_the_ladders_simpler_models_are_parts_of_the_richer() -> None:
    for name, parents in servo_refit.PARENTS.items():
        for parent in parents:
            known = dict.fromkeys(servo_refit.LADDER[parent], 0.123)
            values = servo_refit.initial_values(servo_refit.LADDER[name], known)
            # started from a simpler model it is that model: what is new is absent
            for number_name, value in values.items():
                tied = number_name.replace('_motor', '').replace('_external', '')
                if number_name in known or tied in known:
                    assert value == 0.123
                elif not number(number_name).shape:
                    assert value == 0.0


def grid() -> list[ServoLog]:
    """Return four gains by three trajectories, of which only the names count."""
    log = made(100.0, 'slow', 1.0)
    return [ServoLog(f'{name} {kp:g}', kp, name, log.mass, log.length,
                     kp * log.firmware.error_gain, log.supply, log.firmware, log.time, log.goal,
                     log.enabled, log.temperature, log.measured)
            for kp in (100.0, 200.0, 400.0, 800.0) for name in ('sweep', 'slow', 'mixed')]


def test_what_is_withheld_is_never_fitted() -> None:
    tests = grid()
    for part in folds(tests):
        assert not {t.name for t in part.fitted} & {t.name for t in part.withheld}
        assert {t.kp for t in part.fitted} == {t.kp for t in tests}
    withheld = [t.name for part in folds(tests) for t in part.withheld]
    assert sorted(withheld) == sorted(t.name for t in tests)
    chosen = directions(tests)
    assert len(chosen) == 6 + 3
    for direction in chosen:
        fitted, rest = direction.split_tests(tests)
        key = {'gain': 'kp', 'trajectory': 'trajectory'}[direction.split]
        assert len(fitted) + len(rest) == len(tests)
        assert {getattr(t, key) for t in fitted} == set(direction.fitted)
        assert not {getattr(t, key) for t in rest} & set(direction.fitted)


@pytest.mark.slow
def test_nothing_withheld_can_change_what_is_found() -> None:
    tests = [made(kp, name, 1.5, load_friction=0.2)
             for kp in (150.0, 400.0, 800.0) for name in ('sweep', 'mixed')]
    direction = Direction('gain', (150.0, 400.0))
    spoilt = [t if t.kp < 800.0 else ServoLog(**{
        **vars(t), 'measured': np.zeros_like(t.measured)}) for t in tests]
    effort = FitEffort(60, 20)
    first, second = (compared(each, direction, effort) for each in (tests, spoilt))
    assert first['rounds'] == second['rounds']
    for name, model in first['models'].items():
        assert model['values'] == second['models'][name]['values']
        assert model['withheld_mrad'] != second['models'][name]['withheld_mrad']


@pytest.mark.slow
def test_the_search_finds_what_a_servo_lacks_and_no_more() -> None:
    tests = [made(kp, name, load_friction=0.25)
             for kp in (200.0, 600.0) for name in ('sweep', 'mixed')]
    found = lacking(tests, FitEffort(1200, 300))
    assert 'gearbox.load_dependent_friction' in found.effects
    assert found.fit.error < 3e-3
    assert set(numbers(())) == set(BASE)


def test_the_summary_is_the_mean_over_directions() -> None:
    def result(errors: dict[str, float]) -> dict[str, object]:
        return {'split': 'gain', 'found': ['a', 'b'], 'models': {
            name: {'withheld_mrad': e, 'fitted_mrad': e / 2.0} for name, e in errors.items()}}

    part = summed([result({'m1': 30.0, 'm2': 20.0, 'diagnosed': 10.0}),
                   result({'m1': 40.0, 'm2': 10.0, 'diagnosed': 12.0})])['gain']
    assert part['withheld_mrad'] == {'m1': 35.0, 'm2': 15.0, 'diagnosed': 11.0}
    assert part['best_of_ladder'] == 'm2'
    assert part['lower_than_best_of_ladder'] is True
    assert part['directions_lower_than_all_of_ladder'] == 1
    assert part['found_in'] == {'a': 2, 'b': 2}


@pytest.mark.slow
def test_the_command_writes_the_comparison(tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    logs = tmp_path / 'logs'
    logs.mkdir()
    for kp in (150.0, 300.0, 600.0):
        log_of(made(kp, 'mixed', 1.5, load_friction=0.2), logs / f'{kp:g}.json')
    wanted = ['servo', str(logs), '--split', 'gain', '--runs', '40', '--json', '-',
              '--keep', str(tmp_path / 'kept')]
    status = cli.main(wanted)
    result = json.loads(capsys.readouterr().out)
    part = result['summary']['gain']
    assert status == (0 if part['lower_than_best_of_ladder'] else 1)
    assert set(part['withheld_mrad']) == {*servo_refit.LADDER, 'diagnosed'}
    assert len(result['directions']) == 3
    assert len(list((tmp_path / 'kept').glob('*.json'))) == 3
    # what was kept is not computed again
    assert cli.main(wanted) == status
    again = json.loads(capsys.readouterr().out)
    assert again['directions'] == result['directions']


@pytest.mark.parametrize(('arguments', 'words'), [
    (['nowhere'], 'nowhere: no such folder'),
    (['.', '--runs', '3'], '--runs: 3 given, allowed is a whole number of 20 or more'),
    (['.', '--jobs', '0'], '--jobs: 0 given'),
    (['.'], 'holds no *.json logs'),
])
def test_wrong_input_is_told_in_one_line(arguments: list[str], words: str, tmp_path: Path,
                                         monkeypatch: pytest.MonkeyPatch,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(['servo', *arguments]) == BAD_INPUT
    error = capsys.readouterr().err
    assert words in error
    assert error.count('\n') == 1


def test_logs_that_cannot_serve_are_told_in_one_line(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for kp in (100.0, 200.0):
        log_of(made(kp, 'slow', 1.0), tmp_path / f'{kp:g}.json')
    assert cli.main(['servo', str(tmp_path)]) == BAD_INPUT
    assert 'nothing can be withheld' in capsys.readouterr().err
    log_of(made(400.0, 'slow', 1.0), tmp_path / '400.json')
    assert cli.main(['servo', str(tmp_path), '--without', 'gearbox.magic']) == BAD_INPUT
    assert 'gearbox.magic: no such effect' in capsys.readouterr().err
    text = (tmp_path / '400.json').read_text()
    (tmp_path / '400.json').write_text(text.replace('xl330', 'mx64'))
    assert cli.main(['servo', str(tmp_path)]) == BAD_INPUT
    assert "motor: 'mx64' given, the drive law is known of xl330" in capsys.readouterr().err
    (tmp_path / '400.json').write_text(text.replace('"mass": 0.5', '"mass": 0'))
    assert cli.main(['servo', str(tmp_path)]) == BAD_INPUT
    assert '400: mass: 0 given, allowed is more than 0' in capsys.readouterr().err


@pytest.mark.trial
@pytest.mark.skipif(not LOGS.is_dir(), reason='the recordings of the servo are not here')
def test_a_real_servos_diagnosis_beats_the_ladder_on_withheld_gains() -> None:
    tests = [ServoLog.of(path.stem, read_bam(path)) for path in sorted(LOGS.glob('*.json'))]
    result = compared(tests, Direction('gain', (100.0, 400.0)), FitEffort())
    errors = {name: model['withheld_mrad'] for name, model in result['models'].items()}
    ours = errors.pop('diagnosed')
    assert ours < min(errors.values())
