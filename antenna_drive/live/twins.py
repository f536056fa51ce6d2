# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What twins say: their state, their verdict as it grows, and the next test.

A twin is known by its report in /diagnostics, whatever its name and namespace. What it sends is
checked: anything may be on a topic.
"""

from collections.abc import Mapping
from functools import partial
import json
import math
from typing import Any

from antenna_drive.live.asking import ask
from antenna_drive.live.board import Board
from antenna_drive.lockstep.run_services import STATE_QOS
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from simgap.errors import UserError
from std_msgs.msg import Empty, String
from std_srvs.srv import Trigger

# A report that has these values is that of a twin.
_REPORTED = {'state', 'tuning', 'watched', 'false alarms per day'}
_MOST, _LONGEST, _LOOKS, _ANSWERS, _LINES = 8, 200_000, 200, 12, 40


class Twins:
    """Listens to every twin, and asks what a page wants of one."""

    def __init__(self, node: Node, board: Board) -> None:
        """Begin with none; news goes to the board."""
        self._node, self._board = node, board
        self._told: dict[str, dict[str, Any]] = {}
        self._begins: dict[str, Any] = {}
        self._proposes: dict[str, Any] = {}

    def take(self, status: DiagnosticStatus) -> None:
        """Take what somebody reports in /diagnostics; what is not of a twin is left out."""
        values = {item.key[:80]: item.value[:300] for item in status.values[:80]}
        if not _REPORTED <= values.keys():
            return
        if status.name not in self._told:
            if len(self._told) >= _MOST:
                return
            self._meet(status.name)
        told = self._told[status.name]
        told.update(level=ord(status.level), message=status.message[:600], values=values,
                    reports=told['reports'] + 1)
        self._post(status.name)

    def _meet(self, name: str) -> None:
        """Listen to a twin that reports for the first time."""
        self._told[name] = {'name': name, 'reports': 0, 'verdict': None, 'next_test': None}
        for topic, read in (('verdict', verdict_of), ('next_test', next_test_of)):
            self._node.create_subscription(String, f'{name}/{topic}',
                                           partial(self._listen, name, topic, read), STATE_QOS)
        self._begins[name] = self._node.create_publisher(Empty, f'{name}/begin_test', 1)
        self._proposes[name] = self._node.create_client(Trigger, f'{name}/propose')

    def _listen(self, name: str, topic: str, read: Any, message: String) -> None:
        found = read(message.data)
        if found is not None:
            self._told[name][topic] = found
            self._post(name)

    def _post(self, name: str) -> None:
        self._board.post(f'twin {name}', self._told[name])

    def begin_test(self, name: str) -> None:
        """Tell a twin that another test begins. Raises UserError: there is no such twin."""
        if name not in self._begins:
            raise UserError(f'{name[:80]}: no such twin')
        self._begins[name].publish(Empty())

    async def propose(self, name: str) -> str:
        """Ask a twin for the next test; return its answer; UserError if there is none."""
        if name not in self._proposes:
            raise UserError(f'{name[:80]}: no such twin')
        answer = await ask(self._proposes[name], Trigger.Request(), name)
        if not answer.success:
            raise UserError(answer.message)
        return str(answer.message)

    def next_test(self, name: str) -> Mapping[str, Any]:
        """Return the test sheet that a twin proposes, as plain data; UserError if none."""
        proposed = (self._told.get(name) or {}).get('next_test') or {}
        if not proposed.get('test'):
            raise UserError(f'{name[:80]}: proposes no test')
        return dict(proposed['test'])


def verdict_of(text: str) -> dict[str, Any] | None:
    """Return what a page is told of a growing verdict, None if the text holds none."""
    try:
        told = _object(text)
        looks = [{'seconds': _number(look['seconds']),
                  'probabilities': {str(answer)[:200]: _number(p) for answer, p in list(
                      look['probabilities'].items())[:_ANSWERS]}}
                 for look in told['looks'][-_LOOKS:]]
        return {'say': str(told['say'])[:600], 'decided': told['decided'] is True,
                'fault': str(told['fault'])[:600], 'looks': looks}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def next_test_of(text: str) -> dict[str, Any] | None:
    """Return what a page is told of a next test, None if the text holds none."""
    try:
        told = _object(text)
        test = told['test'] or None
        if test is not None and not isinstance(test, dict):
            return None
        json.dumps(test, allow_nan=False)
        return {'under_way': told['under_way'] is True, 'after_s': _number(told['after_s']),
                'fault': str(told['fault'])[:600], 'test': test,
                'say': [str(line)[:300] for line in told['say'][:_LINES]],
                'sheet': str(told['sheet'])[:_LONGEST]}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _object(text: str) -> dict[str, Any]:
    if len(text) > _LONGEST:
        raise ValueError('too long')
    told = json.loads(text)
    if not isinstance(told, dict):
        raise ValueError('no object')
    return told


def _number(value: Any) -> float:
    found = float(value)
    if not math.isfinite(found):
        raise ValueError('not finite')
    return found
