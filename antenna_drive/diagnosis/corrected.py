# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The configuration with what a diagnosis found: the effects, and the tolerances as fitted.

What a number of the configuration stands for is written there. The recorder's own errors are no
part of the machine: they are returned beside it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from antenna_drive.diagnosis.catalogue import EXTRA_MODE
from antenna_drive.diagnosis.excitation import Bias
from antenna_drive.diagnosis.modifiers import (
    AntennaParameter, ReadingModifier, RecorderError, RunModifier, RunSetup, SCALE,
)
from antenna_drive.parameters.loading import load, PLACES
from antenna_drive.parameters.records import place_of, record_of
from antenna_drive.parameters.sets import changed, Drive, values
from antenna_drive.yaml_text import dump_yaml
import numpy as np
from simgap.inputs.schema import Entry
from simgap.machine.contract import FloatArray
from simgap.search.hypothesis import Hypothesis

_SHARE = 'torque_share.circuit'
_POT = f'{_SHARE}.bias_pot'
# The bias voltage is the pot's setting times the output of a circuit within these limits: all
# three scale it as the pot does.
_LIKE_THE_POT = tuple(f'{_SHARE}.{name}' for name in ('k_2', 'saturation_low', 'saturation_high'))
# What a test sets, and no machine is.
_OF_A_TEST = (f'{_SHARE}.fixed_voltage', 'plant.axis.start_elevation',
              'motor_1.start_in_gap', 'motor_2.start_in_gap')
# Its lists have a number for each mode.
_AXIS = 'plant.axis.'
AS_GIVEN = 'as configured, or as the test sheets say'
WITHIN = 'within tolerance, as fitted'
_EFFECT = 'fitted effect '


@dataclass(frozen=True)
class Corrected:
    """A corrected configuration."""

    text: str  # the file
    recorder: tuple[dict[str, Any], ...]  # errors of the recorder: name, value, unit
    unwritten: tuple[str, ...]  # what the file cannot hold, for people


def correct(drive: Drive, records: Sequence[np.ndarray[Any, np.dtype[Any]]],
            hypothesis: Hypothesis) -> Corrected:
    """Return the diagnosed configuration, of `records` in the tests, with a hypothesis in it."""
    given = _as_all_tests_have_it(drive, records)
    point = hypothesis.state.point()
    owner = {p.name: effect for effect, form in hypothesis.items for p in form.parameters}
    fitted = [(p, point[p.name]) for p in hypothesis.state.parameters
              if isinstance(p, AntennaParameter) and not p.of and point[p.name] != 0.0]
    written, recorder, missing = _written(given, fitted)
    why: dict[str, str] = {}
    for effect in hypothesis.effects:
        alone, _, _ = _written(given, [
            (p, value) for p, value in fitted if owner.get(p.name) == effect])
        for path, value in alone.items():
            if value != attrgetter(path)(given):
                why[path] = _EFFECT + effect
    reference = {path: value for path, _, value in values(load())}
    # by section of the file, with a dot where sections are nested: why, name and value
    lines: dict[str, list[tuple[str, str, Any]]] = {}
    sections = {place: section for section, place in PLACES.items()}
    unwritten = [owner.get(p.name) or f'{p.name.partition(":")[0]} of each test' for p in missing]
    for path, entry, old in values(given):
        new = written.get(path, old)
        kept = _allowed(new, entry)
        if kept != new:
            unwritten.append(f'{path} beyond {_plain(kept)}')
        if path not in reference or kept != reference[path]:
            reason = AS_GIVEN if new == old else why.get(path, WITHIN)
            place, _, name = path.rpartition('.')
            lines.setdefault(sections.get(place, place), []).append((reason, name, kept))
    return Corrected(_file(lines, hypothesis), recorder, tuple(dict.fromkeys(unwritten)))


def _as_all_tests_have_it(drive: Drive,
                          records: Sequence[np.ndarray[Any, np.dtype[Any]]]) -> Drive:
    """Return the drive with what all tests agree on: the circuits and settings of their sheets."""
    kind = records[0].dtype
    changes = {}
    for path, _, value in values(drive):
        if isinstance(value, float) and path not in _OF_A_TEST:
            there = {float(record.view(np.float64)[place_of(kind, path)]) for record in records}
            if len(there) == 1:
                changes[path] = there.pop()
    return changed(drive, changes)


