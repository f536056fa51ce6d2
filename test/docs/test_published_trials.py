# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Trials that are published case by case give the figures that the documents state."""

from __future__ import annotations

from collections.abc import Callable
import json
from pathlib import Path
import re
from typing import Any

from lab.cli.twin_trial import of_onsets, of_verdicts
from lab.trials import investigations, third_tests
from lab.trials.results import FILE, TrialResults
from lab.trials.scorecard import score
from lab.trials.scored_cases import read_scored
import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS, NOTEBOOK = ROOT / 'docs', ROOT / 'lab' / 'notebook'
# columns of the tables of wild trials, in the words of both pages
COLUMNS = {
    'top1': 'one effect, named first', 'top3': 'in the first three',
    'within_set': 'in the first entry and its sets', 'pairs_both': 'both of a pair first',
    'no_gap_on_none': 'healthy called `no_gap`', 'auroc_unknown': 'AUROC of the unknown',
    'overconfident_outside': 'named above 0.9 instead of unknown', 'ece': 'calibration error',
    'size_coverage': 'intervals that hold the size', 'size_error_median': 'median error of a size',
    'closed_held_back_median': 'closed on a fourth recording, median'}
# beginnings of the rows of the table of tame trials
ROWS = {
    'top1': 'true effect first', 'top3': 'true effect in the first three',
    'within_set': 'true effect in what', 'pairs_both': 'both of a pair',
    'no_gap_on_none': '`no_gap`', 'auroc_unknown': 'AUROC', 'overconfident_outside': 'a catalogue',
    'ece': 'expected', 'explained_fraction_median': 'median explained',
    'seconds_median': 'median time'}
TITLE = '| trial | one effect, named first |'


TRIALS = {
    **{f'trial {n}': [f'wild_{n}'] for n in range(9, 19)},
    'trials 16 to 18': ['wild_16', 'wild_17', 'wild_18'],
    'family B': ['family_b_1'], 'rest of family B': ['family_b_2'],
    'fresh family B': ['family_b_3'], 'second fresh family B': ['family_b_4']}


@pytest.mark.parametrize(('page', 'name'), [
    *((NOTEBOOK / page, name) for page in ('diagnosis.md', 'README.md') for name in TRIALS),
    *((DOCS / 'diagnosis.md', name) for name in ('trials 16 to 18', 'second fresh family B'))])
def test_figures_of_a_wild_trial_are_those_of_its_cases(page: Path, name: str) -> None:
    cases = [case for file in TRIALS[name] for case in read_scored(NOTEBOOK / f'{file}.jsonl')]
    text = page.read_text(encoding='utf-8')
    table = text[text.index(TITLE):].split('\n\n')[0].splitlines()
    titles, _, *rows = [[cell.strip() for cell in line.strip('|').split('|')] for line in table]
    # a trial that was published in part has a row for its first cases, too
    published = {int(match.group(1)): row for row in rows
                 if (match := re.fullmatch(rf'{name}, (\d+) cases', row[0]))}
    assert max(published) == len(cases)
    for count, row in published.items():
        figures = score(cases[:count])
        for key, title in COLUMNS.items():
            stated = re.match(r'[\d.]+', row[titles.index(title)])
            assert stated is not None
            assert float(stated.group()) == pytest.approx(figures[key], abs=0.005001), title


def results_of(folder: Path, name: str, wanted: Callable[[str], bool] = lambda case: True,
               ) -> TrialResults:
    """Return the results of some cases of a trial that goes on, as they are published."""
    return results_from(folder, cases_of(name, wanted))


def cases_of(name: str, wanted: Callable[[str], bool] = lambda case: True) -> list[dict[str, Any]]:
    """Return some cases of a trial that goes on, as they are published."""
    return [case for line in (NOTEBOOK / f'{name}.jsonl').read_text(
        encoding='utf-8').splitlines() if wanted((case := json.loads(line))['case'])]


def results_from(folder: Path, cases: list[dict[str, Any]]) -> TrialResults:
    """Return cases as the results of one trial."""
    (folder / FILE).write_text(''.join(f'{json.dumps(case)}\n' for case in cases),
                               encoding='utf-8')
    return TrialResults(folder, {'settings': {'seed': cases[0]['seed']},
                                 'seals': [case['case'] for case in cases]})


