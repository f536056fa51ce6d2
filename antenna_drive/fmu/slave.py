# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What an FMU of the drive loads: it joins the drive to the library that speaks FMI."""

from collections import Counter
from collections.abc import Callable
from functools import partial
import json
import math
from pathlib import Path
import re
import sys
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from antenna_drive import __version__
from antenna_drive.fmu.stepped import OUTPUT, PARAMETER, SteppedDrive, Variable
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed, Drive, values
from simgap.errors import UserError

# Among the resources of the FMU: everything that the drive needs.
DRIVE_FILE = 'drive.json'
_BASE_UNITS = {
    **{name: {name: 1} for name in ('kg', 'm', 's', 'rad')}, 'Hz': {'s': -1}, '1': {},
    'N': {'kg': 1, 'm': 1, 's': -2}, 'V': {'kg': 1, 'm': 2, 's': -3, 'A': -1},
    'ohm': {'kg': 1, 'm': 2, 's': -3, 'A': -2}, 'H': {'kg': 1, 'm': 2, 's': -2, 'A': -2}}


def drive_file(drive: Drive, step_s: float) -> str:
    """Return the text of a drive's file, with its macro-step [s]."""
    return json.dumps({'step_s': step_s,
                       'drive': {path: value for path, _, value in values(drive)}})


def told(act: Callable[..., Any], *given: Any) -> Any:
    """Act; what is wrong is told on standard error, too: few importers show an FMU's reason."""
    try:
        return act(*given)
    except UserError as error:
        print(f'antenna_drive: {error}', file=sys.stderr)
        raise


def joined(slave: Any, library: Any, fmi: int) -> SteppedDrive:
    """Return the drive of an FMU, whose variables its slave then has; `library` speaks FMI."""
    known = json.loads(Path(slave.resources, DRIVE_FILE).read_text(encoding='utf-8'))
    drive = SteppedDrive(changed(load(), {
        path: tuple(value) if isinstance(value, list) else value
        for path, value in known['drive'].items()}), known['step_s'])
    slave.version = __version__
    slave.description = 'The elevation drive of a 34-m antenna, two motors with torque bias'
    slave.default_experiment = library.DefaultExperiment(start_time=0.0, step_size=known['step_s'])
    causality, variability = (getattr(library, f'Fmi{fmi}{name}')
                              for name in ('Causality', 'Variability'))
    number = library.Real if fmi == 2 else library.Float64
    if fmi == 3:
        slave.time = 0.0
        slave.register_variable(number('time', causality=causality.independent,
                                       variability=variability.continuous))
    for name, item in drive.variables.items():
        entry, kind = item.entry, number
        said, changing = entry.description, 'tunable' if entry.live else 'fixed'
        if entry.choices:
            kind, said = library.String, f'{said}: {entry.allowed()}'
        if item.causality != PARAMETER:
            changing = 'continuous'
        slave.register_variable(kind(
            name, description=said, causality=causality[item.causality],
            variability=variability[changing], getter=partial(told, drive.get, name),
            setter=partial(told, drive.set, name)))
    return drive


def with_units(root: Element, variables: dict[str, Variable]) -> Element:
    """Return a model description with what the library leaves out: units, limits, all digits."""
    units = Element('UnitDefinitions')
    root.insert(1, units)  # behind what says that it is for co-simulation
    for name in sorted({item.entry.unit for item in variables.values()} - {''}):
        unit, base = SubElement(units, 'Unit', name=name), base_unit(name)
        if base is not None:
            SubElement(unit, 'BaseUnit', {key: str(n) for key, n in base.items() if n})
    for structure in root.iterfind('ModelStructure'):
        for outputs in structure.findall('Outputs'):  # of FMI 2, and calculated at the start
            SubElement(structure, 'InitialUnknowns').extend(outputs)
    for node in root.iterfind('ModelVariables/*'):
        item = variables.get(node.get('name', ''))
        if item is None or item.entry.choices:
            continue
        number = next(iter(node), node)  # in FMI 2 the type is a node of its own
        number.set('unit', item.entry.unit)
        if item.causality != OUTPUT:
            number.set('start', repr(item.start))
        for key, limit in (('min', item.entry.low), ('max', item.entry.high)):
            if math.isfinite(limit):
                number.set(key, repr(limit))
    return root


def base_unit(unit: str) -> Counter[str] | None:
    """Return the exponents of the base units in a unit, None if it is none of the SI's."""
    found: Counter[str] = Counter()
    sign = 1
    for name, power in re.findall(r'([^ /^]+|/)\^?(\d*)', unit):
        if name == '/':
            sign = -1
        elif name in _BASE_UNITS:
            for base, exponent in _BASE_UNITS[name].items():
                found[base] += sign * exponent * int(power or 1)
        else:
            return None  # an article ampere is not an ampere
    return found
