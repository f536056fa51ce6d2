# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis works on any machine that is modelled: here a body that cools, in closed form."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from blas_threads import during, Look
from lab.servo.ranking import rank_hypotheses
import numpy as np
import pytest
from scipy.signal import lfilter
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.verdict.diagnosis import diagnose
from simgap.verdict.record import Named, share_text

TIME = np.arange(0.0, 10.0, 0.02)
NOISE = 0.01
STARTS = (3.0, -2.0)


def effect(key: str, unit: str, low: float, high: float) -> Effect:
    """Return an effect of one number."""
    number = Parameter(f'{key}.size', unit, low, high, 1e-3)
    return Effect(key, key.partition('.')[0], 'a cause', (Form('', (number,)),))


class Body(Machine):
    """
    A body that cools as start * exp(-rate t), with a thermometer beside it and one behind it.

    It may lack the thermometer's gain, a heater that comes on at 4 s, and a draught at 7 s.
    """

    def __init__(self, truth: Mapping[str, float], odd: float = 0.0) -> None:
        random = np.random.default_rng(5)
        experiments = []
        made = [reading(k, truth) + NOISE * random.normal(size=(TIME.size, 2))
                for k in range(len(STARTS))]
        for k, measured in enumerate(made):
            measured[:, 1] += odd * np.sin(2.0 * TIME + k)
            experiments.append(Experiment(
                f'from {STARTS[k]:g} K', TIME, ('near', 'behind'), ('K', 'K'), measured,
                np.full_like(measured, NOISE)))
        super().__init__(experiments, [Parameter('offset:rate', '1', -0.02, 0.02, 1e-3, 0.01)], [
            effect('thermometer.gain', '1', -0.5, 0.5), effect('heater.step', 'K', -1.0, 1.0),
            effect('air.draught', '1/s', 0.0, 1.0)])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return what both thermometers say."""
        return reading(experiment, point)


def reading(k: int, point: Point) -> FloatArray:
    """Return what both thermometers say."""
    rate = 0.4 * (1.0 + point.get('offset:rate', 0.0))
    cooled = rate * TIME + point.get('air.draught.size', 0.0) * np.maximum(TIME - 7.0, 0.0)
    heated = point.get('heater.step.size', 0.0) * (TIME >= 4.0)
    body = STARTS[k] * np.exp(-cooled) + heated
    return np.column_stack([body * (1.0 + point.get('thermometer.gain.size', 0.0)), body])


@pytest.mark.parametrize('name, size', [
    ('thermometer.gain', 0.1), ('heater.step', -0.3), ('air.draught', 0.4)])
def test_what_a_machine_has_and_its_model_lacks_is_named(name: str, size: float) -> None:
    result = diagnose(Body({f'{name}.size': size, 'offset:rate': 0.01})).as_data()
    assert result['verdict'] == 'explained'
    top = result['which'][0]
    assert top['effects'] == [name] and top['probability'] > 0.9
    assert top['parameters'][f'{name}.size']['value'] == pytest.approx(size, rel=0.05)
    assert result['how_far']['explained_fraction']['value'] > 0.95


def test_a_machine_within_its_tolerance_has_no_gap() -> None:
    assert diagnose(Body({'offset:rate': -0.015})).word == 'no_gap'


def test_what_no_effect_does_is_unknown() -> None:
    assert diagnose(Body({}, odd=0.2)).word == 'unknown_effect'


def test_two_effects_at_once_are_both_named() -> None:
    result = diagnose(Body({'thermometer.gain.size': 0.2, 'heater.step.size': 0.5})).as_data()
    assert set(result['which'][0]['effects']) == {'thermometer.gain', 'heater.step'}


def test_three_effects_at_once_are_all_named() -> None:
    result = diagnose(Body({'thermometer.gain.size': 0.2, 'heater.step.size': 0.5,
                            'air.draught.size': 0.3})).as_data()
    assert set(result['which'][0]['effects']) == {
        'thermometer.gain', 'heater.step', 'air.draught'}


class Scale(Machine):
    """A scale on a slope that drifts, and a load nearly like the drift, and a wave."""

    def __init__(self, truth: Mapping[str, float]) -> None:
        random = np.random.default_rng(6)
        super().__init__([Experiment(
            f'day {k}', TIME, ('weight',), ('N',),
            self.predict(truth, k) + NOISE * random.normal(size=(TIME.size, 1)),
            np.full((TIME.size, 1), NOISE)) for k in range(2)],
            [Parameter('drift', 'N/s', -10.0, 10.0, 1e-3, 5.0)],
            [effect('load.creep', 'N/s', -10.0, 10.0), effect('floor.wave', 'N', -1.0, 1.0)])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the weight."""
        creep = point.get('load.creep.size', 0.0)
        return np.asarray((point.get('drift', 0.0) + creep) * TIME
                          + 0.25 * creep * np.sin(5.0 * TIME + experiment)
                          + point.get('floor.wave.size', 0.0) * np.sin(9.0 * TIME))[:, None]


