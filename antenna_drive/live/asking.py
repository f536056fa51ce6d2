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
    loop, answered = asyncio.get_running_loop(), asyncio.Event()
    future = client.call_async(request)
    future.add_done_callback(lambda future: loop.call_soon_threadsafe(answered.set))
    try:
        await asyncio.wait_for(answered.wait(), PATIENCE_S)
    except asyncio.TimeoutError:
        raise UserError(f'{who} has not answered for {PATIENCE_S:g} s') from None
    if future.exception() is not None:
        raise UserError(str(future.exception()))
    return future.result()
