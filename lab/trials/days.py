# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Joints and axes recorded on three days, and once more the third day with another specimen.

Each day is diagnosed alone, and three days together: of one machine, and with the other specimen.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations
import json
from pathlib import Path
from typing import Any

from lab.antenna.cases import case_name, Truth
from lab.joints.cases import draw_imperfections, make_recording
from lab.joints.machines import kind_of, MACHINES
from lab.joints.programme import draw_tests
from lab.trials import batch, sealing
from lab.trials.driver import Arm, complete, Row
from lab.trials.scorecard import Rate, rate
import numpy as np
from simgap.model import diagnose_logs, load_model, read_logs

# Standard deviations from day to day, as shares, and what is left of the friction of another.
BY_DAY = {'coulomb': 0.04, 'viscous': 0.06, 'damping': 0.06, 'constant': 0.003}
RUBBING, LESS = ('coulomb', 'viscous'), 0.7
LONGEST_S = 10.0
ALONE, HEALTHY, OTHER = ('1', '2', '3'), '1_2_3', '1_2_other'


def draw(count: int, seed: int) -> list[Truth]:
    """Draw machines in good order, and by how much their numbers are off on each day."""
    truths = []
    for number in range(1, count + 1):
        random = np.random.default_rng([seed, number])
        kind = kind_of(MACHINES[number % len(MACHINES)])
        restless = float(random.uniform(0.5, 1.25))
        truths.append({
            'case': case_name(number), 'machine': kind.name, 'effects': [],
            'deviations': kind.deviations(random), 'seed': [seed, number], 'sample_rate_hz': 200,
            'days': [{name: 1.0 + restless * share * float(random.normal())
                      for name, share in BY_DAY.items()} for _ in ALONE],
            'tests': [{**test, 'duration_s': min(test['duration_s'], LONGEST_S)}
                      for test in draw_tests(kind.table, random)],
            'imperfections': draw_imperfections(kind, random)})
    return truths


def run_trial(folder: Path, count: int, seed: int, jobs: int) -> dict[str, Rate]:
    """Seal, record, diagnose and score, as far as that is not done; return the shares."""
    if not (folder / sealing.MANIFEST).exists():
        sealing.seal(folder, {'cases': count, 'seed': seed}, draw(count, seed))
    manifest = sealing.read_manifest(folder)
    print(f'{folder}: manifest {sealing.manifest_seal(manifest)}', flush=True)
    names = list(manifest['seals'])
    complete(names, partial(sealing.open_truth, folder, manifest=manifest),
             [Arm(lambda name, row: not (folder / name / f'{OTHER}.json').exists(),
                  partial(_diagnosed, folder))], jobs=jobs)
    return scored([folder / name for name in names])


def scored(cases: Sequence[Path]) -> dict[str, Rate]:
    """Return the share of each figure in some cases that were diagnosed."""
    verdicts = [{days: json.loads((case / f'{days}.json').read_text(encoding='utf-8'))
                 for days in (*ALONE, HEALTHY, OTHER)} for case in cases]
    overlap = [max(low) <= min(high) for found in verdicts
               for same in zip(*(_numbers(found[day]) for day in ALONE), strict=True)
               for pair in combinations(same, 2)
               for low, high in [zip(*(item['ci95'] for item in pair), strict=True)]]
    return {name: rate(share) for name, share in {
        'intervals of a number from two days that overlap': overlap,
        'healthy machines without an effect': [
            found[HEALTHY]['which'][0]['effects'] == ['none'] for found in verdicts],
        'healthy machines with a difference': [
            bool(_differing(found[HEALTHY])) for found in verdicts],
        'other specimens that were found': [
            any(name in RUBBING or 'friction' in name for name in _differing(found[OTHER]))
            for found in verdicts]}.items()}


def _numbers(verdict: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [item for item in verdict['reproducibility'] if item['belongs_to'] != 'test']


def _differing(verdict: Mapping[str, Any]) -> list[str]:
    """Return the numbers and the effects that differ between days or specimens."""
    return [*(item['number'] for item in _numbers(verdict) if item['differs']),
            *(effect for label in verdict['labels'] for effect in label['differ'])]


def _diagnosed(folder: Path, truth: Truth) -> Row:
    case, kind = folder / truth['case'], kind_of(truth['machine'])
    case.mkdir(exist_ok=True)
    for number, name in enumerate((*ALONE, 'other')):
        day, other = min(number, 2), name == 'other'
        less = dict.fromkeys(RUBBING, LESS if other else 1.0)
        own = {**truth, 'seed': [*truth['seed'], number], 'deviations': {
            key: factor * truth['days'][day].get(key, 1.0) * less.get(key, 1.0)
            for key, factor in truth['deviations'].items()}}
        batch.write_csv(case / f'{name}.csv', make_recording(own, day), kind.formats)
        (case / f'{name}.yaml').write_text(
            f'labels: {{day: "{day + 1}", specimen: {"B" if other else "A"}}}\n')
    for days in (*ALONE, HEALTHY, OTHER):
        if not (path := case / f'{days}.json').exists():
            logs = read_logs([case / f'{name}.csv' for name in days.split('_')])
            sealing.write_whole(path, diagnose_logs(load_model(kind.model), logs,
                                                    threads=1).to_json())
    return {}