def test_an_effect_that_gains_very_much_is_named_though_its_interval_is_wide() -> None:
    """A tenth by which derivatives may be wrong leaves open what drifts; its waves do not."""
    result = diagnose(Scale({'load.creep.size': 1.0, 'floor.wave.size': 0.05})).as_data()
    top = result['which'][0]
    low, high = top['parameters']['load.creep.size']['ci95']
    assert low < 0.0 < 1.0 < high
    assert set(top['effects']) == {'load.creep', 'floor.wave'}


def test_an_effect_that_the_catalogue_lacks_is_unknown() -> None:
    body = Body({'heater.step.size': -0.3})
    whole, withheld = (diagnose(machine).as_data() for machine in (
        body, body.without(['heater.step'])))
    unknown = [next(e['probability'] for e in result['which'] if e['effects'] == ['unknown'])
               for result in (whole, withheld)]
    assert unknown[1] > unknown[0] + 0.5
    assert 'heater.step' in body.catalogue, 'the machine itself stays as it is'


def noisier(body: Body, level: float, corner_hz: float, seed: int = 9) -> Body:
    """Return a body whose thermometers have slow noise beside their own."""
    random = np.random.default_rng(seed)
    pole = float(np.exp(-2.0 * np.pi * corner_hz * 0.02))
    for experiment in body.experiments:
        drive = random.normal(size=(TIME.size + 500, 2)) * np.sqrt(1.0 - pole ** 2)
        experiment.measured[:] += level * NOISE * lfilter([1.0], [1.0, -pole], drive, axis=0)[500:]
    return body


@pytest.mark.parametrize('seed', range(4))
def test_slow_noise_that_no_sheet_tells_is_no_gap(seed: int) -> None:
    result = diagnose(noisier(Body({}), 2.0, 0.5, seed)).as_data()
    assert result['verdict'] == 'no_gap'
    assert result['remains']['near']['noise'] > 1.02 * NOISE


def test_an_effect_is_named_beside_slow_noise() -> None:
    result = diagnose(noisier(Body({'heater.step.size': -0.3}), 2.0, 0.5)).as_data()
    top = result['which'][0]
    assert top['effects'] == ['heater.step']
    low, high = top['parameters']['heater.step.size']['ci95']
    assert low < -0.3 < high


def test_no_gap_says_what_could_hide() -> None:
    """Twice the size that could hide is found."""
    hidden = {item['effect']: item['size'] for item in diagnose(Body({})).could_hide}
    assert set(hidden) == {'thermometer.gain', 'heater.step', 'air.draught'}
    for name, size in hidden.items():
        found = diagnose(Body({f'{name}.size': 2.0 * size})).as_data()['which'][0]
        assert found['effects'] == [name]


def test_what_could_hide_is_said_beside_an_effect_within_its_tolerance() -> None:
    """Its shape has no prior, and nothing in the data tells it."""
    body = Body({'heater.step.size': 0.05})
    heater = body.catalogue['heater.step']
    tolerant = replace(heater.forms[0].parameters[0], tolerance=0.1)
    shape = Parameter('heater.step.shape', '1', 0.5, 2.0, 0.1, start=1.0, is_shape=True)
    body.catalogue['heater.step'] = replace(heater, forms=(Form('', (tolerant, shape)),))
    result = diagnose(body).as_data()
    assert result['verdict'] == 'no_gap'
    assert [item['effect'] for item in result['also_seen']] == ['heater.step']
    hidden = {item['effect']: item['size'] for item in result['could_hide']}
    assert hidden['heater.step'] >= 0.1