def table_of(title: str, place: int = 1) -> list[list[str]]:
    """Return the rows of a table of the page of trials, by its first title and its place."""
    text = (NOTEBOOK / 'next-test-trials.md').read_text(encoding='utf-8')
    table = text.split(f'| {title} |')[place].split('\n\n')[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip('|').split('|')] for line in table]


def check_third_tests(rows: list[list[str]], results: TrialResults) -> None:
    """Compare the rows of a table of third tests with the cases."""
    rules = third_tests.summary(results)['rules']
    assert len(rows) == len(rules)
    for name, share, *between, left in rows:
        found = rules['best_built_in' if name.startswith('best') else name.lower()]
        assert share == f'{round(found["top1"] * found["cases"])} of {found["cases"]}', name
        assert float(left) == found['median_set'], name
        if len(between) > 1:
            assert between[1] == '{right}, {wrong}'.format(**found['sure']), name
            assert float(between[2]) == found['median_rivals'], name


@pytest.mark.parametrize('trial', [1, 2, 3, 4, 5, 6])
def test_figures_of_third_tests_are_those_of_their_cases(trial: int, tmp_path: Path) -> None:
    check_third_tests(table_of('third test', trial),
                      results_of(tmp_path, f'next_test_{trial}'))


def test_the_random_tests_of_five_trials_were_of_the_kind_that_the_page_says(
        tmp_path: Path) -> None:
    kinds = [case['tests']['random']['family'] for trial in range(1, 6)
             for results in [results_of(tmp_path, f'next_test_{trial}')]
             for case in map(results.__getitem__, results) if 'random' in case.get('tests', {})]
    text = ' '.join((NOTEBOOK / 'next-test-trials.md').read_text(encoding='utf-8').split())
    assert f'a triangle in {kinds.count("triangle")} of {len(kinds)} cases' in text


@pytest.mark.parametrize(('title', 'wanted'), [
    ('third test, from case 82 on', lambda case: case >= 'case_0082'),
    ('third test, after 16 cases', lambda case: case <= 'case_0089'),
    ('third test, cases 82 to 89', lambda case: 'case_0082' <= case <= 'case_0089'),
    ('third test, after four cases', lambda case: case <= 'case_0027')])
def test_figures_of_a_part_of_the_fifth_trial_are_those_of_its_cases(
        title: str, wanted: Callable[[str], bool], tmp_path: Path) -> None:
    check_third_tests(table_of(title), results_of(tmp_path, 'next_test_5', wanted))


def test_the_first_figures_of_the_sixth_trial_are_those_of_its_first_cases(tmp_path: Path) -> None:
    results = results_of(tmp_path, 'next_test_6', lambda case: case <= 'case_0040')
    for case in results:
        if 'tests' in results[case]:
            tests = dict(results[case]['tests'])
            results.put(case, tests={**tests, 'random': tests['first_drawn']})
    check_third_tests(table_of('third test, after four cases of trial 6'), results)


def test_the_later_figures_of_the_sixth_trial_are_those_of_their_cases(tmp_path: Path) -> None:
    check_third_tests(table_of('third test, after 16 cases of trial 6'),
                      results_of(tmp_path, 'next_test_6', lambda case: case <= 'case_0094'))


@pytest.mark.parametrize(('title', 'last'), [
    ('third test, trials 5 and 6 with `--after`', 'case_9999'),
    ('third test, trials 5 and 6 with `--after`, after 32 cases', 'case_0094')])
def test_figures_of_both_trials_with_after_are_those_of_their_cases(
        title: str, last: str, tmp_path: Path) -> None:
    cases = [*cases_of('next_test_5', lambda case: case >= 'case_0082'),
             *cases_of('next_test_6', lambda case: case <= last)]
    # both trials number their cases from 1
    results = results_from(tmp_path, [{**case, 'case': f'case_{number:04d}', 'seed': 0}
                                      for number, case in enumerate(cases, 1)])
    check_third_tests(table_of(title), results)


@pytest.mark.parametrize('number', [1, 2])
def test_figures_of_investigations_are_those_of_their_cases(number: int, tmp_path: Path) -> None:
    found = investigations.summary(results_of(tmp_path, f'investigate_{number}'))
    rows = table_of('tests of an investigation', number)
    assert {row[0].removesuffix(', confirmed') for row in rows} == set(found)
    for name, right, interval, wrong, tests, seconds in rows:
        way = name.removesuffix(', confirmed')
        cases = found[way]['cases']
        item = found[way]['until_sure' if way == name else 'until_confirmed']
        assert right == f'{round(item["right"] * cases)} of {cases}', name
        assert interval == '{:.2f} to {:.2f}'.format(*item['ci95']), name
        assert int(wrong) == item['wrong'], name
        assert float(tests) == item['median_tests'], name
        assert float(seconds) == item['median_seconds'], name


