# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of a node itself, beside the settings of its unit."""

from collections.abc import Callable, Collection, Mapping

from antenna_drive.emulator.unit import Unit
from antenna_drive.emulator.wiring import TEST_SIGNAL
from antenna_drive.lockstep.pace import LEAD_S
from antenna_drive.lockstep.partner import HOLD, ON_MISS, PartnerUnit
from antenna_drive.lockstep.ros_parameters import (
    declare as declare_settings, declare_names, Overrides, Settings,
)
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from simgap.inputs.schema import Entry, Value

# Returns the settings that play the test sheet in a file.
ReadSheet = Callable[[str], Mapping[str, Value]]

# The test sheet that the service play plays.
SHEET = 'run.sheet'

# By name, what is allowed and the default: of every node, of a partner's, of the conductor.
_EVERY: Settings = {
    'publish_rate': (Entry('Hz', 0.0, 1e4, 'readings per simulated second on each signal topic, '
                           '0: none', live=True), 100.0),
    'exchange': (Entry('', description='auto: the compiled exchange where it can be used; '
                       'python: the exchange in Python', choices=('auto', 'python')), 'auto'),
    'realtime.priority': (Entry('1', 0, 99, 'real-time priority (SCHED_FIFO) of the lock-step, '
                                '0: none', whole=True), 0),
    'realtime.memory': (Entry('', description='locked: all memory of the node stays in RAM '
                              '(mlockall)', choices=('pageable', 'locked')), 'pageable'),
}
_PARTNER: Settings = {
    'partner.rate': (Entry('Hz', 1.0, 1e4, 'how often per simulated second the partner is told '
                           'its inputs'), 100.0),
    'partner.deadline': (Entry('s', 0.0, 1e3, 'how old the step may be that was answered last, in '
                               'simulated time; 0: any age'), 0.0),
    'partner.on_miss': (Entry('', description='what the outputs do while an answer is overdue',
                              choices=ON_MISS), HOLD),
}
_CONDUCTOR: Settings = {
    'run.step': (Entry('s', 1e-5, 0.1, 'macro-step'), 1e-3),
    'run.pace': (Entry('1', 0.0, 1e3, 'how many times faster than real time, 0: as fast as '
                       'possible', live=True), 1.0),
    'run.lead': (Entry('s', 0.0, 1.0, 'how long before it is due a step may be made'), LEAD_S),
    'run.duration': (Entry('s', 0.0, 1e9, 'simulated time after which the run ends, 0: never'),
                     0.0),
    'run.external_limit': (Entry('rad/s', 0.0, 1e9, 'greatest rate command that is taken from the '
                                 'topic external, 0: what the configuration can reach'), 0.0),
    'run.steps': (Entry('1', 1, 1_000_000, 'how many macro-steps the service step makes',
                        live=True, whole=True), 1),
}
OWN_PARAMETERS = ('config', 'wiring', 'run.observers', SHEET, *_EVERY, *_PARTNER, *_CONDUCTOR)


def declare(node: Node, unit: Unit, overrides: Overrides, settings: Settings,
            config: Collection[str], wiring: str, plays: bool) -> None:
    """
    Declare the parameters of a unit's node; `overrides.own` then holds those of the node itself.

    node, unit, overrides : the node, its unit, and what the user gave at the start
    settings : those of the unit that are parameters
    config, wiring : the configuration files that the unit was made from, and the name of the
        wiring
    plays : whether the conductor plays test sheets

    Raises ParameterError: an override is not allowed, or no parameter has that name.
    """
    partner = _PARTNER if isinstance(unit, PartnerUnit) else {}
    conductor = _CONDUCTOR if unit.name == TEST_SIGNAL else {}
    for name, (entry, default) in {**_EVERY, **partner, **conductor}.items():
        overrides.get(name, entry, default)
    if isinstance(unit, PartnerUnit):
        declare_names(node, 'partner.reads', overrides.names('partner.reads', unit.inputs),
                      'signals that the partner is told')
    if conductor:
        declare_names(node, 'run.observers', overrides.names('run.observers', ()),
                      'names of recorders that every step waits for')
        sheet = overrides.text(SHEET)
        if plays:
            node.declare_parameter(SHEET, sheet, ParameterDescriptor(
                description='file with the test sheet that the service play plays'),
                ignore_override=True)
    overrides.check_all_known([*settings, *overrides.own])
    declare_names(node, 'config', [*config] or ['reference'],
                  'configuration files or sets of config/, later over earlier')
    declare_names(node, 'wiring', [wiring], "module:NAME of the wiring, '' for the drive's own")
    declare_settings(node, {**settings, **overrides.own})