def _written(drive: Drive, fitted: Sequence[tuple[AntennaParameter, float]],
             ) -> tuple[dict[str, Any], tuple[dict[str, Any], ...], list[AntennaParameter]]:
    """Return the changed numbers by dotted name, the recorder's errors, and what has no place."""
    record = record_of(drive)
    kind = record.dtype
    run = RunSetup(record.view(np.float64), kind, Bias())
    recorder: dict[tuple[str, str], list[float]] = {}
    missing = []
    for item, value in fitted:
        modifier = item.modifier
        # a configuration has one number for all tests
        of_all = item.label is None and item.experiment is None
        if of_all and isinstance(modifier, RunModifier):
            modifier.apply(run, value)
        elif of_all and isinstance(modifier, ReadingModifier) and modifier.write(run, value):
            continue
        elif item.label is None and isinstance(modifier, RecorderError):
            name = f'{modifier.kind}:{modifier.reading}'.removesuffix(':')
            recorder.setdefault((name, item.unit), []).append(value)
        else:
            missing.append(item)
    run.write_waves()
    pot = place_of(kind, _POT)
    before = drive.torque_share.circuit.bias_pot
    if run.numbers[pot] != before:
        # the pot is set for each test, and its sheet says how
        for path in _LIKE_THE_POT:
            run.change(path, SCALE, float(run.numbers[pot]) / before - 1.0)
        run.numbers[pot] = before
    return dict(_numbers(drive, run.numbers, kind)), tuple(
        {'name': name, 'value': float(np.mean(parts)), 'unit': unit}
        for (name, unit), parts in sorted(recorder.items())), missing


def _numbers(drive: Drive, numbers: FloatArray, kind: np.dtype[Any]) -> Iterator[tuple[str, Any]]:
    """Yield dotted name and value of every number of a record."""
    extra = numbers[place_of(kind, f'{_AXIS}mode_inertias.{EXTRA_MODE}')] > 0.0
    for path, entry, value in values(drive):
        if isinstance(value, tuple):
            count = len(value)
            if extra and path.startswith(_AXIS):
                count = max(count, EXTRA_MODE + 1)
            first = place_of(kind, f'{path}.0')
            yield path, tuple(numbers[first:first + count].tolist())
        elif entry.choices is None and not entry.whole:
            yield path, float(numbers[place_of(kind, path)])


def _allowed(value: Any, entry: Entry) -> Any:
    """Return the value of an entry that is nearest to this one."""
    if isinstance(value, tuple):
        return tuple(min(max(item, entry.low), entry.high) for item in value)
    return min(max(value, entry.low), entry.high) if isinstance(value, float) else value


def _file(lines: dict[str, list[tuple[str, str, Any]]], hypothesis: Hypothesis) -> str:
    names = ' and '.join(hypothesis.effects) or 'no effect'
    text = [f'# The configuration as diagnosed, with {names} and the tolerances as fitted.']
    if any(section == 'torque_share' for section in lines):
        text += ['# Sheets set bias_pot. What differs from their setting is in k_2 and in both '
                 'saturation limits.']
    opened = ''
    for section in sorted(lines, key=lambda section: section.split('.')):
        outer, _, inner = section.partition('.')
        if outer != opened:
            text += ['', f'{outer}:']
            opened = outer
        if inner:
            text.append(f'  {inner}:')
        indent = '    ' if inner else '  '
        entries = lines[section]
        for reason in dict.fromkeys(reason for reason, _, _ in entries):
            text.append(f'{indent}# {reason}')
            text += [f'{indent}{name}: {_plain(value)}' for why, name, value in entries
                     if why == reason]
    return '\n'.join(text) + '\n'


def _plain(value: Any) -> str:
    """Return a value as YAML has it: with a point in each number that is not whole."""
    listed = list(value) if isinstance(value, tuple) else value
    return dump_yaml([listed], default_flow_style=True, width=10 ** 6).strip()[1:-1]
