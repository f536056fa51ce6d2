# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The scorecard against verdicts made by hand, whose scores follow from counting."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from antenna_drive.diagnosis.catalogue import catalogue
from hypothesis import given, strategies as st
from lab.antenna.cases import draw_truths
from lab.antenna.effects import CATALOGUE
from lab.antenna.imperfections import apply_imperfections, imperfect_recording
from lab.antenna.machine import reference_machine
from lab.antenna.sheet import CaseSheet
from lab.cli import main
from lab.trials import sealing
from lab.trials.held_back import noise_power
from lab.trials.scorecard import (
    auroc, calibration_error, Case, rate, read_cases, reliability, score,
)
from lab.trials.scored_cases import read_scored
from lab.trials.sizes import size_of, StatedSize
from lab.trials.verdict import Interval, parse_verdict, read_verdict, Verdict, VerdictError
import numpy as np
import pytest
from simgap.errors import UserError

PLAIN = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.sampled_from(
        ['before.csv', '../x.csv', '1', '', 10**400]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(['before', 'after', 'gearbox_1.gap.change', 'value', 'ci95', 'unit']),
        inner, max_size=4), max_leaves=10)
KEYS = ('cases, failures, top1, top3, within_set, pairs_both, no_gap_on_none, auroc_unknown, '
        'overconfident_outside, ece, explained_fraction_median, seconds_median').split(', ')


def verdict(*which: tuple[str, float], confusable: list[list[str]] | None = None,
            word: str = 'explained', fraction: float = 0.9, seconds: float = 10.0) -> Any:
    """Return the JSON of a verdict; ids that act together are joined by a plus."""
    return {
        'verdict': word, 'where': [],
        'which': [{'effects': names.split('+'), 'probability': p, 'parameters': {}}
                  for names, p in which],
        'confusable': confusable or [],
        'how_far': {'explained_fraction': {'value': fraction, 'ci95': [0.0, 1.0]}},
        'seconds': seconds}


def truth(kind: str, *ids: str, size: float = 0.5) -> dict[str, Any]:
    """Return as much of a truth as the scorecard reads."""
    return {'kind': kind, 'effects': [{'id': name, 'size': size, 'parameters': {}}
                                      for name in ids]}


def case(kind: str, ids: list[str], content: Any) -> Case:
    """Return a case."""
    return Case(truth(kind, *ids), parse_verdict(content) if content else None)


CASES = [
    # four singles: right; right by its set; third; failed
    case('single', ['a.x'], verdict(('a.x', 0.95), ('unknown', 0.05), seconds=4.0)),
    case('single', ['b.x'], verdict(('b.y', 0.55), ('b.x', 0.45), confusable=[['b.x', 'b.y']],
                                    fraction=0.8)),
    case('single', ['c.x'], verdict(('d.x', 0.5), ('none', 0.3), ('c.x', 0.2))),
    case('single', ['d.x'], None),
    # two pairs: both named, one through a set; one named
    case('pair', ['a.x', 'b.x'], verdict(('a.x+b.y', 0.85), ('unknown', 0.15), fraction=0.7,
                                         confusable=[['b.x', 'b.y', 'b.z']])),
    case('pair', ['a.x', 'c.x'], verdict(('a.x', 0.75), ('a.x+c.x', 0.25))),
    # two without effect, two outside the catalogue
    case('none', [], verdict(('none', 0.97), ('unknown', 0.03), word='no_gap')),
    case('none', [], verdict(('a.x', 0.65), ('none', 0.35))),
    case('outside', ['outside.o'], verdict(('unknown', 1.0), word='unknown_effect')),
    case('outside', ['outside.o'], verdict(('c.x', 0.96), ('unknown', 0.04))),
]


