# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The catalogue's effects as plain numbers, and the drive that has them.

A form of an effect acts as soon as one of its sizes differs from zero; its shapes then count, too.
"""

from collections.abc import Mapping
from dataclasses import replace

from antenna_drive.diagnosis.catalogue import catalogue, EXTRA_MODE
from antenna_drive.diagnosis.excitation import Bias
from antenna_drive.diagnosis.modifiers import (
    AntennaParameter, ReadingModifier, RunModifier, RunSetup,
)
from antenna_drive.diagnosis.waves import Wave
from antenna_drive.parameters.records import record_of, set_of
from antenna_drive.parameters.sets import Axis, Drive, entries
import numpy as np
from simgap.inputs.schema import Entry
from simgap.machine.contract import Parameter


def numbers() -> dict[str, tuple[Entry, float]]:
    """Return every number of every effect by name: what is allowed, and where it starts."""
    found: dict[str, tuple[Entry, float]] = {}
    for effect in catalogue().values():
        for form in effect.forms:
            for item in form.parameters:
                said = f'{effect.cause}, {form.name}'.removesuffix(', ')
                # forms that start at several places share their numbers
                entry, start = found.get(item.name, (
                    Entry(item.unit, item.low, item.high, said), item.start))
                found[item.name] = replace(entry, low=min(entry.low, item.low),
                                           high=max(entry.high, item.high)), start
            if isinstance(form, Wave):
                found[f'{effect.id}.cycles'] = Entry(
                    '1', form.orders[0], form.orders[-1],
                    f'{effect.cause}, cycles per revolution'), form.orders[0]
    return found


def with_effects(drive: Drive, given: Mapping[str, float]) -> Drive:
    """Return the drive with effects, whose `numbers` are given by name."""
    acting: dict[str, Parameter] = {}
    for effect in catalogue().values():
        for form in effect.forms:
            if any(given[size.name] for size in form.sizes):
                made = form.at(given[f'{effect.id}.cycles']) if isinstance(form, Wave) else form
                acting.update(zip((item.name for item in form.parameters), made.parameters))
    record = record_of(drive)
    run = RunSetup(record.view(np.float64), record.dtype, Bias())
    for name in sorted(acting):  # as a diagnosis applies them
        item = acting[name]
        assert isinstance(item, AntennaParameter)
        if isinstance(item.modifier, RunModifier):
            item.modifier.apply(run, given[name])
        elif isinstance(item.modifier, ReadingModifier):
            item.modifier.write(run, given[name])
    run.write_waves()
    axis = record['plant']['axis']
    if axis['mode_inertias'][0, EXTRA_MODE] > 0.0:
        for name, entry in entries(Axis):
            if entry.lengths:  # a number for each mode
                axis[f'{name}_count'] = np.maximum(axis[f'{name}_count'], EXTRA_MODE + 1)
    return set_of(Drive, record)
