# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A model in, the missing effect out: its name and size, and when something pushes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from own.swing import log_of, logs, NOISE, simulate, swing, TIME
import pytest
from simgap.errors import UserError
from simgap.model import (
    diagnose_logs, effect, free, known, Log, machine, OwnMachine, push, reading, ripple, size,
    unseen, within,
)
from simgap.report.page import contents
from simgap.report.render import render


def test_nothing_is_named_where_nothing_is_wrong() -> None:
    found = diagnose_logs(swing(), logs())
    assert found.word == 'no_gap'
    assert found.pushes == []
    numbers = found.numbers
    assert numbers['decay']['value'] == pytest.approx(0.104, abs=1e-3)
    assert numbers['bias']['value'] == pytest.approx(0.05, abs=1e-3)
    assert numbers['start[near]']['value'] == pytest.approx(0.4, abs=2e-3)
    assert numbers['pulsation'] == {'value': 2.0, 'configured': 2.0, 'unit': 'rad/s'}


def test_the_missing_effect_is_named_with_its_size() -> None:
    found = diagnose_logs(swing(), logs({'drift': 0.01}))
    first = found.which[0]
    assert found.word == 'explained' and first.effects == ['sensor.drift']
    drift = first.parameters['sensor.drift.drift']
    assert drift['value'] == pytest.approx(0.01, rel=0.05) and drift['unit'] == 'rad/s'
    assert found.numbers['drift']['value'] == drift['value']


def test_a_smooth_simulation_has_the_intervals_of_least_squares() -> None:
    """Derivatives right to a tenth could not tell this creep from the drift that is tolerated."""
    def straight(n: Any, test: Any) -> dict[str, Any]:
        creep = test.time + 0.5 * np.sin(5.0 * test.time)
        return {'weight': n.drift * test.time + n.creep * creep}

    noise, random = 0.02, np.random.default_rng(8)
    wave = TIME + 0.5 * np.sin(5.0 * TIME)
    found = diagnose_logs(machine(
        straight, base={'drift': free(-5.0, 5.0, 'N/s')},
        readings={'weight': reading('N', noise=noise)},
        effects=[effect('load.creep', creep=size(-5.0, 5.0, 'N/s'))],
        push={}, settles_s=0.1), [
            Log(f'day {k}', TIME, {'weight': 0.3 * wave + noise * random.normal(size=TIME.size)})
            for k in range(4)])
    [creep] = found.which[0].parameters.values()
    columns = np.tile(np.column_stack([TIME, wave]), (4, 1)) / noise
    deviation = np.sqrt(np.linalg.inv(columns.T @ columns)[1, 1])
    low, high = creep['ci95']
    assert low < 0.3 < high
    assert 0.95 < (high - low) / (2.0 * 1.96 * deviation) < 2.0


def test_the_order_of_a_ripple_is_found() -> None:
    found = diagnose_logs(swing(), logs({'wave_sine': 0.01, 'wave_order': 17.0}))
    assert found.which[0].effects == ['sensor.wave']
    numbers = found.numbers
    assert numbers['wave_order']['value'] == 17.0
    assert numbers['wave_sine']['value'] == pytest.approx(0.01, rel=0.05)
    assert 'wave_sine@17 = ' in found.summary()


def test_the_second_harmonic_of_a_ripple_is_no_effect_of_its_own() -> None:
    def with_harmonic(numbers: Any, test: Any) -> dict[str, Any]:
        found, twice = simulate(numbers, test), 2.0 * numbers.wave_order * test['turn']
        angle = found['angle'] + numbers.wave_cosine_2 * np.cos(twice)
        angle = angle + numbers.wave_sine_2 * np.sin(twice)
        return {'angle': angle, 'rate': np.gradient(angle, test.time)}

    measured = logs({'wave_sine': 0.01, 'wave_order': 9.0})
    for log in measured:
        more = 0.004 * np.cos(18.0 * log['turn'])
        log.columns['angle'][:] += more
        log.columns['rate'][:] += np.gradient(more, log.time)
    model = swing(simulate=with_harmonic, effects=[
        *swing().effects[:2],
        ripple('sensor.wave', 'wave', size(-0.1, 0.1, 'rad'), 'turn', harmonics=2)])
    found = diagnose_logs(model, measured)
    assert found.which[0].effects == ['sensor.wave']
    numbers = found.numbers
    assert numbers['wave_order']['value'] == 9.0
    assert numbers['wave_sine']['value'] == pytest.approx(0.01, rel=0.05)
    assert numbers['wave_cosine_2']['value'] == pytest.approx(0.004, rel=0.1)


