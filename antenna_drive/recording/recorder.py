# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Writes the runs of a drive to bags while it runs, one bag for each run.

The listener of the drive calls `begin`, `step` and `idle` from one thread; `told`, what the
nodes say of their parameters, may come from another.
"""

from collections.abc import Mapping
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from antenna_drive.lockstep.changes import CHANGES, is_record, SETTINGS
from antenna_drive.recording.atomic import refuse_existing
from antenna_drive.recording.bag_writer import BagWriter, SPLIT_S
from antenna_drive.recording.runs import STEP
from antenna_drive.recording.sheet import TestSheet
from simgap.logs.channel import nanoseconds

# How many other runs, and how many records, are kept until the steps have come that far.
_MOST_RUNS = 16
_MOST_RECORDS = 10_000


class RunRecorder:
    """
    Records a drive: every step of every signal, the configuration in force, live changes.

    path : folder of the run in progress, or of the first
    steps : how many steps of it were written
    refused : how often `told` was given what is no record, or too many to keep
    """

    def __init__(self, path: str | Path, signals: Mapping[str, str],
                 sheet: TestSheet | None = None, *, sync_s: float | None = None,
                 split_s: float = SPLIT_S, **notes: Any) -> None:
        """
        Prepare to record.

        path : folder that is not there yet; later runs go to PATH_run_2, PATH_run_3 ...
        signals : name -> unit of every signal, in the order in which `step` gives them
        sheet, notes : see Recording
        sync_s, split_s : see BagWriter

        Raises RecordingError: the folder exists already.
        """
        self.path = self._base = Path(path)
        self.steps = 0
        self.refused = 0
        self._signals = dict(signals)
        self._sheet = sheet
        self._sync_s, self._split_s = sync_s, split_s
        self._notes = notes
        self._bag: BagWriter | None = None
        self._count = 0
        self._run = 0
        self._step_s = 0.0
        self._told: SimpleQueue[tuple[str, Mapping[str, Any]]] = SimpleQueue()
        # by run: nodes tell what is in force before or after the first step gets here
        self._settings: dict[int, dict[str, Any]] = {}
        self._changes: list[tuple[int, int, str, Mapping[str, Any]]] = []
        self._units = {name.partition('/')[0] for name in self._signals}
        refuse_existing(self.path)

    def begin(self, run: int, step_s: float) -> None:
        """
        Begin a new bag, for a run with macro-steps of `step_s` [s].

        Raises RecordingError: the folder exists already, or it or the last bag cannot be written.
        """
        self.close()
        self._count += 1
        if self._count > 1:
            self.path = self._base.with_name(f'{self._base.name}_run_{self._count}')
        self._settings.pop(self._run, None)
        self._run, self.steps = run, 0
        self._step_s = step_s
        self._bag = BagWriter(self.path, self._signals, sheet=self._sheet, sync_s=self._sync_s,
                              split_s=self._split_s,
                              notes={**self._notes, STEP: step_s, 'run': run})
        self._catch_up()

    def step(self, number: int, values: list[float]) -> None:
        """
        Write one step of the run that has begun.

        number : of the macro-step
        values : one for each signal, NaN where there is no sample

        Raises RecordingError: the disk is full, or the bag cannot be written.
        """
        assert self._bag is not None
        self._bag.write(number, nanoseconds(number * self._step_s), values)
        self.steps += 1
        if not self._told.empty():
            self._catch_up()

    def told(self, unit: str, record: Mapping[str, Any] | None) -> None:
        """
        Take what was said on `<unit>/changes`; from any thread.

        Anybody can say anything there: what is no record of a change is counted and left out.
        """
        if record is None or not is_record(record) or self._told.qsize() >= _MOST_RECORDS:
            self.refused += 1
        else:
            self._told.put((unit, record))

    def idle(self) -> None:
        """Make safe what was written, when no step comes for a while; errors as of `step`."""
        self._catch_up()
        if self._bag is not None and not self._bag.closed:
            self._bag.flush()

    def close(self) -> None:
        """Complete the bag; errors as of `step`."""
        self._catch_up()
        if self._bag is not None and not self._bag.closed:
            self._bag.close()
        self._bag = None

    @property
    def knows_configuration(self) -> bool:
        """Tell whether every unit has said what is in force in this run."""
        return set(self._settings.get(self._run, {})) >= self._units

    @property
    def settings(self) -> Mapping[str, Any]:
        """Return by unit what it has said that is in force as this run begins."""
        return dict(self._settings.get(self._run, {}))

    def _catch_up(self) -> None:
        fresh = False
        while True:
            try:
                unit, record = self._told.get_nowait()
            except Empty:
                break
            run = record['run']
            if SETTINGS in record:
                self._settings.setdefault(run, {})[unit] = record[SETTINGS]
                fresh = fresh or run == self._run
            else:
                self._changes.append((run, record['step'], unit, record[CHANGES]))
        self._forget_most()
        if self._bag is None or self._bag.closed:
            return
        if fresh or (self._run in self._settings and not self.steps):
            self._bag.know(self._settings[self._run])
        later = []
        for run, step, unit, values in self._changes:
            if run == self._run:
                self._bag.change(step, unit, values)
            else:  # of another run, which may be the next
                later.append((run, step, unit, values))
        self._changes = later

    def _forget_most(self) -> None:
        # No node is several runs ahead: records of many other runs are not genuine.
        while len(self._settings) > _MOST_RUNS:
            of_another = [run for run in self._settings if run != self._run]
            del self._settings[of_another[0]]
            self.refused += 1
        if len(self._changes) > _MOST_RECORDS:
            self.refused += len(self._changes) - _MOST_RECORDS
            del self._changes[:-_MOST_RECORDS]