def test_every_figure_by_hand() -> None:
    figures = score(CASES, pending=3)
    assert set(KEYS) <= set(figures)
    assert figures['cases'] == 10
    assert figures['failures'] == 1
    assert figures['pending'] == 3
    assert figures['top1'] == 2 / 4
    assert figures['top1_exact'] == 1 / 4
    assert figures['top3'] == 3 / 4
    assert figures['top3_exact'] == 3 / 4
    assert figures['within_set'] == 2 / 4
    assert figures['pairs_both'] == 1 / 2
    assert figures['pairs_one'] == 1.0
    assert figures['no_gap_on_none'] == 1 / 2
    assert figures['overconfident_outside'] == 1 / 2
    # unknown: outside 1 and 0.04; the seven others with a verdict 0.05, 0.15, 0.03 and zeros
    assert figures['auroc_unknown'] == pytest.approx((7 + 5) / 14)
    assert figures['explained_fraction_median'] == pytest.approx(0.8)
    assert figures['seconds_median'] == 10.0
    # confidences: 0.95 right, 1.0 (the set's sum) right, 0.5 wrong, 0.85 right, 0.75 wrong,
    # 0.97 right, 0.65 wrong, 1.0 right, 0.96 wrong; 0.95, 0.96, 0.97, 1, 1 share a bin
    top_bin = abs(4 / 5 - (0.95 + 1.0 + 0.97 + 1.0 + 0.96) / 5)
    assert figures['ece'] == pytest.approx((5 * top_bin + 0.5 + 0.15 + 0.75 + 0.65) / 9)
    assert figures['by_kind']['single'] == {
        'cases': 4, 'failures': 1, 'top1': 0.5, 'top3': 0.75}
    assert figures['by_effect']['outside.o'] == {
        'cases': 2, 'failures': 0, 'top1': 0.5, 'top3': 1.0}   # 'unknown' came second
    assert figures['by_size']['middle']['cases'] == 4
    assert figures['confusion']['d.x'] == {'failure': 1}
    assert figures['confusion']['c.x'] == {'d.x': 1}


def test_detection_alarms_and_probability_by_hand() -> None:
    figures = score(CASES)
    # of four singles, two pairs and two outside only the failure gives no alarm
    assert figures['detection_rate'] == 7 / 8
    assert figures['false_alarm_rate'] == 1 / 2
    # 0.95; the set's 0.55 + 0.45; 0.2; 0; the pairs 0.85 and 0.25
    assert figures['true_probability_mean'] == pytest.approx((0.95 + 1.0 + 0.2 + 0.85 + 0.25) / 6)
    assert figures['ci95']['detection_rate'] == list(rate([True] * 7 + [False]))[1:3]


def test_figures_of_a_site_by_hand() -> None:
    """Two healthy cases weigh 0.9 together, the eight others 0.1."""
    figures = score(CASES)['site']
    assert figures['healthy'] == 0.9
    # right: one of two healthy ones; 2 of 4 singles, 1 of 2 pairs, 1 of 2 outside
    assert figures['right'] == pytest.approx(0.9 / 2 + 0.1 * 4 / 8)
    assert figures['alarms'] == pytest.approx(0.9 / 2 + 0.1 * 7 / 8)
    assert figures['alarms_true'] == pytest.approx(0.0875 / (0.45 + 0.0875))
    # an effect is named first in one healthy case and six others, three of them rightly
    assert figures['named_right'] == pytest.approx(0.0375 / (0.45 + 0.075))
    assert math.isnan(score(CASES[:4])['site']['right'])


def sized(key: str, truth_values: dict[str, float], parameter: str, unit: str,
          stated: tuple[float, float, float], family: str = 'a') -> Case:
    """Return a case whose verdict states the size of its effect."""
    content = verdict((key, 1.0))
    content['which'][0]['parameters'] = {f'{key}.{parameter}': {
        'value': stated[0], 'ci95': list(stated[1:]), 'unit': unit}}
    made = truth('single', key)
    made['effects'][0]['parameters'] = truth_values
    return Case({**made, 'family': family}, parse_verdict(content))


