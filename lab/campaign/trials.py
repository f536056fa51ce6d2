# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a trial is, what it returns, and which trials a campaign of each size has.

A trial is repeatable from its name and the seed of the campaign. Nothing here needs ROS.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
import importlib
import random
from typing import Any, NamedTuple
import zlib

# What each part looks for; each is a module of this package with a function `run`.
PARTS = {
    'starts': 'members that join in random order; step 1000 must be reached, with the right bits',
    'kills': 'kill, stop and end nodes, recorder, observer and player at random moments',
    'parents': 'kill the commands that start nodes; no process may be left',
    'garbage': 'publish invented and nearly right frames at 1 kHz beside a running drive',
    'mutations': 'damage files of every kind that is read',
    'conditions': 'full disk, missing folder, wrong clock, suspension, many drives, slow readers',
    'isolation': 'look at the drive from another network; ROS 2 security',
    'soak': 'run at real time for long: memory, file handles, lost and late steps',
}
# Parts whose trials may run beside one another, as nothing in them depends on how fast it goes.
SIDE_BY_SIDE = frozenset({'mutations'})
SHORT, MEDIUM, FULL = 'short', 'medium', 'full'
DOSES = (SHORT, MEDIUM, FULL)

READERS = ('csv', 'bag', 'bag_part', 'bag_unchecked', 'bag_metadata', 'sheet', 'import_map',
           'import_csv', 'import_npy', 'import_npz', 'import_mat', 'import_json',
           'import_lines', 'import_parquet', 'configuration', 'targets', 'verdict',
           'manifest', 'scored_cases', 'fit_log', 'change', 'frame')
CONDITIONS = ('full_disk', 'read_only_folder', 'removed_folder', 'full_disk_for_commands',
              'clock_set', 'suspended', 'many_drives', 'slow_observer', 'many_changes',
              'second_publishers', 'stopped_beside_garbage', 'stopped_while_others_join')
CHECKS = ('another_network', 'security')


class Trial(NamedTuple):
    """One trial."""

    part: str                   # one of PARTS
    name: str                   # unique within the part
    options: Mapping[str, Any]  # what the size of the campaign decides, such as durations [s]
    patience_s: float           # a trial that takes longer than this hangs

    @property
    def label(self) -> str:
        """Return the name of the trial within the campaign."""
        return f'{self.part}-{self.name}'

    def seed(self, campaign: int) -> int:
        """Return the seed of this trial in the campaign with a seed."""
        return zlib.crc32(f'{campaign} {self.label}'.encode())


@dataclass
class Outcome:
    """What a trial has found."""

    counts: dict[str, int] = field(default_factory=dict)            # add up over trials, as kills
    figures: dict[str, Any] = field(default_factory=dict)           # of this trial, such as a rate
    findings: list[dict[str, Any]] = field(default_factory=list)    # `what` says each in a line
    skipped: str = ''                                               # why it cannot be done here

    def count(self, what: str, number: int = 1) -> None:
        """Add to a count."""
        self.counts[what] = self.counts.get(what, 0) + number

    def find(self, what: str, counted: str = '', **detail: Any) -> None:
        """Note a fault, and add one to the count of its kind if it has one."""
        self.findings.append({'what': ' '.join(what.split()), **detail})
        if counted:
            self.count(counted)


def run_trial(part: str, name: str, options: Mapping[str, Any], seed: int) -> Outcome:
    """Do one trial in this process."""
    module = importlib.import_module(f'lab.campaign.{part}')
    run: Callable[[str, Mapping[str, Any], random.Random], Outcome] = module.run
    return run(name, options, random.Random(seed))


def plan(dose: str, soak_s: float | None = None) -> Iterator[Trial]:
    """Yield the trials of a campaign of one of DOSES; `soak_s` replaces the dose's soak [s]."""
    def sized(short: float, medium: float, full: float) -> Any:
        return {SHORT: short, MEDIUM: medium, FULL: full}[dose]

    for name in CHECKS:
        yield Trial('isolation', name, {}, 300.0)
    for name in CONDITIONS:
        for turn in range(sized(1, 1, 3)):
            yield Trial('conditions', f'{name}_{turn}', {
                'drives': sized(3, 10, 10), 'watch_s': sized(6, 15, 60)}, 600.0)
    for turn in range(sized(4, 20, 150)):
        yield Trial('starts', str(turn), {}, 300.0)
    for turn in range(sized(3, 6, 30)):
        yield Trial('parents', str(turn), {}, 200.0)
    for turn in range(sized(1, 3, 20)):
        yield Trial('kills', str(turn), {
            'kills': sized(6, 10, 10), 'longest_stop_s': sized(4, 10, 30)}, 2400.0)
    for turn in range(sized(1, 2, 10)):
        yield Trial('garbage', str(turn), {'frames': sized(10_000, 60_000, 100_000)}, 1200.0)
    for reader in READERS:
        for block in range(sized(1, 1, 20)):
            yield Trial('mutations', f'{reader}_{block}', {
                'files': sized(500, 2000, 5000)}, 3600.0)
    seconds = soak_s or sized(60.0, 300.0, 3600.0)
    yield Trial('soak', '0', {'duration_s': seconds}, 600.0 + 2.0 * seconds)
