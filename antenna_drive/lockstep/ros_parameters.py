# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A unit's settings as ROS 2 parameters: described, checked, and changed at a step.

The parameter services run in a thread of their own. They check a set of changes as a whole,
hand it to the lock-step thread and answer when it is in force, so that what `ros2 param get`
says is what the unit uses.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, TimeoutError  # noqa: A004 (another one in Python 3.10)
import math
from typing import Any

from antenna_drive.emulator.unit import Unit
from rcl_interfaces.msg import (
    FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter
from simgap.inputs.schema import Entry, nearest, ParameterError, Value

# What rclpy declares by itself.
_RCLPY_OWN = ('use_sim_time', 'start_type_description_service', 'qos_overrides.')

# Topics whose QoS is a part of the lock-step's protocol.
_FIXED_QOS = ('/frame', '/changes')

# How long a service call waits for the lock-step thread; a step takes a thousandth of this.
PATIENCE_S = 5.0

Settings = Mapping[str, tuple[Entry, Value]]


class Tuning:
    """The live changes of one unit, from any thread to the lock-step thread."""

    def __init__(self, unit: Unit) -> None:
        """Take changes for `unit`."""
        self._unit = unit
        # changes, and why they were refused, '' if they are in force
        self._queue: deque[tuple[dict[str, Value], Future[str]]] = deque()
        self.wake: Callable[[], None] = lambda: None

    @property
    def pending(self) -> bool:
        """Return whether changes wait to be applied."""
        return any(not refusal.cancelled() for _, refusal in tuple(self._queue))

    def request(self, changes: dict[str, Value], wait: bool = True) -> str:
        """
        Ask for changes from a thread other than the lock-step thread.

        Returns why all of them are refused, or '' if they are in force (with wait) or will be;
        what is refused is never put in force.
        """
        try:
            self._unit.check(changes)
        except ParameterError as error:
            return str(error)
        refusal: Future[str] = Future()
        self._queue.append((changes, refusal))
        self.wake()
        try:
            return refusal.result(PATIENCE_S) if wait else ''
        except TimeoutError:
            if refusal.cancel():
                return f'the node has not come to its next step for {PATIENCE_S:g} s'
            return refusal.result()  # it is being put in force

    def apply(self) -> dict[str, Value]:
        """Apply what was asked for; called by the lock-step thread between two steps."""
        applied: dict[str, Value] = {}
        while self._queue:
            changes, refusal = self._queue.popleft()
            if not refusal.set_running_or_notify_cancel():
                continue  # who asked has given up
            try:
                self._unit.tune(changes)
                applied.update(changes)
                refusal.set_result('')
            except ParameterError as error:
                refusal.set_result(str(error))
        return applied


class Overrides:
    """
    What the user said of parameters at the start, with -p or --params-file.

    Each is asked for by name; what nobody asked for is misspelt or belongs elsewhere. `own` has
    the entries and values of those asked for by `get` and `number`.
    """

    def __init__(self, node: Node) -> None:
        """
        Read the overrides of a node.

        rclpy cannot declare an empty list, which has no type, so nothing is declared to be read.

        Raises ParameterError: the QoS of a topic of the lock-step is to be changed.
        """
        self._values: dict[str, Any] = {}
        for name, parameter in node._parameter_overrides.items():
            if name.startswith('qos_overrides.') and '.'.join(name.split('.')[1:-2]).endswith(
                    _FIXED_QOS):
                raise ParameterError(f'{name}: the lock-step needs the QoS of this topic as it '
                                     'is; those of signals, clock and external can be changed')
            if not name.startswith(_RCLPY_OWN):
                self._values[name] = [] if parameter.value is None else _plain(parameter.value)
        self._asked: set[str] = set()
        self.own: dict[str, tuple[Entry, Value]] = {}

    def get(self, name: str, entry: Entry, default: Value) -> Value:
        """Return a parameter's value or default; ParameterError if it is not allowed."""
        self._asked.add(name)
        value = entry.check(name, self._values[name]) if name in self._values else default
        self.own[name] = (entry, value)
        return value

    def number(self, name: str, entry: Entry, default: float) -> float:
        """Return the number given for a parameter, or its default; raise as `get` does."""
        value = self.get(name, entry, default)
        assert isinstance(value, (int, float))
        return value

    def names(self, name: str, default: Sequence[str]) -> list[str]:
        """Return a list of texts. Raises ParameterError: something else was given."""
        self._asked.add(name)
        given = self._values.get(name, list(default))
        texts = [given] if isinstance(given, str) else given
        if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
            raise ParameterError(f'{name}: {given!r} given, allowed is a list of texts')
        return [text for text in texts if text]

    def text(self, name: str, default: str = '') -> str:
        """Return the text given for a parameter, or its default; raise as `names` does."""
        given = self.names(name, [default])
        if len(given) > 1 or self._values.get(name) == []:
            raise ParameterError(f'{name}: {given!r} given, allowed is one text')
        return ''.join(given)

    def rest(self) -> dict[str, Any]:
        """Return what has not been asked for."""
        return {key: value for key, value in self._values.items() if key not in self._asked}

    def check_all_known(self, known: Sequence[str]) -> None:
        """Refuse what no parameter has asked for. Raises ParameterError: a name is unknown."""
        for name in self.rest():
            if name not in known:
                raise ParameterError(f'{name}: no such parameter{nearest(name, tuple(known))}')


def declare(node: Node, settings: Settings) -> None:
    """Declare every setting with its unit, range and meaning; constants as read-only."""
    for name, (entry, value) in settings.items():
        node.declare_parameter(name, list(value) if isinstance(value, tuple) else value,
                               describe(entry), ignore_override=True)


def declare_names(node: Node, name: str, value: Sequence[str], description: str) -> None:
    """Declare a read-only list of texts."""
    descriptor = ParameterDescriptor(description=description, read_only=True)
    node.declare_parameter(name, list(value) or [''], descriptor, ignore_override=True)


def describe(entry: Entry) -> ParameterDescriptor:
    """Return the descriptor of a parameter: what `ros2 param describe` shows."""
    unit = f' [{entry.unit}]' if entry.unit not in ('', '1') else ''
    descriptor = ParameterDescriptor(
        description=f'{entry.description}{unit}', read_only=not entry.live,
        additional_constraints=entry.allowed())
    bounded = math.isfinite(entry.low) and math.isfinite(entry.high)
    if entry.choices is None and entry.lengths is None and bounded:
        if entry.whole:
            descriptor.integer_range = [
                IntegerRange(from_value=int(entry.low), to_value=int(entry.high), step=1)]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=entry.low, to_value=entry.high, step=0.0)]
    return descriptor