@pytest.mark.slow
def test_what_pushes_is_told_with_its_place_its_times_and_its_size() -> None:
    """Three pushes of one size: within 50 ms, and the size within 15 percent."""
    edges = ((3.0, 4.5), (8.0, 9.0), (14.0, 16.5))
    wind = 0.0 * TIME
    for begin, end in edges:
        wind[(TIME >= begin) & (TIME < end)] = 0.05
    found = diagnose_logs(swing(), logs(wind=wind), without=['sensor.slip', 'sensor.drift'])
    assert found.word in ('unknown_effect', 'partly_explained')
    assert found.may_enter_at[0].name == 'wind on the swing'
    for name in ('far', 'near'):
        told = [item for item in found.pushes if item['test'] == name]
        assert [item['unit'] for item in told] == ['rad'] * 3
        for item, edge in zip(told, edges, strict=True):
            assert (item['from_s'], item['until_s']) == pytest.approx(edge, abs=0.05)
            assert item['size'] == pytest.approx(0.05, rel=0.15)
    assert 'far: wind on the swing 0.0' in found.summary()


@pytest.mark.parametrize('everyday, drift, word', [
    (0.0, 0.0, 'unknown_effect'), (0.004, 0.0, 'no_gap'), (0.004, 0.01, 'explained')])
@pytest.mark.slow
def test_what_pushes_every_day_is_no_gap(everyday: float, drift: float, word: str) -> None:
    """A wind of four times the noise, which changes within half a second."""
    random = np.random.default_rng(4)
    fades = np.exp(-np.arange(400) / 60.0)
    winds = [np.convolve(random.normal(size=TIME.size + 400), fades, 'same')[200:-200]
             for _ in range(2)]
    recorded = [log_of(name, start, seed, {'drift': drift}, 0.004 * wind / wind.std())
                for seed, (name, start, wind) in enumerate(zip(
                    ('far', 'near'), (1.0, 0.6), winds, strict=True))]
    found = diagnose_logs(swing(push={
        'wind': push('swing', 'wind on the swing', 'rad', 0.05, everyday)}), recorded)
    assert found.word == word
    if drift:
        assert found.which[0].effects == ['sensor.drift']
        assert found.which[0].parameters['sensor.drift.drift']['value'] == pytest.approx(
            drift, rel=0.1)


def test_a_log_that_was_not_used_is_predicted_to_the_noise_with_the_effect_only() -> None:
    """A start that is the mean of the two that were fitted, and the same drift."""
    found = diagnose_logs(swing(), logs({'drift': 0.01}))
    error = unseen(found, log_of('new', 0.7, 5, {'drift': 0.01}))['angle']
    assert error.unit == 'rad'
    assert error.after == pytest.approx(NOISE, rel=0.2)
    # a bias takes the mean of the drift, 0.01 t over 20 s; what it leaves is 0.2 / sqrt(12)
    assert error.before == pytest.approx(0.2 / np.sqrt(12.0), rel=0.1)
    assert error.configured > error.before


