# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A machine by its model: tests that a command plays, and the diagnosis of their logs."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from simgap.logs.log import read_log
from simgap.model.allowed_tests import OwnTests
from simgap.model.declared import Model
from simgap.model.diagnose import diagnose_logs
from simgap.next_test.investigation import Bench, Investigation, InvestigationPlan
from simgap.search.rival import Rival
from simgap.verdict.diagnosis import Progress
from simgap.verdict.record import Verdict

# Plays a test: number, CSV of its commands, duration [s], CSV of the log to write.
Play = Callable[[int, Path, float, Path], None]


class ModelBench(Bench):
    """A machine on which the tests of its model are played; ModelError if it declares none."""

    played = 'command_{number}.csv'

    def __init__(self, model: Model, duration_s: float, play: Play, threads: int = 2) -> None:
        self.space = OwnTests(model, duration_s)
        self.limits = dict(model.limits)
        self._model, self._play, self._threads = model, play, threads

    def save(self, test: Any, path: Path) -> None:
        for place, text in self.space.files(test, path).items():
            place.write_text(text, encoding='utf-8')

    def run(self, number: int, test: Path, duration: float, out: Path) -> None:
        self._play(number, test, duration, out)
        constants = test.with_suffix('.yaml')
        if constants.exists():
            test.with_name(f'test_{number}.yaml').write_bytes(constants.read_bytes())

    def diagnose(self, recordings: Mapping[str, Path], progress: Progress,
                 earlier: Sequence[Rival]) -> Verdict:
        return diagnose_logs(self._model, [read_log(path) for path in recordings.values()],
                             progress, self._threads, earlier=earlier)


def investigate(model: Model, folder: Path, play: Play,
                plan: InvestigationPlan = InvestigationPlan(), threads: int = 2) -> dict[str, Any]:
    """Test a machine until the answer is sure; return the story, see `Investigation.run`."""
    return Investigation(folder, ModelBench(model, plan.duration, play, threads), plan,
                         threads=threads).run()
