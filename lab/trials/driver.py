# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The one driver of all trials: sealed cases, times what is done with each, give rows.

What is done with a case is an arm. Only what is missing is done. A row is kept as soon as an arm
has ended, so a trial that was killed goes on where it was.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from antenna_drive.workers import workers
from lab.trials.results import TrialResults

Row = Mapping[str, Any]
Done = Callable[[int, int], None]


class Arm(NamedTuple):
    """What is done with each case; processes need a function of a module, or a partial of one."""

    lacks: Callable[[str, Row], bool]   # from the name of a case and its row so far
    do: Callable[[Any], Row]            # from what is known of a case to entries of its row


def complete(names: Sequence[str], known: Callable[[str], Any], arms: Sequence[Arm],
             results: TrialResults | None = None, jobs: int = 1, scheduler: str | None = None,
             threads: bool = False, done: Done = lambda part, total: None) -> None:
    """
    Do what the cases lack, the arms of a case one after the other.

    `known` gives what the arms get from the name of a case. Rows are kept in `results`; without it
    the arms keep what they find in the folder of the case. `jobs`, `scheduler` and `threads` are
    as for `workers`; one job without threads is done here. `done` gets the complete cases and all.
    """
    rows: Mapping[str, Row] = {} if results is None else {name: results[name] for name in names}
    lacking = {name: [arm.do for arm in arms if arm.lacks(name, rows.get(name, {}))]
               for name in names}
    wanted = [name for name in names if lacking[name]]
    # a thread keeps the row of each arm at once, what processes find is kept here
    keep = results.put if results is not None and threads else None
    tasks = [(known(name), lacking[name], keep and partial(keep, name)) for name in wanted]
    count = len(names) - len(wanted)
    done(count, len(names))
    for number, result in _results(tasks, jobs, scheduler, threads):
        row = result()
        if results is not None and keep is None:
            results.put(wanted[number], **row)
        count += 1
        done(count, len(names))


def _results(tasks: Sequence[tuple[Any, ...]], jobs: int, scheduler: str | None,
             threads: bool) -> Iterator[tuple[int, Callable[[], Row]]]:
    """Yield the number of each task and a function that returns its row, as they end."""
    if jobs == 1 and scheduler is None and not threads:
        yield from ((number, partial(_row, *task)) for number, task in enumerate(tasks))
    elif tasks:
        with workers(jobs, scheduler, threads=threads) as pool:
            yield from pool.each(_row, tasks)


def _row(case: Any, arms: Sequence[Callable[[Any], Row]], keep: Callable[..., None] | None) -> Row:
    """Return what these arms add to the row of a case."""
    row: dict[str, Any] = {}
    for do in arms:
        found = do(case)
        if keep is not None:
            keep(**found)
        row |= found
    return row
