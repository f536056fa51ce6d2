# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The page from start to end: drive, link, servers, and an orderly end at Ctrl-C."""

import asyncio
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
import secrets
import signal
import sys
from typing import Any

from antenna_drive.live.board import Board
from antenna_drive.live.link import DriveLink
from antenna_drive.live.own_processes import OwnDrive, RecorderProcess
from antenna_drive.live.server import Server
from antenna_drive.live.session import Session
from antenna_drive.lockstep.namespaces import AnotherDrive, drive_namespace
from simgap.errors import UserError


@dataclass(frozen=True)
class LiveOptions:
    """What the command was told; see `antenna-drive live --help`."""

    join: bool = False
    namespace: str = ''
    experiment: str | None = None
    config: tuple[str, ...] = ()
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    pace: float = 1.0
    out: Path = Path('recordings')
    port: int = 0
    host: str = ''
    token: str = ''


def serve(options: LiveOptions) -> int:
    """
    Serve the page until SIGINT or SIGTERM; return 0.

    Raises AnotherDrive: there is a drive already where one is to be started.
    Raises UserError: a port is taken, a configuration or a namespace is not allowed.
    """
    with ExitStack() as held:
        if not options.join:
            # other tools look for the drive of a page where they were told: it has to be free
            try:
                space = held.enter_context(drive_namespace(options.namespace, 'live'))
            except AnotherDrive as error:
                raise AnotherDrive(f'{error}, or show it with --join') from None
            options = replace(options, namespace=space)
        return asyncio.run(_serve(options))


async def _serve(options: LiveOptions) -> int:
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    own = None if options.join else OwnDrive(options.config, options.parameters,
                                             options.namespace, options.pace)
    try:
        if own is not None:
            own.start(options.experiment)  # it takes longest
        board = Board()
        try:
            link = DriveLink(board, options.namespace)
        except ValueError as error:  # rclpy names what is wrong with a namespace
            raise UserError(f'--namespace {options.namespace}: {error}') from error
        session = Session(link, board, RecorderProcess(options.out, options.namespace), own,
                          options.experiment)
        try:
            await _serve_session(options, session, ended)
        finally:
            await session.close()
    finally:
        if own is not None:
            own.stop()
    return 0


async def _serve_session(options: LiveOptions, session: Session, ended: asyncio.Event) -> None:
    token = (options.token or secrets.token_urlsafe(24)) if options.host else ''
    server = Server(session, options.host, options.port, token)
    looking = asyncio.ensure_future(session.look_after())
    whose = 'a drive that runs' if options.join else 'a drive of its own'
    print(f'{server.url}  shows {whose}; Ctrl-C ends it', flush=True)
    waiting = asyncio.ensure_future(ended.wait())
    await asyncio.wait({waiting, looking}, return_when=asyncio.FIRST_COMPLETED)
    waiting.cancel()
    looking.cancel()
    print('ending', file=sys.stderr, flush=True)
    await server.close()
    if looking.done() and not looking.cancelled():
        looking.result()  # it never returns: this raises what went wrong