def test_sizes_are_compared_in_the_verdicts_own_terms() -> None:
    cases = [
        sized('gearbox_1.gap', {'factor': 1.5}, 'change', '1', (0.45, 0.4, 0.6)),
        sized('axis.mode_frequency', {'factor': 0.8, 'mode': 2.0}, 'change_2', '1',
              (-0.25, -0.26, -0.24)),
        # 0.46 ohm doubled
        sized('motor_2.armature_resistance', {'factor': 2.0}, 'change', 'ohm', (0.46, 0.4, 0.5)),
        # -10.74 V shifted by a tenth of itself
        sized('torque_share.fade_out_voltage', {'shift': -1.074}, 'change', '1', (0.12, 0.0, 0.2)),
        # 0.069 A tripled
        sized('motors.coulomb_friction', {'factor': 3.0}, 'torque', 'article A',
              (0.138, 0.1, 0.2)),
        sized('axis.wind_steady', {'torque': -5e4}, 'torque', 'N m', (-6e4, -5.5e4, -6.5e4)),
        # not comparable: another law, another unit, another parameter
        sized('axis.viscous_friction', {'coefficient': 1e6}, 'torque_per_rate', 'N m s/rad',
              (1e6, 9e5, 2e6)),
        sized('gearbox_1.hysteresis', {'share': 0.1}, 'share', '1', (0.1, 0.0, 1.0), family='b'),
        sized('gearbox_1.hysteresis', {'share': 0.1}, 'torque', 'N m', (0.1, 0.0, 1.0)),
        sized('loop.delay', {'delay': 1e-3}, 'error_time', 'ms', (1e-3, 0.0, 1.0))]
    compared = [size for each in cases for size in each.sizes]
    assert [size.relative_error for size in compared] == pytest.approx(
        [0.1, 0.25, 0.0, 0.2, 0.0, 0.2])
    assert [size.covered for size in compared] == [True, False, True, True, True, False]
    figures = score(cases)
    assert figures['sizes_compared'] == 6
    assert figures['size_error_median'] == pytest.approx(0.15)
    assert figures['size_coverage'] == pytest.approx(4 / 6)


@pytest.mark.parametrize(('short', 'covered'), [(1e-13, True), (1e-6, False)])
def test_an_interval_that_ends_at_the_true_size_holds_it(short: float, covered: bool) -> None:
    """As that of an encoder's digit, which its column shows to the last place."""
    stated = Interval(1.35e-4, 5e-5, 1.4e-4 * (1.0 - short), 'rad')
    assert StatedSize('encoder.quantisation', 1.4e-4, stated).covered == covered


def test_size_of_an_effect_that_is_not_named_first_is_not_compared() -> None:
    made = sized('gearbox_1.gap', {'factor': 1.5}, 'change', '1', (0.5, 0.4, 0.6))
    content = verdict(('gearbox_2.gap', 0.6), ('gearbox_1.gap', 0.4))
    assert Case(made.truth, parse_verdict(content)).sizes == []


@pytest.mark.parametrize('parameters', [
    None, [], {'gearbox_1.gap.change': 0.5}, {'gearbox_1.gap.change': {'value': 0.5}},
    {'gearbox_1.gap.change': {'value': 0.5, 'ci95': [0.4, None], 'unit': '1'}}])
def test_verdict_without_an_interval_still_counts(parameters: Any) -> None:
    """Parameters are scored where they are stated; older verdicts need not."""
    content = verdict(('gearbox_1.gap', 1.0))
    content['which'][0]['parameters'] = parameters
    made = sized('gearbox_1.gap', {'factor': 1.5}, 'change', '1', (0.5, 0.4, 0.6))
    again = Case(made.truth, parse_verdict(content))
    assert again.right
    assert again.sizes == []


@given(PLAIN, PLAIN)
def test_whatever_a_verdict_adds_is_taken_or_refused_by_name(parameters: Any, names: Any) -> None:
    content = verdict(('gearbox_1.gap', 1.0))
    content['which'][0]['parameters'] = parameters
    content['held_back'] = names
    made = sized('gearbox_1.gap', {'factor': 1.5}, 'change', '1', (0.5, 0.4, 0.6))
    try:
        found = parse_verdict(content)
    except VerdictError as error:
        assert str(error).startswith('held_back')
    else:
        assert all(math.isfinite(size.relative_error) for size in Case(made.truth, found).sizes)
        assert all('/' not in name for name in found.held_back.values())


