# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A question to a node, by a service."""

import asyncio
from typing import Any

from simgap.errors import UserError

# An answer of a node takes a few milliseconds; a change waits up to five seconds for a step.
PATIENCE_S = 8.0


async def ask(client: Any, request: Any, who: str) -> Any:
    """Return the answer of a node whose callbacks another thread serves; UserError if none."""
    if not client.service_is_ready():
        raise UserError(f'{who} does not answer: is it running?')
    loop = asyncio.get_running_loop()
    answered: asyncio.Future[Any] = loop.create_future()

    def done(future: Any) -> None:
        loop.call_soon_threadsafe(_settle, answered, future)

    client.call_async(request).add_done_callback(done)
    try:
        return await asyncio.wait_for(answered, PATIENCE_S)
    except asyncio.TimeoutError:
        raise UserError(f'{who} has not answered for {PATIENCE_S:g} s') from None


def _settle(answered: asyncio.Future[Any], future: Any) -> None:
    if not answered.done():
        if future.exception() is not None:
            answered.set_exception(UserError(str(future.exception())))
        else:
            answered.set_result(future.result())
