# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a model is told before any fit, by name and with the remedy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from own.swing import log_of, logs, simulate, swing, TIME
import pytest
from simgap.model import (
    check_model, effect, free, known, Log, LogError, machine, ModelError, OneTest, push, reading,
    size, within,
)

Change = Callable[[dict[str, Any], Any], object]


def faults(**changes: Any) -> str:
    return '\n'.join(check_model(swing(**changes), logs()).faults)


def changed(change: Change) -> Callable[[Any, Any], object]:
    """Return the swing's simulation with something done to its readings."""
    return lambda numbers, test: change(simulate(numbers, test), test)


def test_a_good_model_has_no_fault_and_its_gap_is_told() -> None:
    checked = check_model(swing(), logs())
    assert checked.faults == []
    told = '\n'.join(checked.remarks)
    assert 'far: 2000 samples are compared, 100 per second' in told
    assert 'gap before any fit' in told and 'one run of all tests takes' in told


@pytest.mark.parametrize(('change', 'message'), [
    (lambda r, t: {**r, 'angle': r['angle'][:, np.newaxis]},
     'angle: shape (2000, 1) returned, allowed is (2000,), one value for each of test.time'),
    (lambda r, t: {**r, 'angle': r['angle'][:-1]}, 'angle: shape (1999,) returned'),
    (lambda r, t: {'angle': r['angle']}, 'rate is missing'),
    (lambda r, t: {**r, 'speed': r['rate']}, 'speed is not in readings'),
    (lambda r, t: r['angle'], 'ndarray returned, allowed is a mapping from angle, rate'),
    (lambda r, t: {**r, 'angle': np.sqrt(r['angle'] - 9.0)}, 'are NaN or infinite'),
    (lambda r, t: {**r, 'angle': r['angle'] + 1e-9 * np.random.default_rng().normal()},
     'two runs with the same numbers differ'),
    (lambda r, t: t['trun'], 'no column trun, did you mean turn?'),
    (lambda r, t: 1 / 0, 'ZeroDivisionError: division by zero'),
    (lambda r, t: {**r, 'angle': np.round(r['angle'], 2)}, 'the derivative of the readings by it'),
    (lambda r, t: (t['turn'].__setitem__(0, 5.0), r)[1],
     "the simulation writes into test['turn']"),
])
@pytest.mark.filterwarnings('ignore:invalid value')
def test_a_wrong_simulation(change: Change, message: str) -> None:
    assert message in faults(simulate=changed(change))


def test_a_number_that_nobody_declared_is_told_with_the_nearest() -> None:
    def misspelt(numbers: Any, test: Any) -> Mapping[str, object]:
        return {'angle': numbers.deacy + test.time}

    assert 'numbers.deacy: no entry of the model declares it, did you mean decay?' in faults(
        simulate=misspelt)


def test_a_number_that_nobody_asks_for_is_told() -> None:
    base = {**swing().base, 'mass': within(1.0, 0.1, 'kg')}
    assert 'mass: the simulation never asks for numbers.mass' in faults(base=base)


def test_effects_and_pushes_that_do_nothing_are_told() -> None:
    def idle(numbers: Any, test: Any) -> Mapping[str, Any]:
        still = OneTest(test.log, {'wind': 0.0 * test.push['wind']})
        return {name: values + 0.0 * numbers.idle
                for name, values in simulate(numbers, still).items()}

    told = faults(simulate=idle,
                  effects=[*swing().effects, effect('sensor.idle', idle=size(-1.0, 1.0))])
    assert 'effect sensor.idle: changes no reading in these experiments' in told
    assert "push wind: changes no reading; add test.push['wind'] where it enters" in told


def test_an_effect_that_begins_to_act_beyond_its_first_step_is_remarked() -> None:
    def late(numbers: Any, test: Any) -> Mapping[str, Any]:
        found = simulate(numbers, test)
        return {**found, 'angle': found['angle'] + max(numbers.late - 0.1, 0.0)}

    checked = check_model(swing(simulate=late, effects=[
        *swing().effects, effect('sensor.late', late=size(0.0, 1.0, 'rad'))]), logs())
    assert checked.faults == []
    assert any(line.startswith('sensor.late.late: a step of 0.001 rad from 0 changes no reading')
               for line in checked.remarks)


@pytest.mark.parametrize(('entries', 'message'), [
    ({'base': {'decay': 3.0}}, r'base: decay: 3.0 given, allowed is known\(\), within\(\)'),
    ({'base': {'start': known(1.0)}}, 'per_test: start: the name is there twice, in base too'),
    ({'base': {'no good': known(1.0)}}, 'a name is made of letters'),
    ({'readings': {}}, 'readings: none is given'),
    ({'readings': {'angle': reading('rad', noise=0.0)}}, 'noise: 0 given, allowed is a number'),
    ({'effects': [effect('drift', drift=size(-1.0, 1.0))]}, 'allowed is a name such as'),
    ({'effects': [effect('a.b', drift=size(0.1, 1.0))]}, 'without the neutral value 0'),
    ({'effects': [effect('a.b', drift=within(1.0, 0.1))]}, r'give size\(\) or shape\(\)'),
    ({'effects': [effect('a.b', start=size(0.0, 1.0))]}, 'start: the name is there twice'),
    ({'effects': [effect('a.b', one=size(0.0, 1.0)), effect('a.b', two=size(0.0, 1.0))]},
     'effect a.b: the name is there twice'),
    ({'effects': [effect('a.b', drift=size(0.0, 1.0), simpler='a.b')]},
     'effect a.b: simpler: a.b: no such other effect'),
    ({'per_test': {'start': free(1.0, 0.0)}}, 'the smaller first'),
    ({'push': {'wind': push('swing', 'wind', 'N', 0.0)}}, 'with a size above 0'),
])
def test_a_wrong_declaration(entries: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        swing(**entries)


def test_numbers_and_effects_say_what_they_need() -> None:
    with pytest.raises(ModelError, match='give either a share or by='):
        within(1.0)
    with pytest.raises(ModelError, match='give by= where the value is 0'):
        within(0.0, 0.1)
    with pytest.raises(ModelError, match='give its numbers'):
        effect('a.b')
    with pytest.raises(ModelError, match='simulate: no function given'):
        machine(3, {}, {})  # type: ignore[arg-type]


def test_a_log_without_a_reading_is_refused_with_its_columns() -> None:
    log = log_of('far', 1.0, 1)
    short = Log('short', log.time, {'turn': log['turn'], 'angel': log['angle']})
    [fault] = check_model(swing(), [short]).faults
    assert fault.startswith('short: no column angle for the reading angle, did you mean angel?')


def test_a_log_has_rising_times_and_as_many_samples_in_each_column() -> None:
    with pytest.raises(LogError, match='two or more increasing times'):
        Log('a', np.zeros(5), {})
    with pytest.raises(LogError, match=r'a: x: shape \(4,\) given, allowed is \(5,\)'):
        Log('a', np.arange(5.0), {'x': np.zeros(4)})


def test_few_samples_are_told() -> None:
    log = log_of('far', 1.0, 1)
    sparse = np.full(TIME.size, np.nan)
    sparse[::100] = log['rate'][::100]
    checked = check_model(swing(), [Log('far', TIME, {**log.columns, 'rate': sparse})])
    assert 'far: rate: 20 samples, too few to judge; more than 50 are needed' in checked.remarks
