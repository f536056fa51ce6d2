# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The drive as the page sees it: a ROS 2 node that nobody waits for.

Frames are taken in bulk, twenty times a second, so that the drive is not slowed by a reader that
wakes for each. Services and everything else are served in another thread.
"""

from collections import deque
from collections.abc import Mapping
import json
import os
from threading import Event, Thread
import time
from typing import Any

from antenna_drive.emulator.wiring import DRIVE, OUTPUTS, TEST_SIGNAL
from antenna_drive.live.asking import ask
from antenna_drive.live.board import Board
from antenna_drive.live.history import History
from antenna_drive.live.parameter_table import entry_of
from antenna_drive.live.twins import Twins
from antenna_drive.lockstep.changes import CHANGES, SETTINGS
from antenna_drive.lockstep.entry import own_node
from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.observer import Observer
from antenna_drive.lockstep.run_control import RunState
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Parameter as ParameterMessage, ParameterEvent, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters, GetParameters, ListParameters, SetParametersAtomically,
)
from rclpy.parameter import Parameter
from simgap.errors import UserError
from std_srvs.srv import Trigger

PERIOD_S = 0.05
# How many changes the page is told of.
_REMEMBERED = 60

_UNITS = tuple(OUTPUTS)
_KINDS = ('', 'bool_value', 'integer_value', 'double_value', 'string_value', 'byte_array_value',
          'bool_array_value', 'integer_array_value', 'double_array_value', 'string_array_value')


class DriveLink:
    """
    What can be seen of a drive, and what can be asked of it.

    history : the signals of the last minute
    settings : the parameters of each unit as they are in force
    reports : what each node said last of itself, and when
    twins : those that report in the same ROS 2 domain
    """

    def __init__(self, board: Board, namespace: str = '') -> None:
        """Join; the drive may come later. News goes to the board."""
        self._board = board
        self.namespace = '/' + namespace.strip('/') if namespace.strip('/') else ''
        self._node = own_node(f'live_{os.getpid()}', self.namespace)
        self.history = History(len(DRIVE.signals))
        self.settings: dict[str, dict[str, Any]] = {unit: {} for unit in _UNITS}
        self._own: dict[str, dict[str, Any]] = {unit: {} for unit in _UNITS}
        self._changes: deque[dict[str, Any]] = deque(maxlen=_REMEMBERED)
        self._count = 0
        self.reports: dict[str, dict[str, Any]] = {}
        self._listen()
        self.twins = Twins(self._node, board)
        self._clients: dict[tuple[str, str], Any] = {
            (unit, name): self._node.create_client(kind, f'{unit}/{name}')
            for unit in _UNITS for name, kind in (
                ('list_parameters', ListParameters), ('describe_parameters', DescribeParameters),
                ('get_parameters', GetParameters),
                ('set_parameters_atomically', SetParametersAtomically))}
        self._triggers: dict[str, Any] = {
            name: self._node.create_client(Trigger, f'{TEST_SIGNAL}/{name}')
            for name in ('pause', 'resume', 'step', 'reset', 'play')}
        self._stop = Event()
        self._told: RunState | None = None
        self._look_at = 0.0
        self._observer = Observer(
            self._node, lambda step, time_s, samples: self.history.take(step, samples[:, 0]),
            on_begin=self.history.begin, on_change=self._changed, nap_s=PERIOD_S)
        self._thread = Thread(target=self._observer.spin, args=[self._look], name='frames',
                              daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Leave the drive."""
        self._stop.set()
        self._thread.join()
        self._observer.close()
        leave(self._node)

    # ---- what comes in

    def _listen(self) -> None:
        node = self._node
        node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnosed, 50)
        node.create_subscription(ParameterEvent, '/parameter_events', self._parameters_set, 100)

    def _changed(self, unit: str, record: Mapping[str, Any]) -> None:
        if SETTINGS in record:
            self.settings[unit] = {**record[SETTINGS]}
            self._board.post(f'values {unit}', {'unit': unit, 'values': record[SETTINGS]})
            return
        self.settings[unit].update(record[CHANGES])
        self._count += 1
        self._changes.append({'number': self._count, 'unit': unit, 'run': record['run'],
                              'step': record['step'], 'changes': record[CHANGES]})
        self._board.post('changes', {'changes': list(self._changes)})
        self._board.post(f'values {unit}', {'unit': unit, 'values': self.settings[unit]})

    def _parameters_set(self, event: ParameterEvent) -> None:
        unit = self._unit_of(event.node)
        if unit is None:
            return
        # what is no setting of the unit, as run.pace, is in no record of changes
        values = {item.name: _plain(item.value) for item in event.changed_parameters}
        self._own[unit].update(values)
        self._board.post(f'own {unit}', {'unit': unit, 'values': self._own[unit]})

    def _diagnosed(self, message: DiagnosticArray) -> None:
        for status in message.status:
            unit = self._unit_of(status.name)
            if unit is None:
                self.twins.take(status)
            else:
                self.reports[unit] = {
                    'level': ord(status.level), 'message': status.message[:300],
                    'values': {item.key[:80]: item.value[:200] for item in status.values[:40]},
                    'heard': time.monotonic()}
                self._board.post('nodes', {'nodes': self.nodes()})

    def _unit_of(self, full: str) -> str | None:
        space, _, name = full.rpartition('/')
        return name if space == self.namespace and name in OUTPUTS else None

    def nodes(self) -> dict[str, Any]:
        """Return what each node said last of itself, and how long ago [s]."""
        now = time.monotonic()
        return {unit: {**report, 'heard': now - report['heard']}
                for unit, report in dict(self.reports).items()}

    @property
    def lost(self) -> int:
        """Return how many steps were missed after the first that was seen."""
        return self._observer.lost

    def _look(self) -> bool:
        """Post what the run does, if that is news; return whether to leave the drive."""
        now = time.monotonic()
        if now >= self._look_at:
            self._look_at = now + PERIOD_S
            state = self._observer.state
            if state != self._told and state is not None:
                self._told = state
                self._board.post('state', state._asdict())
        return self._stop.is_set()

    # ---- what is asked

    def ready(self) -> bool:
        """Return whether the parameters of every unit can be asked for."""
        return all(client.service_is_ready() for client in self._clients.values())

    async def load(self, unit: str) -> None:
        """Ask a unit for its parameters, and post their table; UserError if it does not answer."""
        listed = await ask(self._clients[unit, 'list_parameters'],
                           ListParameters.Request(), unit)
        names = sorted(name for name in listed.result.names
                       if not name.startswith(('qos_overrides.', 'use_sim_time',
                                               'start_type_description')))
        described = await ask(self._clients[unit, 'describe_parameters'],
                              DescribeParameters.Request(names=names), unit)
        got = await ask(self._clients[unit, 'get_parameters'],
                        GetParameters.Request(names=names), unit)
        values = dict(zip(names, map(_plain, got.values)))
        self.settings[unit].update(values)
        self._board.post(f'parameters {unit}', {
            'unit': unit, 'entries': [entry_of(item, values[item.name])
                                      for item in described.descriptors if item.name in values]})

    async def set(self, unit: str, values: Mapping[str, Any]) -> str:  # noqa: A003
        """
        Set parameters of a unit, all or none; return why they are refused, or ''.

        Raises UserError: there is no such unit, a value is of no kind, or the node does not
        answer.
        """
        if unit not in OUTPUTS:
            raise UserError(f'{unit}: no such node')
        result = await ask(
            self._clients[unit, 'set_parameters_atomically'], SetParametersAtomically.Request(
                parameters=[_message(name, value) for name, value in values.items()]), unit)
        return '' if result.result.successful else result.result.reason or 'refused'

    async def trigger(self, service: str) -> tuple[bool, str]:
        """
        Call a service of the run control; return whether it is done, and what was said.

        Raises UserError: it does not answer.
        """
        answer = await ask(self._triggers[service], Trigger.Request(), TEST_SIGNAL)
        return bool(answer.success), str(answer.message)


def _plain(value: ParameterValue) -> Any:
    if not 0 < value.type < len(_KINDS):
        return None
    found = getattr(value, _KINDS[value.type])
    return list(found) if value.type >= 5 else found


def _message(name: str, value: Any) -> ParameterMessage:
    if isinstance(value, (list, tuple)) and not all(isinstance(item, str) for item in value):
        value = [float(item) for item in value]
    if not isinstance(value, (bool, int, float, str, list, tuple)):
        raise UserError(f'{name}: {json.dumps(value)[:80]} given, allowed is a value')
    return Parameter(name, value=value).to_parameter_msg()