def short(body: Body, count: int) -> Body:
    body.experiments = tuple(
        replace(e, measured=np.where(np.arange(TIME.size)[:, np.newaxis] % (TIME.size // count),
                                     np.nan, e.measured)) for e in body.experiments)
    return body


def test_few_samples_are_too_few_to_judge() -> None:
    assert diagnose(short(Body({}), 20)).word == 'too_few_to_judge'


def test_few_samples_far_from_the_model_are_no_agreement() -> None:
    result = diagnose(short(Body({}, odd=0.3), 20)).as_data()
    assert result['verdict'] not in ('no_gap', 'too_few_to_judge')


def test_what_remains_is_said_in_the_unit_of_the_signal() -> None:
    body = Body({}, odd=0.2)
    remains = diagnose(body, limits={'behind': 0.05, 'near': 0.05}).remains
    assert remains['behind']['beyond_noise'] == pytest.approx(0.2 / np.sqrt(2.0), rel=0.2)
    assert remains['behind']['unit'] == 'K'
    assert remains['behind']['matters']
    assert not remains['near']['matters']


def test_a_diagnosis_says_itself_in_one_line() -> None:
    said = repr(diagnose(Body({'heater.step.size': -0.3})))
    assert said.startswith('<Verdict: explained, heater.step 9') and len(said) < 80


def test_an_effect_that_widens_the_gap_explains_nothing_of_it() -> None:
    assert share_text({'value': -8453.94, 'ci95': [-9e5, -12.0]}) == (
        'nothing of the gap: with the effect it is wider')
    assert share_text({'value': 0.9, 'ci95': [-0.2, 0.99]}) == '90 % of the gap (0 to 99 %)'


@pytest.mark.parametrize('judged, said', [
    (['a', 'b'], ['a and b explain 90 % of the gap (80 to 99 %), judged on the rest']),
    (['a'], ['a explains 90 % of the gap (80 to 99 %), judged on the rest',
             'how much of the gap b explains cannot be judged on withheld data: why b']),
    ([], ['how much of the gap a and b explains cannot be judged on withheld data: why']),
])
def test_the_text_says_of_which_effects_a_share_is(judged: list[str], said: list[str]) -> None:
    diagnosis = diagnose(Body({'heater.step.size': -0.3}))
    fraction = ({'value': 0.9, 'ci95': [0.8, 0.99]} if judged else
                {'value': None, 'reason': 'why'})
    text = replace(diagnosis, which=[Named(['a', 'b'], 1.0, {})], how_far={
        'explained_fraction': fraction, 'held_out': 'the rest', 'judged': judged,
        'cannot_be_judged': {name: f'why {name}' for name in 'ab' if name not in judged},
    }).summary()
    assert [line.strip() for line in text.splitlines() if 'judged on' in line] == said


def test_what_closes_nothing_of_withheld_data_is_not_named() -> None:
    """A step of another sign in each test fits both together, and predicts neither."""
    body, other = Body({'heater.step.size': 0.5}), Body({'heater.step.size': -0.25})
    body.experiments = (body.experiments[0], other.experiments[1])
    result = diagnose(body).as_data()
    assert result['verdict'] == 'unknown_effect'
    assert {name for entry in result['which'] for name in entry['effects']} == {'none', 'unknown'}


@pytest.mark.parametrize('work', [diagnose, rank_hypotheses])
def test_linear_algebra_has_one_thread_because_fits_go_side_by_side(
        work: Callable[[Machine], object]) -> None:
    class Watched(Body):
        def __init__(self, look: Look) -> None:
            super().__init__({})
            self.look = look

        def predict(self, point: Point, experiment: int) -> FloatArray:
            self.look()
            return super().predict(point, experiment)

    assert during(lambda look: work(Watched(look))) == {1}