def test_every_comparable_size_is_a_parameter_of_the_catalogue() -> None:
    """Names and units against the catalogue, which the trial itself cannot import."""
    effects = catalogue()
    compared = 0
    for key, defect in CATALOGUE.items():
        values = defect.draw(0.7, np.random.default_rng(1))
        size = size_of(key, values)
        if size is None:
            continue
        compared += 1
        units = {p.name: p.unit for form in effects[key].forms for p in form.parameters}
        assert f'{key}.{size.parameter}' in units
        stated = units[f'{key}.{size.parameter}'].removeprefix('article ')
        assert size.unit in ('', stated)
        assert size.true != 0.0
    # by hand: motors 21, gearboxes 6, share 5, axis 7, readings 11, loop 1
    assert compared == 51


@pytest.fixture
def kept_back(tmp_path: Path) -> Path:
    """Return a wild trial of one case with a recording kept back: a ramp and noise."""
    column = {'level': 2.0, 'coloured_share': 0.0, 'corner_hz': 1.0}
    made = {'case': 'case_0001', **truth('single', 'a.x'), 'sample_rate_hz': 100.0,
            'sheets': [CaseSheet('old', 'old', {'type': 'circuit'}, {}).plain()],
            'imperfections': {'spike_share': 0.0, 'noise': {
                name: column for name in ('current_1_A', 'bias_voltage_V')}}}
    sealing.seal(tmp_path, {'cases': 1}, [made])
    (tmp_path / 'case_0001').mkdir()
    (tmp_path / 'kept' / 'case_0001').mkdir(parents=True)
    time = np.arange(0.0, 20.0, 0.01)
    noise = np.random.default_rng(5).normal(0.0, 0.02, (2, len(time)))
    table(tmp_path / 'kept' / 'case_0001' / 'rec_d.csv', time, time + noise[0], noise[1])
    table(tmp_path / 'case_0001' / 'before.csv', time, time + 1.0, 0.0 * time)
    return tmp_path


def table(path: Path, *columns: Any) -> None:
    """Write a CSV of time, one current and the bias voltage."""
    np.savetxt(path, np.transpose(columns), delimiter=',', comments='',
               header='time_s,current_1_A,bias_voltage_V')


def held_back_case(folder: Path, names: Any) -> Case:
    """Return the case with a verdict that brings predictions."""
    content = {**verdict(('a.x', 1.0)), 'held_back': names}
    (folder / 'case_0001' / 'verdict.json').write_text(json.dumps(content))
    return read_cases(folder)[0][0]


@pytest.mark.parametrize(('error', 'closed'), [
    (0.0, 1.0), (0.5, 0.75), (1.0, 0.0), (3.0, -1.0)])
def test_what_is_closed_on_the_recording_kept_back(
        kept_back: Path, error: float, closed: float) -> None:
    """The mean square of an error of 1 and of `error`; the bias has no gap and does not count."""
    time = np.arange(-0.005, 20.0, 0.02)    # other rows: predictions are straight lines
    table(kept_back / 'case_0001' / 'after.csv', time, time + error, 9.0 + 0.0 * time)
    case = held_back_case(kept_back, {'before': 'before.csv', 'after': 'after.csv'})
    assert case.closed == pytest.approx(closed, abs=2e-3)
    assert score([case])['closed_held_back_median'] == pytest.approx(closed, abs=2e-3)


def test_without_predictions_nothing_is_said_about_the_recording_kept_back(
        kept_back: Path) -> None:
    case = held_back_case(kept_back, None)
    assert case.verdict is not None
    assert math.isnan(case.closed)


@pytest.mark.parametrize('names', [
    {'before': 'before.csv', 'after': 'none.csv'}, {'before': 'before.csv'}, 'before.csv',
    {'before': 'before.csv', 'after': '../kept/case_0001/rec_d.csv'},
    {'before': 'before.csv', 'after': 'short.csv'},
    {'before': 'before.csv', 'after': 'words.csv'}])
