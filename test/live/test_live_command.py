# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The server without a browser: whom it answers, what it refuses, and how it ends."""

from __future__ import annotations

import asyncio
import gc
import os
from pathlib import Path
import socket
import struct
from types import SimpleNamespace
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to look at')
pytest.importorskip('tornado', reason='tornado is not installed: no page')

from antenna_drive.cli import main  # noqa: E402, I100
from antenna_drive.live import history as history_module, server  # noqa: E402
from antenna_drive.live.board import Board  # noqa: E402
from antenna_drive.live.history import History, Piece  # noqa: E402
from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402
from live_command import Client, LiveCommand  # noqa: E402
from tornado.httpclient import HTTPClientError, HTTPRequest  # noqa: E402
from tornado.websocket import websocket_connect  # noqa: E402


def status(url: str, **headers: str) -> int:
    try:
        with urlopen(Request(url, headers=headers)) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def children(of: int) -> set[int]:
    """Return the processes that a process has started and that still run."""
    found = set()
    for folder in Path('/proc').glob('[0-9]*'):
        try:
            after_name = (folder / 'stat').read_text().rpartition(')')[2].split()
        except OSError:
            continue
        if int(after_name[1]) == of and after_name[0] != 'Z':
            found.add(int(folder.name))
    return found


def is_alive(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


async def _turn_the_drive(url: str) -> None:
    client = await Client.to(url)
    await client.until(lambda: client.notices.get('drive', {}).get('ready'))
    await client.until(lambda: client.pieces)
    # What is set before a unit has begun the run is among its settings, and no change.
    await client.until(lambda: 'values torque_share' in client.notices)
    table = {entry['name']: entry
             for entry in client.notices['parameters torque_share']['entries']}
    pot = table['bias_pot']
    assert (pot['low'], pot['high'], pot['unit'], pot['live']) == (0.0, 1.0, '', True)
    assert table['filter_1.gain']['unit'] == '1/s'
    assert (table['filter_1.gain']['low'], table['filter_1.gain']['high']) == (0.0, 1e4)
    assert not table['k_2']['live']
    assert (await client.ask('set', unit='torque_share', values={'bias_pot': 0.25}))['ok']
    change = await client.until(lambda: client.notices.get('changes'))
    assert change['changes'][-1]['changes'] == {'bias_pot': 0.25}
    for request, reason in (
            ({'do': 'set', 'unit': 'torque_share', 'values': {'bias_pot': 7.0}}, 'bias_pot'),
            ({'do': 'set', 'unit': 'torque_share', 'values': {'k_2': -1.0}}, 'k_2'),
            ({'do': 'set', 'unit': 'nobody', 'values': {'k_2': -1.0}}, 'no such node'),
            ({'do': 'set', 'unit': 'plant', 'values': {'x': {}}}, 'x: {}'),
            ({'do': 'run', 'service': 'shutdown'}, 'no such service'),
            ({'do': 'run', 'service': 'step'}, 'call pause first'),
            ({'do': 'load', 'path': '/nowhere.csv'}, 'no such file'),
            ({'do': 'record', 'on': True, 'name': '../out'}, 'no name'),
            ({'do': 'experiment', 'name': 'T9'}, 'no such experiment'),
            ({'do': 'preview', 'values': {'period': -1}, 'span': 1.0}, 'period'),
            ({'do': 'play', 'path': '/nowhere.yaml'}, 'nowhere.yaml'),
            ({'do': 'dance'}, 'no such request')):
        told = await client.ask(**request)
        assert not told['ok'] and reason in told['reason'], told


@pytest.mark.slow
def test_a_page_turns_a_drive_which_ends_with_it(module_domain: int, tmp_path: Path) -> None:
    with LiveCommand(tmp_path, module_domain) as live:
        assert status(live.url) == 200
        assert status(live.url, Host='somewhere.example') == 403, 'a name that is rebound'
        assert status(live.url + '../../etc/passwd') == 404
        nodes = children(live.number)
        assert len(nodes) == 5
        asyncio.run(_turn_the_drive(live.url))
        asyncio.run(_come_from_elsewhere(live.url))
        assert live.end() == 0
        assert not any(is_alive(number) for number in nodes)
    assert 'Traceback' not in live.said


async def _come_from_elsewhere(url: str) -> None:
    address = url.replace('http', 'ws', 1) + 'socket'
    with pytest.raises(HTTPClientError, match='403'):
        await websocket_connect(HTTPRequest(address, headers={'Origin': 'http://evil.example'}))


async def _join(url: str) -> None:
    client = await Client.to(url)
    await client.until(lambda: client.notices.get('drive', {}).get('ready'))
    hello = client.notices['hello']
    assert (hello['own'], hello['namespace']) == (False, '/east')
    piece = await client.until(lambda: client.pieces[-1] if client.pieces else None)
    assert struct.unpack_from('<4I5d', piece)[2] == len(hello['signals'])
    assert (await client.ask('run', service='pause'))['ok']
    await client.until(lambda: client.notices.get('state', {}).get('state') == 'paused')
    told = await client.ask('experiment', name='T1')
    assert not told['ok'] and 'start the drive with config old_circuit' in told['reason']
    assert (await client.ask('run', service='resume'))['ok']


@pytest.mark.slow
def test_a_drive_that_was_joined_goes_on_without_the_page(
        module_domain: int, tmp_path: Path) -> None:
    with DriveProcesses(config=['new_circuit'], namespace='/east',
                        environment={'ROS_DOMAIN_ID': str(module_domain)}) as drive:
        with LiveCommand(tmp_path, module_domain, '--join', '--namespace', 'east',
                         '--host', '127.0.0.1', '--token', 'sesame') as live:
            assert live.url.endswith('/?token=sesame')
            plain = live.url.partition('?')[0]
            assert status(plain) == status(f'{plain}?token=other') == 403
            assert status(live.url) == status(plain, Cookie='antenna_drive_token=sesame') == 200
            asyncio.run(_join(live.url))
            assert live.end() == 0
        drive.check()


@pytest.mark.parametrize(('arguments', 'reason'), [
    (['--join', '--config', 'old_circuit'], '--config: is for a drive that is started here'),
    (['--experiment', 'T9'], 'allowed are T1, T2'),
    (['--token', 'x'], '--token: is for --host'),
    (['--port', '99999'], '--port'),
    (['--pace', '-1'], '--pace'),
    (['--set', 'nothing'], 'UNIT.NAME=VALUE'),
])
def test_wrong_options_are_said_in_one_line(
        arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['live', *arguments]) == 2
    said = capsys.readouterr().err
    assert reason in said
    assert said.count('\n') == 1


@pytest.mark.slow
def test_a_port_that_is_taken_is_said_in_one_line(
        module_domain: int, tmp_path: Path) -> None:
    with LiveCommand(tmp_path, module_domain, '--join') as first:
        port = first.url.rpartition(':')[2].strip('/')
        with LiveCommand(tmp_path, module_domain, '--join', '--port', port) as second:
            assert second.wait() == 2
            assert 'another --port may be free' in second.said
            assert second.said.count('\n') == 1


def test_a_slow_reader_of_the_board_misses_what_was_replaced() -> None:
    board, read = Board(), dict[str, int]()
    for number in range(1000):
        board.post('values plant', {'unit': 'plant', 'values': {'x': number}})
    assert list(board.news(read)) == [
        '{"kind": "values", "unit": "plant", "values": {"x": 999}}']
    assert list(board.news(read)) == []
    board.post('values plant', {'unit': 'plant', 'values': {'x': 999}})
    assert list(board.news(read)) == [], 'nothing new'


class _Asked(History):
    """A history that counts how often it is asked."""

    asked = 0

    def since(self, run: int, first: int) -> Piece:
        self.asked += 1
        return super().since(run, first)


def test_a_page_that_does_not_read_costs_no_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, 'LOOK_S', 0.0)
    asyncio.run(_feed_a_page_that_does_not_read())


async def _feed_a_page_that_does_not_read() -> None:
    history = _Asked(20)
    history.begin(1, 1e-3)
    session: Any = SimpleNamespace(board=Board(), link=SimpleNamespace(history=history))
    serving = server.Server(session)
    deaf = socket.create_connection(('127.0.0.1', serving.port))
    deaf.sendall(b'GET /socket HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n'
                 b'Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n'
                 b'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n')
    step, asked, turns = 0, -1, 0
    values = np.zeros(20)
    while turns < 50:  # this long it has not asked again, though there was more and more
        for k in range(step, step + 1000):
            history.take(k, values)
        step += 1000
        if step > 100_000:
            turns = turns + 1 if history.asked == asked else 0
        asked = history.asked
        await asyncio.sleep(0)
    assert history.asked > 0
    pages: list[Any] = [item for item in gc.get_objects() if isinstance(item, server._Socket)]
    pending = [page.ws_connection.stream._write_buffer for page in pages]
    assert len(pending) == 1
    # one piece at most waits: all intervals, least and greatest of each signal, four bytes each
    assert 0 < len(pending[0]) <= 1.1 * history_module.KEPT * 20 * 2 * 4
    deaf.close()
    await serving.close()
