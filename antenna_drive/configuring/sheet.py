# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What is asked of a drive: the figures that data sheets and test reports have, in their own units.

Currents here are real amperes, as a clamp meter shows them.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
import math
from pathlib import Path
import re
from typing import Any, NamedTuple

from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import mapping_of, ParameterError, quoted

AT_MOTOR = ' at the motor'
CIRCUITS = ('old', 'new')
_TEXT = re.compile(r'(?P<number>[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)(?![\d,.])\s*(?P<unit>.*)')

_AMPERE = {'real A': 1.0, 'A': 1.0}
_HENRY = {'mH': 1e-3, 'H': 1.0}
_INERTIA = {'kg m^2': 1.0, 'kg cm^2': 1e-4, 'lb in s^2': 0.112985}
_RATE = {'deg/s': math.pi / 180, 'arcsec/s': math.pi / 648000, 'mrad/s': 1e-3, 'rad/s': 1.0}
_ANGLE = {'arcsec': math.pi / 648000, 'arcmin': math.pi / 10800, 'deg': math.pi / 180,
          'mrad': 1e-3, 'rad': 1.0}
_TORQUE = {'N m/A': 1.0, 'lb in/A': 0.112985, 'oz in/A': 0.00706155}
_PER_RATE = {'V/krpm': 0.03 / math.pi, 'V s/rad': 1.0}
_TIME = {'ms': 1e-3, 's': 1.0}


class Given(NamedTuple):
    """A figure in SI units, as it was written, and whether it is said of the motor shaft."""

    value: float
    written: str
    at_motor: bool = False


@dataclass(frozen=True)
class Figure:
    """One figure that is asked for."""

    key: str  # section and name in the file
    # those that may be written and how much of the SI unit each is; the first one is meant where
    # none is written
    units: Mapping[str, float]
    # what is allowed [SI]
    low: float
    high: float
    what: str  # what it is, for people
    optional: str = ''  # what is done where it is not given; '' if it has to be
    either_shaft: bool = False  # whether it may be said of the motor shaft in place of the axis

    @property
    def unit(self) -> str:
        """Return the unit that is meant where none is written."""
        return next(iter(self.units))

    def read(self, said: object) -> Given:
        """
        Return a figure that is a number, or a text of a number and a unit.

        Raises ParameterError: it is neither, the unit is another, or it is not allowed.
        """
        text = str(said).strip() if isinstance(said, (int, float, str)) else ''
        match = None if isinstance(said, bool) else _TEXT.fullmatch(text)
        if match is None:
            raise ParameterError(f'{self.key}: {quoted(said)} given, allowed is a number with a '
                                 f'decimal point and a unit, such as 1.5 {self.unit}')
        number, unit = float(match['number']), match['unit'].strip()
        at_motor = self.either_shaft and unit.endswith(AT_MOTOR)
        unit = unit.removesuffix(AT_MOTOR) if at_motor else unit
        if unit and unit not in self.units:
            raise ParameterError(f'{self.key}: {quoted(said)} given, allowed units are '
                                 f'{", ".join(self.units)}')
        unit = unit or self.unit
        value = number * self.units[unit]
        # at the motor shaft a figure is that of the axis times or over a gear ratio or two
        low, high = (min(self.low, 1e-9), 1e9) if at_motor else (self.low, self.high)
        if not low <= value <= high:
            scale = self.units[unit]
            raise ParameterError(f'{self.key}: {quoted(said)} given, allowed is from '
                                 f'{low / scale:g} to {high / scale:g} {unit}')
        shown = '' if unit == '1' else f' {unit}'
        return Given(value, f'{number:g}{shown}{AT_MOTOR if at_motor else ""}', at_motor)


FIGURES = (
    Figure('motor.torque_constant', _TORQUE, 1e-3, 1e3, 'torque per real ampere'),
    Figure('motor.back_emf', _PER_RATE, 1e-4, 1e3, 'back-EMF constant',
           'a number as large as the torque constant'),
    Figure('motor.resistance', {'ohm': 1.0}, 1e-3, 1e3, 'armature resistance, hot'),
    Figure('motor.inductance', _HENRY, 1e-5, 10.0, 'armature inductance'),
    Figure('motor.rotor_inertia', _INERTIA, 1e-6, 1e3,
           'rotor with brake and pinion, one motor'),
    Figure('amplifier.greatest_current', _AMPERE, 0.51, 504.0, 'current limit of one amplifier'),
    Figure('amplifier.greatest_voltage', {'V': 1.0}, 1.0, 1e4, 'greatest armature voltage'),
    Figure('amplifier.current_loop', {'Hz': 1.0}, 1.0, 1e5, 'bandwidth of the current loop'),
    Figure('amplifier.rate_loop', {'Hz': 1.0}, 0.05, 100.0, 'bandwidth of the rate loop'),
    Figure('amplifier.integral_time', _TIME, 1e-3, 100.0, 'integral time of the rate loop',
           'four over the bandwidth of the rate loop'),
    Figure('amplifier.lag', _TIME, 1e-4, 10.0, 'lag between the rate and the current loop',
           'a tenth over the bandwidth of the rate loop'),
    Figure('amplifier.tachometer', _PER_RATE, 1e-6, 10.0, 'tachometer voltage'),
    Figure('gear.ratio', {'1': 1.0}, 1.0, 1e6, 'motor turns per turn of the axis'),
    Figure('gear.stiffness', {'N m/rad': 1.0}, 1.0, 1e14,
           'torsional stiffness of one gearbox, at the axis', either_shaft=True),
    Figure('gear.backlash', _ANGLE, 0.0, 0.1,
           'whole backlash of one gearbox, at the axis', either_shaft=True),
    Figure('axis.inertia', _INERTIA, 1.0, 1e12, 'all that turns about the axis, without rotors'),
    Figure('axis.first_resonance', {'Hz': 1.0}, 0.05, 100.0,
           'lowest resonance with the rotors held'),
    Figure('friction.slow_rate', _RATE, 1e-9, 1.0, 'a slow steady rate of the axis'),
    Figure('friction.slow_current', _AMPERE, 1e-3, 1e4,
           'current at that rate, both motors together'),
    Figure('friction.fast_rate', _RATE, 1e-9, 1.0, 'a fast steady rate of the axis'),
    Figure('friction.fast_current', _AMPERE, 1e-3, 1e4,
           'current at that rate, both motors together'),
    Figure('friction.stiction_ratio', {'1': 1.0}, 1.0, 5.0, 'stiction over Coulomb friction',
           'that of the reference drive'),
    Figure('bias.share', {'percent': 0.01, '1': 1.0}, 1e-3, 0.9,
           'bias at standstill: difference of the two currents over the current limit'),
)
CIRCUIT = 'bias.circuit'