def test_predictions_that_are_none_are_a_failure(kept_back: Path, names: Any) -> None:
    time = np.arange(0.0, 10.0, 0.01)
    table(kept_back / 'case_0001' / 'short.csv', time, time, time)
    (kept_back / 'case_0001' / 'words.csv').write_text('time_s\nnever\n')
    assert held_back_case(kept_back, names).verdict is None


def test_noise_of_a_wild_recording_is_what_the_truth_says() -> None:
    """The floor against the spread of what the recorder adds to a drive that stands still."""
    made = draw_truths(1, 8, 0.0, wild=True)[0]
    own = made['imperfections']
    own |= {'tach_zero_rad_s': [0.0, 0.0], 'amplifier_zero_V': [0.0, 0.0], 'spike_share': 0.01}
    machine = reference_machine()
    apply_imperfections(machine, own)
    columns = imperfect_recording(
        machine, CaseSheet('old', 'old', {'type': 'fixed', 'voltage_V': 0.0}, {}), own, 500.0,
        100.0, np.random.default_rng(4))
    for name in ('current_2_A', 'tach_rate_1_rad_s', 'bias_voltage_V'):
        assert noise_power(name, made, columns[name]) == pytest.approx(
            float(np.var(columns[name])), rel=0.12)


def test_nothing_scored_is_no_number() -> None:
    figures = score([])
    assert figures['cases'] == 0
    assert math.isnan(figures['site']['alarms_true'])
    for name in KEYS[2:]:
        assert math.isnan(figures[name])


def test_sets_of_more_than_five_do_not_count() -> None:
    large = verdict(('b.y', 1.0), confusable=[['b.x', 'b.y', 'b.1', 'b.2', 'b.3', 'b.4']])
    split = verdict(('b.y', 1.0), confusable=[['b.x', 'b.y'], ['b.y', 'b.1', 'b.2'],
                                              ['b.y', 'b.3', 'b.4']])
    five = verdict(('b.y', 1.0), confusable=[['b.x', 'b.y', 'b.1'], ['b.y', 'b.2', 'b.3']])
    assert [case('single', ['b.x'], content).right for content in (large, split, five)] == [
        False, False, True]


def test_pair_needs_two_different_members() -> None:
    both = verdict(('b.x+b.y', 1.0), confusable=[['b.x', 'b.y', 'c.x']])
    assert case('pair', ['b.y', 'c.x'], both).right
    assert case('pair', ['b.x', 'b.y'], both).right
    assert not case('pair', ['a.x', 'b.x'], both).right
    assert not case('single', ['b.x'], both).right


def test_unranked_verdict_is_ranked() -> None:
    content = verdict(('a.x', 0.1), ('b.x', 0.7), ('unknown', 0.2))
    assert case('single', ['b.x'], content).right


@pytest.mark.parametrize(('key', 'value'), [
    ('verdict', 'perhaps'), ('which', []), ('which', 'a.x'), ('which', [{'effects': ['a.x']}]),
    ('which', [{'effects': [], 'probability': 1.0}]),
    ('which', [{'effects': ['a.x'], 'probability': 0.5}]),
    ('which', [{'effects': ['a.x'], 'probability': math.nan}]),
    ('which', [{'effects': ['a.x'], 'probability': True}]),
    ('which', [{'effects': 'a.x', 'probability': 1.0}]), ('which', [1]),
    ('confusable', [['a.x', 1]]), ('confusable', 'a.x')])
def test_verdict_that_breaks_its_promise_is_refused(key: str, value: Any) -> None:
    with pytest.raises(VerdictError, match=key):
        parse_verdict({**verdict(('a.x', 1.0)), key: value})


def test_verdict_may_leave_out_what_is_not_scored_alone() -> None:
    short = parse_verdict({'verdict': 'explained',
                           'which': [{'effects': ['a.x'], 'probability': 1.0}]})
    assert isinstance(short, Verdict)
    assert math.isnan(short.explained_fraction)
    assert math.isnan(short.seconds)


