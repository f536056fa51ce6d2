# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a trial has found so far, in one file of JSON lines: one line for each case.

What the file holds is not done again. A trial whose folder is gone therefore goes on where it was
if the file is put into a new folder.
"""

from collections.abc import Iterator, Mapping
import json
from pathlib import Path
from threading import Lock
from typing import Any

from lab.trials import sealing
from simgap.errors import one_line, UserError

FILE = 'results.jsonl'


class TrialResults:
    """
    The results of a trial, kept in its folder unless `file` is given.

    Raise UserError, with file and line, where a line is not a result of this trial.
    """

    def __init__(self, folder: Path, manifest: Mapping[str, Any],
                 file: Path | None = None) -> None:
        """Read what there is."""
        self._path = file or folder / FILE
        self._seed = manifest['settings']['seed']
        self._names = list(manifest['seals'])
        self._found: dict[str, dict[str, Any]] = {}
        self._lock = Lock()
        if self._path.exists():
            self._read()

    def _read(self) -> None:
        try:
            lines = self._path.read_text(encoding='utf-8').splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise UserError(f'{self._path}: cannot be read, {one_line(error, 200)}') from error
        for number, line in enumerate(lines, 1):
            try:
                item = json.loads(line)
                name, seed = item.pop('case'), item.pop('seed')
            except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
                raise UserError(f'{self._path}: line {number}: no result of a trial, '
                                f'{one_line(error, 200)}; remove the line') from None
            if name not in self._names or seed != self._seed:
                raise UserError(f'{self._path}: line {number}: {name} of seed {seed} is no case '
                                'of this trial; give the cases and the seed of the trial that '
                                'the file is from')
            self._found[name] = item

    def __getitem__(self, name: str) -> dict[str, Any]:
        """Return what is known of a case; nothing is no error."""
        return dict(self._found.get(name, {}))

    def __iter__(self) -> Iterator[str]:
        """Yield the names of the cases of which something is known, in order."""
        return (name for name in self._names if name in self._found)

    def put(self, name: str, **known: Any) -> None:
        """Add to what is known of a case (dicts by entry); write the file whole, thread-safely."""
        with self._lock:
            row = self._found.setdefault(name, {})
            row |= {key: {**row.get(key, {}), **value} if isinstance(value, dict) else value
                    for key, value in known.items()}
            sealing.write_whole(self._path, ''.join(
                json.dumps({'case': case, 'seed': self._seed, **self._found[case]}) + '\n'
                for case in self))