@dataclass(frozen=True)
class Sheet:
    """What is known of a drive."""

    figures: Mapping[str, Given]  # by key; those that are optional may be missing
    circuit: str  # the torque-share circuit of the article's Table 1, 'old' or 'new'
    source: str  # where it was read, for messages

    def __getitem__(self, key: str) -> float:
        """Return a figure in SI units."""
        return self.figures[key].value

    def get(self, key: str) -> float | None:
        """Return an optional figure in SI units, None if it was not given."""
        given = self.figures.get(key)
        return None if given is None else given.value


def read_sheet(path: Path) -> Sheet:
    """Read a filled sheet; ParameterError names file, key and remedy."""
    sections: dict[str, list[str]] = {}
    for key in (*(figure.key for figure in FIGURES), CIRCUIT):
        section, _, name = key.partition('.')
        sections.setdefault(section, []).append(name)
    content = read_yaml(path)
    content = {} if content is None else content
    try:
        flat = {f'{section}.{name}': said
                for section, body in mapping_of('', content, sections).items()
                for name, said in mapping_of(section, body, sections[section]).items()}
        figures = dict(_read(flat))
        circuit = flat.get(CIRCUIT, CIRCUITS[-1])
        if circuit not in CIRCUITS:
            raise ParameterError(f'{CIRCUIT}: {quoted(circuit)} given, allowed are old, new')
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None
    return Sheet(figures, str(circuit), str(path))


def _read(flat: Mapping[str, Any]) -> Iterator[tuple[str, Given]]:
    for figure in FIGURES:
        said = flat.get(figure.key)
        if said is not None:
            yield figure.key, figure.read(said)
        elif not figure.optional:
            raise ParameterError(f'{figure.key}: is missing: {figure.what} [{figure.unit}]')


def ask(answer: Callable[[str], str], say: Callable[[str], None]) -> Sheet:
    """
    Ask for each figure until it is allowed.

    answer : shows a question and returns what was typed; raises EOFError if nobody answers
    say : shows a line

    Raises ParameterError: nobody answers any more.
    """
    figures: dict[str, Given] = {}
    question = ''
    try:
        for figure in FIGURES:
            end = f'; Enter for {figure.optional}' if figure.optional else ''
            units = ' or '.join(figure.units) + (f', or{AT_MOTOR}' if figure.either_shaft else '')
            question = f'{figure.key}: {figure.what} [{units}{end}]: '
            while figure.key not in figures:
                said = answer(question).strip()
                if not said and figure.optional:
                    break
                try:
                    figures[figure.key] = figure.read(said)
                except ParameterError as error:
                    say(str(error))
        question = f'{CIRCUIT}: torque-share circuit of the article, old or new [Enter for new]: '
        while (circuit := answer(question).strip() or CIRCUITS[-1]) not in CIRCUITS:
            say(f'{CIRCUIT}: {quoted(circuit)} given, allowed are old, new')
    except EOFError:
        raise ParameterError(f'{question.partition(":")[0]}: no answer; a filled sheet can be '
                             'given in place of answers, see --template') from None
    return Sheet(figures, circuit, 'answers')


def written(figures: Mapping[str, Given], circuit: str = CIRCUITS[-1]) -> str:
    """Return a sheet as YAML: filled with these figures, or with gaps to fill."""
    lines = ['# What data sheets and test reports give of a drive, for antenna-drive configure.',
             '# Currents are real amperes. A value may have another of the units named behind it.']
    before = ''
    for figure in FIGURES:
        section, _, name = figure.key.partition('.')
        if section != before:
            lines.append(f'{section}:')
        before = section
        given = figures.get(figure.key)
        value = '' if given is None else f' {given.written}'
        units = ', '.join(figure.units) + (f', or{AT_MOTOR}' if figure.either_shaft else '')
        lines.append(f'  {name}:{value}'.ljust(34) + f'  # {figure.what} [{units}]'
                     + (f'; without it {figure.optional}' if figure.optional else ''))
    lines.append(f'  circuit: {circuit}'.ljust(34) + "  # the article's, old or new")
    return '\n'.join(lines) + '\n'
