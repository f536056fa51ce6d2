# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The drive's units and which signal feeds which input: Figs. 4 and 5, once, as data.

Signal names are 'unit/signal'. Currents are in article amperes, see docs/model.md. A package of
your own adds units with `Wiring.plus`, and names the result to the nodes as 'module:NAME'.
"""

from collections.abc import Mapping
from dataclasses import fields, make_dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.physics import motor_drive, signal_generator, structure, torque_share
from antenna_drive.physics.block import Interface, Signal
from simgap.errors import UserError


class Wired(NamedTuple):
    """
    A unit in its place.

    interface : what the unit is, a `Block` as a rule
    node : the Python module that runs it as a node
    feeds : the signal that feeds each input, 'unit/signal' by the input's name
    """

    interface: Interface
    node: str
    feeds: Mapping[str, str] = {}

    def fed(self, **feeds: str) -> 'Wired':
        """Return the unit with these inputs fed by other signals."""
        return self._replace(feeds={**self.feeds, **feeds})

    @property
    def sources(self) -> tuple[str, ...]:
        """Return the signals that it reads, in the order of its inputs."""
        return tuple(self.feeds[name] for name in self.interface.inputs._fields)


class Wiring:
    """
    Units, in the order of their signals in a sample, and what feeds them.

    units : by name; the name is that of the unit's node too
    signals : as 'unit/signal', in that order
    configuration : files with the parameters of units that the reference set does not know

    Raises UserError: an input is fed by nothing, or by what no unit puts out.
    """

    def __init__(self, units: Mapping[str, Wired], configuration: tuple[Path, ...] = ()) -> None:
        """Check that every input is fed."""
        self.units = dict(units)
        self.configuration = configuration
        self.outputs = {name: unit.interface.outputs for name, unit in units.items()}
        self.signals = tuple(f'{name}/{signal.name}' for name, signals in self.outputs.items()
                             for signal in signals)
        for name, unit in units.items():
            wanted = set(unit.interface.inputs._fields)
            for given in sorted(wanted ^ set(unit.feeds)):
                raise UserError(f'{name}: the input {given} '
                                f'{"is fed by nothing" if given in wanted else "does not exist"}')
            for source in unit.sources:
                if source not in self.signals:
                    raise UserError(f'{name}: no unit puts out its input {source}')

    def plus(self, *configuration: Path, **units: Wired) -> 'Wiring':
        """Return the wiring with units added, or wired differently, and files for them."""
        return Wiring({**self.units, **units}, (*self.configuration, *configuration))

    @cached_property
    def parameters(self) -> Any:
        """Return the type of the parameters of all units: `Drive`, with a set for each more."""
        known = {item.name for item in fields(Drive)}
        more = [(name, unit.interface.kind) for name, unit in self.units.items()
                if name not in known]
        if not more:
            return Drive
        return make_dataclass('Drive', more, bases=(Drive,), frozen=True, kw_only=True)

    def load(self, *sources: str | Path) -> Any:
        """Load the parameters of all units; sources and errors as in `parameters.load`."""
        return load(*self.configuration, *sources, kind=self.parameters)


TEST_SIGNAL = 'test_signal'
MOTORS = ('motor_1', 'motor_2')
TORQUE_SHARE = 'torque_share'
PLANT = 'plant'

_MOTOR = Wired(motor_drive.BLOCK, 'antenna_drive.nodes.motor_drive').fed(
    rate_command='test_signal/rate_command', counter_torque='torque_share/counter_torque',
    axis_angle='plant/axis_angle', axis_rate='plant/axis_rate')
DRIVE = Wiring({
    TEST_SIGNAL: Wired(signal_generator.SOURCE, 'antenna_drive.nodes.signal_generator'),
    **dict.fromkeys(MOTORS, _MOTOR),
    TORQUE_SHARE: Wired(torque_share.BLOCK, 'antenna_drive.nodes.torque_share').fed(
        current_1='motor_1/current', current_2='motor_2/current'),
    PLANT: Wired(structure.BLOCK, 'antenna_drive.nodes.rate_loop_plant').fed(
        gear_torque_1='motor_1/gear_torque', gear_torque_2='motor_2/gear_torque',
        missed_impulse_1='motor_1/missed_impulse', missed_impulse_2='motor_2/missed_impulse',
        external_torque='test_signal/external_torque'),
})

UNITS = tuple(DRIVE.units)
OUTPUTS: dict[str, tuple[Signal, ...]] = DRIVE.outputs


def find(name: str) -> Wiring:
    """
    Return the wiring that is called 'module:NAME'; '' is the drive's own.

    Raises UserError: there is none of that name.
    """
    if not name:
        return DRIVE
    module, _, constant = name.partition(':')
    try:
        found = getattr(import_module(module), constant)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(f'wiring: {name}: {error}; give module:NAME of a Wiring that Python '
                        'can import') from error
    if not isinstance(found, Wiring):
        raise UserError(f'wiring: {name}: {type(found).__name__} found, allowed is a Wiring')
    return found
