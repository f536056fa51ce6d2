# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The live data and parameters for Foxglove and other readers of its WebSocket protocol.

Each unit has a channel with its signals, and each parameter is called 'unit.name'. The Foxglove
SDK serves them in threads of its own. What clients ask is done in the loop of the session; what is
new comes from the history and the board, as for the page.
"""

import asyncio
from collections.abc import Awaitable, Iterator, Mapping
import json
from typing import Any

from antenna_drive.emulator.unit import Signal
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.live.history import Piece
from antenna_drive.live.session import Session
from foxglove import Channel, Context, Parameter, start_server, StatusLevel
from foxglove.websocket import Capability, Client, ServerListener
import numpy as np
from simgap.errors import UserError

HOST = '127.0.0.1'
PERIOD_S = 0.05


class FoxgloveServer(ServerListener):
    """A WebSocket on a port of this machine; no other machine can reach it."""

    def __init__(self, session: Session, port: int = 0) -> None:
        """
        Listen; from a coroutine, in whose loop requests are then done.

        session : what is served
        port : 0 for any free one

        Raises UserError: the port cannot be had.
        """
        self._session = session
        self._loop = asyncio.get_running_loop()
        self._values: dict[str, Any] = {}
        # channels end with their context
        self._context = context = Context()
        self._channels = {
            unit: Channel(f'{session.link.namespace}/{unit}', schema=schema(unit, signals),
                          context=context)
            for unit, signals in OUTPUTS.items()}
        try:
            self._server = start_server(
                name='antenna_drive', host=HOST, port=port, context=context, server_listener=self,
                capabilities=[Capability.Parameters, Capability.Time])
        except RuntimeError as error:
            raise UserError(f'{HOST}:{port}: cannot be listened on, {error}; another --foxglove '
                            'PORT may be free') from error
        self.url = f'ws://localhost:{self._server.port}'
        self._sending = asyncio.ensure_future(self._send())

    def close(self) -> Awaitable[None]:
        """Listen no more, and close what is open."""
        self._sending.cancel()
        # a client may be waiting for what is done in this loop
        return asyncio.to_thread(self._server.stop)

    # ---- what is told

    async def _send(self) -> None:
        """Send what is new, twenty times a second."""
        read: dict[str, int] = {}
        run = first = 0
        while True:
            for notice in self._session.board.news(read):
                self._tell(json.loads(notice))
            piece = self._session.link.history.since(run, first)
            if piece.run:
                if run and piece.run != run:
                    self._server.clear_session()  # time begins at 0 again
                run, first = piece.run, piece.resume
                self._log(piece)
            await asyncio.sleep(PERIOD_S)

    def _log(self, piece: Piece) -> None:
        self._server.broadcast_time(round(piece.time_s * 1e9))
        column = 0
        for unit, signals in OUTPUTS.items():
            columns = slice(column, column + len(signals))
            column += len(signals)
            if self._channels[unit].has_sinks():
                for time_ns, message in messages(piece, signals, columns):
                    self._channels[unit].log(message, log_time=time_ns)

    def _tell(self, notice: Mapping[str, Any]) -> None:
        """Publish the values of parameters in a notice."""
        if notice['kind'] == 'parameters':
            values = {entry['name']: entry['value'] for entry in notice['entries']}
        elif notice['kind'] in ('values', 'own'):
            values = notice['values']
        else:
            return
        fresh = {f'{notice["unit"]}.{name}': value for name, value in values.items()
                 if value is not None}
        fresh = {name: value for name, value in fresh.items()
                 if name not in self._values or self._values[name] != value}
        self._values.update(fresh)
        if fresh:
            self._server.publish_parameter_values(_parameters(fresh))

    # ---- what is asked, from threads of the SDK

    def on_get_parameters(self, client: Client, param_names: list[str],
                          request_id: str | None = None) -> list[Parameter]:
        """Return parameters in force: those that are named, or all."""
        values = dict(self._values)
        return _parameters({name: values[name] for name in param_names or sorted(values)
                            if name in values})

    def on_set_parameters(self, client: Client, parameters: list[Parameter],
                          request_id: str | None = None) -> list[Parameter]:
        """Set parameters, those of a unit all or none; return what is in force then."""
        asked: dict[str, dict[str, Any]] = {}
        for parameter in parameters:
            unit, _, name = parameter.name.partition('.')
            asked.setdefault(unit, {})[name] = parameter.get_value()
        asyncio.run_coroutine_threadsafe(self._set(asked), self._loop).result()
        return self.on_get_parameters(client, [parameter.name for parameter in parameters])

    async def _set(self, asked: Mapping[str, Mapping[str, Any]]) -> None:
        for unit, given in asked.items():
            values = {name: _as_number(value, self._values.get(f'{unit}.{name}'))
                      for name, value in given.items()}
            about = f'parameters of {unit}'
            try:
                await self._session.ask({'do': 'set', 'unit': unit, 'values': values})
            except UserError as error:
                self._server.publish_status(str(error), StatusLevel.Error, about)
                continue
            self._server.remove_status([about])
            self._values.update({f'{unit}.{name}': value for name, value in values.items()})


def schema(unit: str, signals: tuple[Signal, ...]) -> dict[str, Any]:
    """Return the JSON schema of the messages of a unit, which has the units of its signals."""
    values = {signal.name: {'type': 'number',
                            'description': f'{signal.description} [{signal.unit}]'}
              for signal in signals}
    return {'title': f'antenna_drive.{unit}', 'type': 'object', 'properties': {
        **values,
        'least': {'type': 'object', 'properties': values,
                  'description': 'least value since the message before'},
        'greatest': {'type': 'object', 'properties': values,
                     'description': 'greatest value since the message before'}}}


def messages(piece: Piece, signals: tuple[Signal, ...], columns: slice,
             ) -> Iterator[tuple[int, dict[str, Any]]]:
    """
    Yield a message for each interval that is complete: its time [ns], and values by name.

    piece : of the history
    signals, columns : of a unit, and where they are in the piece
    """
    names = [signal.name for signal in signals]
    per = round(piece.interval_s / piece.step_s)
    count = piece.resume - piece.first
    parts = [part[:count, columns] for part in (piece.ends, piece.lows, piece.highs)]
    for number in np.flatnonzero(np.isfinite(parts[0]).all(axis=1)).tolist():
        last = (piece.first + number + 1) * per - 1
        ends, least, greatest = (dict(zip(names, part[number].tolist())) for part in parts)
        yield round(last * piece.step_s * 1e9), {**ends, 'least': least, 'greatest': greatest}


def _parameters(values: Mapping[str, Any]) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


def _as_number(value: Any, known: Any) -> Any:
    """Return a whole number as the number with a fraction that the parameter is."""
    return float(value) if isinstance(known, float) and type(value) is int else value