def test_auroc_counts_pairs() -> None:
    assert auroc([0.9, 0.4], [0.1, 0.4, 0.8]) == pytest.approx((3 + 1.5) / 6)
    assert math.isnan(auroc([], [0.1]))


def test_wilson_interval() -> None:
    """Agresti and Coull's textbook case: 0 of 10 gives 0 to 0.278, 9 of 10 0.596 to 0.982."""
    assert rate([False] * 10)[:3] == pytest.approx((0.0, 0.0, 0.2775), abs=5e-4)
    assert rate([True] * 9 + [False])[:3] == pytest.approx((0.9, 0.596, 0.982), abs=5e-4)


def test_reliability_of_a_calibrated_answer_is_perfect() -> None:
    bins = reliability([0.75] * 4 + [1.0], [True, True, True, False, True])
    assert calibration_error(bins) == 0.0
    assert [b.cases for b in bins] == [0, 0, 0, 0, 0, 0, 0, 4, 0, 1]


@pytest.fixture
def scored_trial(tmp_path: Path) -> Path:
    """Return a sealed trial of four cases: right, broken, failed, pending."""
    truths = [{'case': f'case_{k:04d}', **truth('single', 'a.x')} for k in range(1, 5)]
    sealing.seal(tmp_path, {'cases': 4}, truths)
    for name in ('case_0001', 'case_0002', 'case_0003'):
        (tmp_path / name).mkdir()
    (tmp_path / 'case_0001' / 'verdict.json').write_text(json.dumps(verdict(('a.x', 1.0))))
    (tmp_path / 'case_0002' / 'verdict.json').write_text('{}')
    (tmp_path / 'case_0003' / 'failure.txt').write_text('exit code 1')
    return tmp_path


