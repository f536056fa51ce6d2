# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Rows that a recorder lost, put back because a simulation takes one step from row to row."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from simgap.logs.log import Log

# A command is known in a gap where the rates before and after it tell the way across it up to this
# share of its range.
_KNOWN = 0.01


def without_gaps(log: Log, commands: Sequence[str], settles_s: float = 0.0) -> Log:
    """
    Return a log with all its rows, for `machine(..., log=...)`.

    Where rows lack at even times but for jitter, as many as fit are put in, with NaN for readings.
    Commands are interpolated. Where one jumped or turned in a gap, nobody knows when: readings are
    left out from the gap on until the machine has settled. Raises LogError if a column is missing.

    commands : columns that are known between the rows, too, such as a reference
    settles_s : for which readings are left out after an unknown command [s]
    """
    steps = np.diff(log.time)
    counts = np.maximum(np.round(steps / np.median(steps)).astype(int), 1)
    if np.all(counts == 1):
        return log
    rows = np.r_[0, np.cumsum(counts)]
    every = np.arange(rows[-1] + 1)
    time = np.interp(every, rows, log.time)
    columns = {}
    for name, values in log.columns.items():
        columns[name] = np.full(every.size, np.nan)
        columns[name][rows] = values
    unknown = np.zeros(every.size, dtype=bool)
    for name in commands:
        values = log[name]
        columns[name] = np.interp(every, rows, values)
        rates = np.diff(values) / counts
        for k in np.flatnonzero(counts > 1):
            around = [rates[max(k - 1, 0)], rates[min(k + 1, rates.size - 1)]]
            if abs(rates[k] - np.mean(around)) * counts[k] > _KNOWN * np.ptp(values):
                unknown |= (time > log.time[k]) & (time <= log.time[k + 1] + settles_s)
                continue
            across = CubicHermiteSpline(rows[k:k + 2], values[k:k + 2], around)
            lost = every[rows[k] + 1:rows[k + 1]]
            columns[name][lost] = across(lost)
    for name in columns.keys() - set(commands):
        columns[name][unknown] = np.nan
    return Log(log.name, time, columns, log.constants, log.labels)
