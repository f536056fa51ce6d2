# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The result of a campaign: counts over all trials, and every finding with how to repeat it."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from antenna_drive import __version__
from lab.campaign.trials import PARTS, Trial

# What a campaign must say, whatever its trials have counted.
COUNTS = ('kills', 'kills_to_name', 'kills_named_within_2s', 'orphans', 'bags', 'bags_unreadable',
          'garbage_frames', 'garbage_stepped_on', 'mutated_files', 'tracebacks', 'hangs', 'soak_s',
          'lost_steps', 'wrong_bits')
# Counts of which each one is a fault.
BAD = ('orphans', 'bags_unreadable', 'bags_short', 'garbage_stepped_on', 'tracebacks', 'hangs',
       'gigabytes', 'bad_messages', 'lost_steps', 'wrong_bits', 'wrong_exits', 'named_late',
       'ended_too', 'new_runs', 'half_written', 'changes_refused', 'slowed', 'memory_grew',
       'slopes', 'let_in')


def summary(trials: Sequence[Trial], outcomes: Mapping[str, Mapping[str, Any]],
            settings: Mapping[str, Any], folder: str) -> dict[str, Any]:
    """Return the result as plain data: of the whole plan, with outcomes by id of the trial."""
    done = [outcomes[trial.label] for trial in trials if trial.label in outcomes]
    counts: Counter[str] = Counter(dict.fromkeys(COUNTS, 0))
    for entry in done:
        counts.update(entry['counts'])
    soaks = [entry['figures'] for entry in done if 'memory_slope_MB_per_h' in entry['figures']]
    slope, low, high = soaks[0]['memory_slope_MB_per_h'] if soaks else (None, None, None)
    return {
        **counts,
        'memory_slope_MB_per_h': slope,
        'memory_slope_interval_MB_per_h': [low, high],
        'late_steps': soaks[0].get('late_steps') if soaks else None,
        'trials': len(trials), 'trials_done': len(done),
        'skipped': {entry['id']: entry['skipped'] for entry in done if entry['skipped']},
        'findings': [
            {'trial': entry['id'], **finding,
             'repeat': f'lab campaign --out {folder} --repeat {entry["id"]}'}
            for entry in done for finding in entry['findings']],
        'settings': dict(settings), 'version': __version__,
        'wall_s': round(sum(entry['wall_s'] for entry in done)),
        'parts': {part: _part(part, done) for part in PARTS},
    }


def bad(result: Mapping[str, Any]) -> dict[str, int]:
    """Return the counts of faults that are not zero."""
    return {name: result[name] for name in BAD if result.get(name)}


def _part(part: str, done: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    own = [entry for entry in done if entry['id'].partition('-')[0] == part]
    counts: Counter[str] = Counter()
    for entry in own:
        counts.update(entry['counts'])
    return {'trials': len(own), 'findings': sum(len(entry['findings']) for entry in own),
            'wall_s': round(sum(entry['wall_s'] for entry in own)), 'counts': dict(counts),
            'figures': {entry['id']: entry['figures'] for entry in own if entry['figures']}}