def test_command_scores_a_folder(scored_trial: Path, tmp_path: Path,
                                 capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('matplotlib')
    picture = tmp_path / 'score.png'
    assert main(['score', str(scored_trial), '--json', '-', '--picture', str(picture)]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures['cases'], figures['failures'], figures['pending']) == (3, 2, 1)
    assert figures['top1'] == pytest.approx(1 / 3)
    assert figures['pairs_both'] is None
    assert picture.read_bytes().startswith(b'\x89PNG')
    assert main(['score', str(scored_trial)]) == 0
    told = capsys.readouterr().out
    assert 'top1' in told
    assert '0.333' in told


@pytest.mark.parametrize(('more', 'least'), [
    ({}, '0.90'), ({'family': 'a'}, '0.85'), ({'machine': 'joint'}, '0.80')])
def test_each_kind_of_trial_has_its_own_targets(
        more: dict[str, str], least: str, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    sealing.seal(tmp_path, {'cases': 1}, [
        {'case': 'case_0001', **truth('none'), **more}])
    (tmp_path / 'case_0001').mkdir()
    (tmp_path / 'case_0001' / 'verdict.json').write_text(json.dumps(verdict(('none', 1.0))))
    assert main(['score', str(tmp_path)]) == 0
    [line] = [told for told in capsys.readouterr().out.splitlines() if told.startswith('top1 ')]
    assert line.endswith(f'target >= {least}')


def test_published_cases_score_as_their_folder(scored_trial: Path, tmp_path: Path,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    stated = {'a.x.offset': {'value': 1.0, 'ci95': [0.5, 1.5], 'unit': 'V'}}
    full = verdict(('a.x', 0.6), ('b.x+a.x', 0.4), confusable=[['a.x', 'c.x']])
    full['which'][0]['parameters'] = stated
    (scored_trial / 'case_0001' / 'verdict.json').write_text(json.dumps(full))
    published = tmp_path / 'trial.jsonl'

    def figures(*arguments: str) -> Any:
        assert main(['score', *arguments, '--json', '-']) == 0
        return json.loads(capsys.readouterr().out)

    of_folder = figures(str(scored_trial), '--cases', str(published))
    assert figures(str(published)) == {**of_folder, 'pending': 0}
    assert len(published.read_text().splitlines()) == 3
    [first, *_] = read_scored(published)
    assert first.verdict == parse_verdict(full)
    assert first.verdict.which[0].parameters['a.x.offset'] == Interval(1.0, 0.5, 1.5, 'V')
    other = tmp_path / 'other.jsonl'
    other.write_text(published.read_text().replace('case_', 'case_1'))
    assert figures(str(published), str(other))['cases'] == 6
    assert main(['score', str(published), str(scored_trial)]) == 2
    assert 'case_0001 is in' in capsys.readouterr().err


def test_a_trial_continued_in_another_folder_scores_as_one(
        scored_trial: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    published = tmp_path / 'first.jsonl'
    assert main(['score', str(scored_trial), '--cases', str(published), '--json', '-']) == 0
    whole = json.loads(capsys.readouterr().out)
    for name in ('case_0001', 'case_0002', 'case_0003'):
        for path in (scored_trial / name).iterdir():
            path.unlink()
    assert main(['score', str(published), str(scored_trial), '--json', '-']) == 0
    assert json.loads(capsys.readouterr().out) == whole
    (scored_trial / 'case_0004').mkdir()
    (scored_trial / 'case_0004' / 'verdict.json').write_text(json.dumps(verdict(('a.x', 1.0))))
    assert main(['score', str(published), str(scored_trial), '--json', '-']) == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures['cases'], figures['pending']) == (4, 0)


@pytest.mark.parametrize('line', [
    '{', '[]', '{"truth": {"kind": "odd"}}', '[' * 100_000,
    '{"truth": {"kind": "single", "effects": [{"id": "a.x"}]}, "verdict": null}',
    '{"truth": {"kind": "none", "effects": []}, "verdict": {}}',
    '{"truth": {"kind": "none", "effects": []}, "verdict": null, "closed": NaN}',
    json.dumps({'truth': {'kind': 'single', 'effects': [
        {'id': 'tach_1.gain', 'size': 0.5, 'parameters': {'error': 0.0}}]},
        'verdict': {**verdict(('tach_1.gain', 1.0)), 'which': [
            {'effects': ['tach_1.gain'], 'probability': 1.0, 'parameters': {
                'tach_1.gain.change': {'value': 1.0, 'ci95': [0.0, 2.0], 'unit': '1'}}}]}})])
def test_line_that_is_no_case_is_refused(line: str, tmp_path: Path) -> None:
    path = tmp_path / 'cases.jsonl'
    path.write_text('{"truth": {"kind": "none", "effects": []}, "verdict": null}\n' + line)
    with pytest.raises(UserError, match='cases.jsonl: line 2: no case') as caught:
        read_scored(path)
    assert len(str(caught.value)) < 600


def test_command_refuses_a_changed_truth(scored_trial: Path,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    path = scored_trial / 'truth' / 'case_0001.json'
    path.write_text(path.read_text().replace('a.x', 'b.x'))
    assert main(['score', str(scored_trial)]) == 2
    assert 'case_0001.json: not the truth' in capsys.readouterr().err


def test_command_refuses_a_picture_of_unknown_kind(scored_trial: Path,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('matplotlib')
    assert main(['score', str(scored_trial), '--picture', str(scored_trial / 'x.abc')]) == 2
    assert 'x.abc' in capsys.readouterr().err


@pytest.mark.parametrize('text', ['[' * 100_000, f'{{"verdict": "{"x" * 100_000}"}}'])
def test_verdict_that_cannot_be_read_is_refused_in_a_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / 'verdict.json'
    path.write_text(text)
    with pytest.raises(VerdictError, match='verdict.json') as caught:
        read_verdict(path)
    assert len(str(caught.value)) < 600


def test_manifest_nested_too_deeply_is_refused(tmp_path: Path) -> None:
    (tmp_path / sealing.MANIFEST).write_text('[' * 100_000)
    with pytest.raises(sealing.SealError, match='cannot be read'):
        sealing.read_manifest(tmp_path)


def test_command_without_verdicts_says_no(tmp_path: Path) -> None:
    sealing.seal(tmp_path, {}, [{'case': 'case_0001', **truth('none')}])
    assert main(['score', str(tmp_path)]) == 1
