# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The folder of a case as our entries read it, and the two files that they write into it."""

from collections.abc import Callable, Mapping, Sequence
import json
from pathlib import Path
import sys
from typing import Any

from lab.benchmark.cases import COMMAND, SHEET
from lab.benchmark.entries import PREDICTED
from lab.joints.machines import BENCHMARK, kind_of
from lab.trials.batch import VERDICT
import numpy as np
from simgap.errors import UserError
from simgap.model import load_model, Log, Model, Numbers, OneTest, OwnMachine, read_log


class CaseFolder:
    """A case: its model, whose simulation has every effect of the catalogue, and its logs."""

    def __init__(self, folder: Path) -> None:
        """Read it; UserError where it is no case."""
        try:
            self.sheet: Mapping[str, Any] = json.loads((folder / SHEET).read_text('utf-8'))
            name, = (name for name, short in BENCHMARK.items() if short == self.sheet['machine'])
        except (OSError, ValueError, LookupError, TypeError) as error:
            raise UserError(f'{folder / SHEET}: {error}; give the folder of a case') from error
        self.folder = folder
        self.model: Model = load_model(kind_of(name).model)
        self.logs = [read_log(path) for path in sorted(folder.glob('rec_*.csv'))]

    def write(self, which: Sequence[Mapping[str, Any]], **more: Any) -> None:
        """Write the verdict: entries of effects and probability."""
        word = {'none': 'no_gap', 'unknown': 'unknown_effect'}.get(
            which[0]['effects'][0], 'explained')
        (self.folder / VERDICT).write_text(json.dumps(
            {'verdict': word, 'which': list(which), **more}, indent=1) + '\n', encoding='utf-8')

    def predict(self, numbers: Mapping[str, float]) -> None:
        """Write what the kept test would read with the numbers that were found."""
        rows = np.loadtxt(self.folder / COMMAND, delimiter=',', skiprows=1)
        columns, places = self.sheet['columns'], self.model.readings
        blank = {reading.column: np.zeros(len(rows)) for reading in places.values()}
        log = Log('rec_d', rows[:, 0], {columns['reference']: rows[:, 1], **blank})
        whole = OwnMachine(self.model, [log]).logs[0]
        test = OneTest(whole, {name: np.zeros(whole.time.size) for name in self.model.push})
        found = self.model.simulate(Numbers(numbers), test)
        table = np.column_stack([whole.time, *(found[name] for name in places)])
        np.savetxt(self.folder / PREDICTED, table, '%.9g', ',', comments='', header=','.join(
            ['time_s', *(reading.column for reading in places.values())]))


def enter(method: Callable[[CaseFolder], None]) -> None:
    """Let a method answer the case that the command line names; end with a line on a mistake."""
    try:
        method(CaseFolder(Path(*sys.argv[1:2])))
    except UserError as error:
        sys.exit(str(error))