def accept_changes(node: Node, entries: Mapping[str, Entry],
                   change: Callable[[dict[str, Value]], str]) -> None:
    """
    Let parameters be set while the node runs.

    node : the node on which they are declared
    entries : what may be said of each parameter
    change : puts a set of changes in force and returns '', or refuses all and returns why
    """
    def as_floats(parameters: list[Parameter[Any]]) -> list[Parameter[Any]]:
        # `ros2 param set ... 1` sends a whole number where 1.0 is meant
        return [Parameter(item.name, value=_with_floats(_plain(item.value), entries[item.name]))
                if item.name in entries else item for item in parameters]

    def check_and_change(parameters: list[Parameter[Any]]) -> SetParametersResult:
        changes: dict[str, Value] = {}
        try:
            for item in parameters:
                if item.name in entries:
                    changes[item.name] = entries[item.name].check(item.name, _plain(item.value))
                elif not node.has_parameter(item.name):
                    raise ParameterError(f'{item.name}: no such parameter'
                                         f'{nearest(item.name, tuple(entries))}')
            reason = change(changes) if changes else ''
        except ParameterError as error:
            reason = str(error)
        return SetParametersResult(successful=not reason, reason=reason)

    if hasattr(node, 'add_pre_set_parameters_callback'):
        node.add_pre_set_parameters_callback(as_floats)
    node.add_on_set_parameters_callback(check_and_change)


def _with_floats(value: Any, entry: Entry) -> Any:
    if entry.choices is not None or entry.whole:
        return value
    if isinstance(value, list):
        return [_with_floats(item, entry) for item in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return list(value)
