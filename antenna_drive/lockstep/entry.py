# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
From a command line to a running node, and back to an exit code.

This module imports neither ROS 2 nor numpy until it has to, so that Ctrl-C is answered from
the first moment, and a machine without ROS 2 gets one line that says so.
"""

from __future__ import annotations

from _thread import start_new_thread
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import faulthandler
import os
import signal
import sys
from threading import Event
from types import FrameType, MappingProxyType
from typing import Any, TYPE_CHECKING

from antenna_drive.programs import run_program
from simgap.command.programs import OK
from simgap.errors import UserError

if TYPE_CHECKING:
    from antenna_drive.emulator.unit import Unit
    from antenna_drive.emulator.wiring import Wiring
    from antenna_drive.lockstep.node_parameters import ReadSheet
    from rclpy.node import Node
    from simgap.inputs.schema import Value

# A node's parameter: a test sheet that its unit plays.
SHEET = 'sheet'
# A node that has been asked to end has ended after this [s], whatever holds it.
_END_S = 5.0
# Returns the greatest magnitude of a setting for the parameters of all units.
LimitOf = Callable[[Any], float]
# Makes the unit of a node: its name, the wiring, configuration files, what else was given by name.
MakeUnit = Callable[[str, 'Wiring', Sequence[str], Mapping[str, Any]], 'Unit']


def run_drive_unit(default_name: str, names: Sequence[str], args: Sequence[str] | None = None,
                   fed_by_topic: Mapping[str, LimitOf] = MappingProxyType({}),
                   description: str = '', wiring: str = '',
                   read_sheet: ReadSheet | None = None) -> int:
    """
    Run a unit of the wiring as a ROS 2 node; SIGINT or SIGTERM ends the process.

    default_name : the node's name unless it is remapped with -r __node:=...
    names : names of the units that this executable can be
    args : command line without the program's name; None for the process's own
    fed_by_topic : settings that follow a Float64 topic `<node>/<setting>`, and what returns the
        greatest magnitude of each for the parameters of all units
    description : what --help says first
    wiring : module:NAME of the wiring unless the parameter `wiring` names another; '' is the
        drive's
    read_sheet : returns the settings for a test sheet, where the unit has a parameter `sheet`; see
        DriveNode

    Returns the exit code of a node that did not start: 2 wrong input, 3 no ROS 2; 0 after --help.
    """
    def make(name: str, wired: Wiring, config: Sequence[str], given: Mapping[str, Any]) -> Unit:
        from antenna_drive.emulator import units
        import numpy as np
        if read_sheet is not None and SHEET in given:
            given = dict(given)
            given = {**read_sheet(str(given.pop(SHEET))), **given}
        if name not in names:
            raise UserError(f'{name}: no such unit, allowed for this node are {", ".join(names)}; '
                            f'choose with --ros-args -r __node:={names[-1]}')
        unit = units.build(name, wired.load(*config), given, wired)
        # compile now, not in the first step
        unit.start(1e-3)
        unit.step(0, np.zeros((len(unit.inputs), 2)))
        return unit

    return _run(default_name, make, args, description, wiring, fed_by_topic, read_sheet)


def run_unit(unit: Unit, args: Sequence[str] | None = None) -> int:
    """
    Run a unit of your own in the place of one of the wiring; SIGINT or SIGTERM ends the process.

    unit : its name is the name of the unit that it stands in for
    args : command line without the program's name; None for the process's own

    Returns the exit code of a node that did not start: 2 wrong input, 3 no ROS 2; 0 after --help.
    """
    def make(name: str, wired: Wiring, config: Sequence[str], given: Mapping[str, Any]) -> Unit:
        from simgap.inputs.schema import nearest, ParameterError
        if name not in wired.units:
            raise UserError(f'{name}: no such unit, allowed are {", ".join(wired.units)}')
        unit.name = name
        settings = unit.settings()
        changes: dict[str, Value] = {}
        for key, value in given.items():
            if key not in settings:
                raise ParameterError(f'{key}: no such parameter{nearest(key, tuple(settings))}')
            changes[key] = settings[key][0].check(key, value)
        unit.tune(changes)
        return unit

    return _run(unit.name, make, args, type(unit).__doc__ or '')


def run_partner(args: Sequence[str] | None = None, description: str = '') -> int:
    """
    Run the stand-in of a partner that does not wait; SIGINT or SIGTERM ends the process.

    args, description : as for `run_drive_unit`

    Returns the exit code of a node that did not start: 2 wrong input, 3 no ROS 2; 0 after --help.
    """
    def make(name: str, wired: Wiring, config: Sequence[str], given: Mapping[str, Any]) -> Unit:
        from antenna_drive.lockstep.partner import PartnerUnit
        if name not in wired.units:
            raise UserError(f'{name}: no such unit, allowed are {", ".join(wired.units)}; '
                            'choose with --ros-args -r __node:=test_signal')
        reads = given.get('partner.reads', wired.units[name].sources)
        reads = [reads] if isinstance(reads, str) else [str(item) for item in reads]
        for source in reads:
            if source not in wired.signals:
                raise UserError(f'partner.reads: {source}: no such signal, known are '
                                f'{", ".join(wired.signals)}')
        return PartnerUnit(name, wired.outputs[name], reads)

    return _run('partner', make, args, description)


def _run(default_name: str, make: MakeUnit, args: Sequence[str] | None, description: str,
         wiring: str = '', fed_by_topic: Mapping[str, LimitOf] = MappingProxyType({}),
         read_sheet: ReadSheet | None = None) -> int:
    ending = _Ending()

    def spin(node: Node) -> None:
        from antenna_drive.emulator.wiring import find
        from antenna_drive.lockstep.node import DriveNode
        from antenna_drive.lockstep.node_parameters import OWN_PARAMETERS
        from antenna_drive.lockstep.ros_parameters import Overrides
        from antenna_drive.lockstep.starting import told_while_compiling

        overrides = Overrides(node)
        config = [name for name in overrides.names('config', ()) if name != 'reference']
        given = {name: value for name, value in overrides.rest().items()
                 if name not in OWN_PARAMETERS}
        named = overrides.text('wiring', wiring)
        wired = find(named)
        # the settings that a sheet stands for are parameters; its own name is none
        overrides.text(SHEET)
        with told_while_compiling(node):
            unit = make(node.get_name(), wired, config, given)
            limits = {setting: limit_of(wired.load(*config))
                      for setting, limit_of in fed_by_topic.items()}
            drive_node = DriveNode(node, unit, overrides, config, limits, named, wired.outputs,
                                   read_sheet)
        ending.by(drive_node.stop)
        if not ending.asked:
            drive_node.spin()

    def act(arguments: list[str]) -> int:
        with ros_node(default_name, arguments, "config:=\"['old_circuit']\"") as node:
            spin(node)
        # The node has left the graph. What the interpreter and the compiler would still tidy up
        # takes seconds on a busy machine, and a node must be gone within two.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(OK)

    return run_program(default_name, _help(default_name, description), act, args)


class _Ending:
    """Turns SIGINT and SIGTERM into an orderly end: at once while starting, else by `stop`."""

    def __init__(self) -> None:
        self._stop: Callable[[], None] | None = None
        self.asked = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._answer)

    def _answer(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            return
        self.asked = True
        if self._stop is None:
            # An exception could come up inside a library's callback and be swallowed there.
            os._exit(OK)
        # A unit whose step does not return, or a middleware that hangs, would hold the process.
        # The exit code is 1 then, and the log says where each thread was.
        faulthandler.dump_traceback_later(_END_S, exit=True)
        self._stop()

    def by(self, stop: Callable[[], None]) -> None:
        """From now on end by calling `stop`."""
        self._stop = stop


@contextmanager
def ros_node(name: str, arguments: Sequence[str], example: str) -> Iterator[Node]:
    """
    Give this process its node, and take it out of the graph in the end.

    name : of the node unless it is remapped
    arguments : command line without the program's name
    example : a right ROS 2 parameter, for the error

    Raises UserError: the command line has an argument that is none of ROS 2's, or a wrong one.
    """
    from antenna_drive.lockstep.leaving import leave
    from rclpy.exceptions import InvalidParameterTypeException
    from rclpy.utilities import remove_ros_args
    try:
        left = remove_ros_args([name, *arguments])[1:]
        if left:
            raise UserError(f'{left[0]}: no such option; ROS 2 arguments follow --ros-args, '
                            f'as in --ros-args -p {example}')
        node = own_node(name, arguments=arguments)
    except (RuntimeError, InvalidParameterTypeException) as error:
        raise UserError(_first_line(error)) from error
    try:
        yield node
    finally:
        leave(node)


def own_node(name: str, namespace: str = '', arguments: Sequence[str] = ()) -> 'Node':
    """
    Return a node in a context of its own; `leave` takes both out of the graph.

    Signals are left to the process.
    """
    from rclpy.context import Context
    from rclpy.node import Node
    choose_transport(os.environ)
    context = Context()
    context.init(args=[name, *arguments])
    try:
        # what nobody has declared reaches `Overrides`, which says what was meant
        return Node(name, namespace=namespace, context=context, allow_undeclared_parameters=True)
    except BaseException:
        context.try_shutdown()
        raise


def stopped_by_signals() -> Event:
    """Return an event that SIGINT and SIGTERM set from now on."""
    stop = Event()
    # A handler runs within whatever the main thread is doing, so also while that holds the lock of
    # the event, in `wait`. Another thread gets the lock as soon as it is free.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: start_new_thread(stop.set, ()))
    return stop


def choose_transport(environment: dict[str, str] | os._Environ[str]) -> None:
    """
    Keep to this machine, with few acknowledgements, unless the user has said otherwise.

    Discovery: whoever wants other machines sets ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET, or any
    other of ROS 2's own variables, and nothing is touched. Acknowledgements and announcements:
    config/fastdds.xml says why; a profiles file of the user's own takes its place.
    """
    if not any(name in environment for name in (
            'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS')):
        environment['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    if not any(name in environment for name in (
            'FASTDDS_DEFAULT_PROFILES_FILE', 'FASTRTPS_DEFAULT_PROFILES_FILE')):
        from antenna_drive.parameters.files import config_dir
        environment['FASTDDS_DEFAULT_PROFILES_FILE'] = str(config_dir() / 'fastdds.xml')


def _help(program: str, description: str) -> str:
    return '\n'.join((
        f'usage: {program} [--ros-args ROS_ARGUMENTS]', '', description.strip(), '',
        'Useful ROS 2 arguments:',
        "  -p config:=\"['old_circuit']\"   configuration files or sets, later over earlier",
        '  -p wiring:=MODULE:NAME        units and what feeds them, if not those of the drive',
        '  --params-file FILE            parameters from a YAML file',
        '  -r __ns:=/east                put the node into a namespace',
        '  -r __node:=NAME               give it another name',
        'While it runs: ros2 param list, describe, get and set.'))


def _first_line(error: Exception) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]
