# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The command `live` as a process of its own, for tests that talk to it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
from types import TracebackType
from typing import Any

from tornado.websocket import websocket_connect, WebSocketClientConnection

# A hang is a failure; nothing is judged by how long it took.
PATIENCE_S = 90.0


class LiveCommand:
    """`antenna-drive live` on a free port; it ends with the context."""

    def __init__(self, folder: Path, domain_id: int, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'antenna_drive', 'live', '--port', '0', '--out',
             str(folder / 'recordings'), *arguments], cwd=folder, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain_id)})
        assert self._process.stdout is not None
        self.said = self._process.stdout.readline()
        self.url = self.said.split()[0]

    def line(self) -> str:
        """Return the next line that it says."""
        assert self._process.stdout is not None
        said = self._process.stdout.readline()
        self.said += said
        return said

    @property
    def number(self) -> int:
        """Return the number of the process."""
        return self._process.pid

    def end(self) -> int:
        """End it as Ctrl-C does; return the exit code."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        return self.wait()

    def wait(self) -> int:
        """Wait for its own end; return the exit code."""
        code = self._process.wait(PATIENCE_S)
        assert self._process.stdout is not None
        self.said += self._process.stdout.read()
        return code

    def __enter__(self) -> LiveCommand:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        try:
            self.end()
        finally:
            self._process.kill()
            self._process.wait()
            assert self._process.stdout is not None
            self._process.stdout.close()


class Client:
    """What a page does, without a browser: it asks, and keeps the last notice of each kind."""

    def __init__(self, socket: WebSocketClientConnection) -> None:
        self._socket = socket
        self.notices: dict[str, Any] = {}
        self.pieces: list[bytes] = []
        self._asked = 0

    @classmethod
    async def to(cls, url: str) -> Client:
        address = url.replace('http', 'ws', 1).replace('/?', '/socket?')
        return cls(await websocket_connect(address if '?' in address else address + 'socket'))

    async def _read(self) -> dict[str, Any]:
        message = await asyncio.wait_for(self._socket.read_message(), PATIENCE_S)
        assert message is not None, 'the server has gone'
        if isinstance(message, bytes):
            self.pieces.append(message)
            return {}
        told: dict[str, Any] = json.loads(message)
        kind = told['kind']
        self.notices[f'{kind} {told["unit"]}' if 'unit' in told else kind] = told
        return told

    async def until(self, true: Callable[[], Any]) -> Any:
        """Read until something is true."""
        end = asyncio.get_running_loop().time() + PATIENCE_S
        while not (value := true()):
            assert asyncio.get_running_loop().time() < end, f'in vain; {list(self.notices)}'
            await self._read()
        return value

    async def ask(self, do: str, **rest: Any) -> dict[str, Any]:
        """Ask, and return the answer."""
        self._asked += 1
        await self._socket.write_message(json.dumps({'id': self._asked, 'do': do, **rest}))
        while True:
            told = await self._read()
            if told.get('kind') == 'answer' and told.get('id') == self._asked:
                return told