@pytest.mark.slow
def test_what_repeats_itself_each_turn_is_a_law_of_waves_and_predicts_a_log() -> None:
    """Two orders of an angle that turns, one of them too fast for a pulse; noise is 1 mrad."""
    waves = {'wave_cosine': 0.01, 'wave_order': 23.0}
    found = diagnose_logs(swing(along={'turn': 'rad'}), logs(waves), without=['sensor.wave'])
    assert found.word == 'unknown_effect' and found.lawful is not None
    law = found.may_enter_at[0].law
    assert law is not None and (law.by, law.orders) == ('turn within a turn', (23,))
    # as what enters through a lag of 0.1 s, 16.1 rad/s of which the angle has less
    assert found.may_enter_at[0].name == 'wind on the swing'
    assert law.waves()[0][1] == pytest.approx(0.01 * np.hypot(1.0, 0.7 * 23.0 * 0.1), rel=0.05)
    assert '23 with' in found.summary()
    error = unseen(found, log_of('new', 0.7, 5, waves))['angle']
    assert error.after > 0.006 and error.lawful == pytest.approx(NOISE, rel=0.3)


def test_the_page_shows_the_models_own_parts_and_no_other_machine() -> None:
    page = render('verdict.html', **contents(diagnose_logs(
        swing(blocks=('swing', 'sensor')), logs({'drift': 0.01}))))
    for word in ('>sensor', '>swing', 'it warms up', 'rad/s', 'sensor.drift'):
        assert word in page
    text = page.split('<body>')[1].split('<script')[0].lower()
    for word in ('antenna', 'elevation', 'tachometer', 'motor', 'drive', 'bias'):
        assert word not in text, word


def test_a_number_of_one_test_acts_on_it_alone() -> None:
    machine = OwnMachine(swing(), logs())
    before, after = machine.simulate([{}, {'start[near]': 0.2}])
    assert np.array_equal(before[0], after[0])  # type: ignore[arg-type]
    change = np.asarray(after[1])[:, 0] - np.asarray(before[1])[:, 0]
    assert change[0] == pytest.approx(0.2)


def test_the_beginning_of_a_test_is_simulated_as_in_the_whole() -> None:
    machine = OwnMachine(swing(), logs())
    [whole], [part] = (machine.simulate([{}], [0], until) for until in (np.inf, 5.0))
    first = machine.experiments[0].time <= 5.0
    assert np.array_equal(np.asarray(whole[0])[first][:-1], np.asarray(part[0])[first][:-1])
    assert np.isnan(np.asarray(part[0])[~first]).all()


@pytest.mark.parametrize(('options', 'message'), [
    ({'without': ['sensor.drif']}, 'did you mean sensor.drift?'),
    ({'limits': {'angel': 1.0}}, 'did you mean angle?')])
def test_names_that_are_not_there_are_told(options: dict[str, object], message: str) -> None:
    with pytest.raises(UserError, match=message.replace('?', r'\?')):
        diagnose_logs(swing(), logs(), **options)  # type: ignore[arg-type]


def test_a_number_of_the_day_is_told_beside_that_of_the_machine() -> None:
    days = [replace(log_of(f'log {k}', 1.0, 20 + k, {'decay': decay}), labels={'day': str(k)})
            for k, decay in enumerate((0.1, 0.104, 0.102))]
    model = swing(base={'pulsation': known(2.0), 'bias': free(-0.5, 0.5, 'rad'),
                        'decay': within(0.1, 0.2, '1/s', spread=0.003)})
    found = diagnose_logs(model, days)
    told = {item['number']: item for item in found.as_data()['reproducibility']}
    decay = told['decay']
    assert decay['belongs_to'] == 'day' and not decay['differs']
    assert [decay['by']['day'][str(k)]['value'] for k in range(3)] == pytest.approx(
        [0.1, 0.104, 0.102], abs=5e-4)
    assert decay['ci95'][0] < 0.102 < decay['ci95'][1]
    assert found.numbers['decay']['value'] == pytest.approx(0.102, abs=1e-3)
    assert 0.001 < decay['spread'] < 0.004
    assert (told['bias']['belongs_to'], told['start[log 1]']['belongs_to']) == ('machine', 'test')