def test_the_summary_of_next_tests_is_that_of_all_their_cases(tmp_path: Path) -> None:
    text = ' '.join((DOCS / 'next-test.md').read_text(encoding='utf-8').split())
    found = [third_tests.summary(results_of(tmp_path, f'next_test_{trial}'))['rules']
             for trial in (1, 2, 3, 4, 5, 6)]
    for rule, words in (('proposed', 'proposed tests'), ('square', 'square waves'),
                        ('chirp', 'chirps'), ('triangle', 'triangles'),
                        ('multisine', 'multisines'), ('d-optimal', 'D-optimal tests')):
        cases = sum(rules[rule]['cases'] for rules in found)
        right = sum(round(rules[rule]['top1'] * rules[rule]['cases']) for rules in found)
        assert f'{right} of {cases} {words}' in text
    random = found[-1]['random']
    assert (f'{round(random["top1"] * random["cases"])} of {random["cases"]} random ones in '
            'trial 6') in text
    ways = investigations.summary(results_of(tmp_path, 'investigate_2'))
    right_of = {way: round(item['until_sure']['right'] * item['cases'])
                for way, item in ways.items()}
    assert f'Of {ways["designed"]["cases"]} machines' in text
    assert f'sure and right in {right_of["designed"]}, with one test' in text
    assert f'does so in {right_of["standard"]}, with the same medians' in text


@pytest.mark.parametrize('trial', ['5', '6'])
@pytest.mark.parametrize('key', ROWS)
def test_figures_of_a_tame_trial_are_those_of_its_cases(key: str, trial: str) -> None:
    figures = score(read_scored(NOTEBOOK / f'tame_{trial}.jsonl'))
    text = (NOTEBOOK / 'README.md').read_text(encoding='utf-8')
    table = text[text.index('| figure (95 % interval) |'):].split('\n\n')[0].splitlines()
    titles, _, *rows = [[cell.strip() for cell in line.strip('|').split('|')] for line in table]
    [row] = [row for row in rows if row[0].startswith(ROWS[key])]
    stated = re.match(r'[\d.]+', row[titles.index(trial)])
    assert stated is not None
    assert float(stated.group()) == pytest.approx(
        figures[key], abs=0.5001 if key == 'seconds_median' else 0.005001)


def test_figures_of_growing_verdicts_are_those_of_their_cases() -> None:
    file = NOTEBOOK / 'growing_verdict_2.jsonl'
    *_, stopped, whole, same = of_verdicts(
        [json.loads(line) for line in file.read_text(encoding='utf-8').splitlines()])
    text = (NOTEBOOK / 'twin.md').read_text(encoding='utf-8')
    rows = {cells[0]: cells[1:] for line in text.splitlines() if len(cells := [
        cell.strip() for cell in line.strip('|').split('|')]) == 4}
    for column, line in enumerate((stopped, whole)):
        assert f'right {rows["right answers"][column].partition(" (")[0]};' in line
        assert line.endswith(f'ece {rows["calibration error"][column]}')
    assert same.startswith(rows['right answers'][2].removeprefix('the ').replace(
        ':', ' as after 90 s:'))
    seconds = rows['seconds of testing, median'][0].partition(' (')[0]
    assert same.endswith(f'median {seconds} s of testing')


def test_figures_of_the_twin_on_topics_are_those_of_its_cases() -> None:
    file = NOTEBOOK / 'twin_topics_2.jsonl'
    *_, told, _ = of_onsets(
        [json.loads(line) for line in file.read_text(encoding='utf-8').splitlines()])
    text = (NOTEBOOK / 'twin.md').read_text(encoding='utf-8')
    rows = {cells[0]: cells[1] for line in text.splitlines() if len(cells := [
        cell.strip() for cell in line.strip('|').split('|')]) == 4}
    soon, later, never, middle, alarms = (rows[name].partition(',')[0] for name in (
        'gap told in 10 s', 'told later', 'never told', 'median to the alarm',
        'false alarms before the onset'))
    assert told == (f'told within 10 s: {soon} of 20; later: {later}; never: {never}; median '
                    f'{middle}; alarms before the onset: {0 if alarms == "none" else alarms}')
