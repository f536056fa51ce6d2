# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The web server of the page: files of this package, and a WebSocket for each open page.

It serves this machine only, unless it is told an address; then every request needs the token. A
page of another site cannot use it: the names that it answers to are known, and a WebSocket has to
come from the page itself.
"""

import asyncio
from collections.abc import Awaitable
import hmac
import json
from pathlib import Path
import socket
from urllib.parse import urlsplit

from antenna_drive.live.session import Session
from antenna_drive.pages import FOLDER
from simgap.errors import UserError
from simgap.report.render import FOLDER as SHARED
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

# Much shorter than the period in which the link brings something new: a page gets it at once.
LOOK_S = 0.01
# No page asks for more at once; longer messages are none of ours.
_MOST_UNDER_WAY = 16
_LONGEST_MESSAGE = 100_000
_COOKIE = 'antenna_drive_token'
_LOCAL = ('localhost', '127.0.0.1', '::1')

_KINDS = {'.html': 'text/html; charset=utf-8', '.js': 'text/javascript; charset=utf-8',
          '.css': 'text/css; charset=utf-8'}
# What may be asked for, and the file that it is.
_FILES: dict[str, Path] = {
    '/': FOLDER / 'live' / 'index.html',
    '/uPlot.js': SHARED / 'uplot' / 'uPlot.iife.min.js',
    '/gestures.js': SHARED / 'gestures.js',
    '/uPlot.css': SHARED / 'uplot' / 'uPlot.min.css',
    **{f'/{path.name}': path for path in sorted((FOLDER / 'live').glob('*.*'))
       if path.suffix in ('.js', '.css')},
}


class _Guarded(RequestHandler):
    """A request from somebody who may ask."""

    def initialize(self, hosts: tuple[str, ...], token: str, session: Session) -> None:
        """Take who may ask, and the session."""
        self.hosts, self.token, self.session = hosts, token, session

    def prepare(self) -> None:
        """Refuse whoever comes by another name or without the token."""
        name = urlsplit(f'//{self.request.host}').hostname or ''
        if self.hosts and name not in self.hosts:
            raise HTTPError(403, reason='This page answers to localhost only')
        if self.token:
            given = self.get_query_argument('token', '') or self.get_cookie(_COOKIE, '') or ''
            if not hmac.compare_digest(given.encode(), self.token.encode()):
                raise HTTPError(403, reason='The address lacks the token that the command printed')


class _File(_Guarded):
    """A file of the page."""

    def get(self) -> None:
        """Send it."""
        path = _FILES.get(self.request.path)
        if path is None:
            raise HTTPError(404)
        if self.get_query_argument('token', ''):
            self.set_cookie(_COOKIE, self.token, httponly=True, samesite='Strict')
        self.set_header('Content-Type', _KINDS[path.suffix])
        self.set_header('Cache-Control', 'no-cache')
        self.set_header('X-Content-Type-Options', 'nosniff')
        self.set_header('Referrer-Policy', 'no-referrer')
        self.set_header('Content-Security-Policy', (
            "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
            f"connect-src 'self' ws://{self.request.host}; img-src data:; "
            "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"))
        self.finish(path.read_bytes())


class _Socket(_Guarded, WebSocketHandler):
    """One open page."""

    def open(self, *args: str, **kwargs: str) -> None:  # noqa: A003 (as tornado says)
        """Begin to send."""
        self.set_nodelay(True)
        self._under_way: set[asyncio.Future[None]] = set()
        self._sending = asyncio.ensure_future(self._send())

    async def _send(self) -> None:
        """
        Send what is new as soon as the link has brought it, twenty times a second.

        The next piece is made when the last has left: a slow page gets fewer and longer ones, at
        most what the history keeps.
        """
        board, history = self.session.board, self.session.link.history
        read: dict[str, int] = {}
        run = first = 0
        time_s = -1.0
        try:
            while True:
                for notice in board.news(read):
                    await self.write_message(notice)
                piece = history.since(run, first)
                if piece.run and (piece.run, piece.time_s) != (run, time_s):
                    await self.write_message(piece.packed(), binary=True)
                    run, first, time_s = piece.run, piece.resume, piece.time_s
                await asyncio.sleep(LOOK_S)
        except WebSocketClosedError:
            pass

    def on_message(self, message: str | bytes) -> None:
        """Do what the page asks, beside what it asked before."""
        if len(self._under_way) >= _MOST_UNDER_WAY or not isinstance(message, str):
            return
        task = asyncio.ensure_future(self._answer(message))
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def _answer(self, text: str) -> None:
        number = None
        try:
            message = json.loads(text)
            if not isinstance(message, dict):
                raise UserError('no request')
            number = message.get('id')
            answer = {'ok': True, 'result': await self.session.ask(message)}
        except UserError as error:
            answer = {'ok': False, 'reason': str(error)}
        except (ValueError, RecursionError):
            answer = {'ok': False, 'reason': 'no request'}
        except ModuleNotFoundError as error:
            answer = {'ok': False, 'reason': f'{error.name} is not installed'}
        except OSError as error:
            answer = {'ok': False, 'reason': str(error)}
        try:
            await self.write_message(json.dumps({'kind': 'answer', 'id': number, **answer}))
        except WebSocketClosedError:
            pass

    def on_close(self) -> None:
        """Stop sending."""
        if hasattr(self, '_sending'):
            self._sending.cancel()


class Server:
    """The page on a port of this machine."""

    def __init__(self, session: Session, host: str = '', port: int = 0, token: str = '') -> None:
        """
        Listen.

        session : what is served
        host : address to listen on; '' for this machine only
        port : 0 for any free one
        token : needed with each request; '' for none

        Raises UserError: the address cannot be had.
        """
        hosts = () if host else _LOCAL
        rest = {'hosts': hosts, 'token': token, 'session': session}
        application = Application(
            [(r'/socket', _Socket, rest), (r'/.*', _File, rest)],
            websocket_max_message_size=_LONGEST_MESSAGE, websocket_ping_interval=20.0,
            log_function=lambda handler: None)
        self._server = HTTPServer(application)
        try:
            self._sockets = bind_sockets(port, host or '127.0.0.1')
        except (OSError, socket.gaierror) as error:
            raise UserError(f'{host or "127.0.0.1"}:{port}: cannot be listened on, '
                            f'{error.strerror or error}; another --port may be free') from error
        self._server.add_sockets(self._sockets)
        self.port: int = self._sockets[0].getsockname()[1]
        shown = f'[{host}]' if ':' in host else host or 'localhost'
        self.url = f'http://{shown}:{self.port}/' + (f'?token={token}' if token else '')

    def close(self) -> Awaitable[None]:
        """Listen no more, and close what is open."""
        self._server.stop()
        return self._server.close_all_connections()
