# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What became of a task that is done beside the watch: the watch goes on, whatever it fails of."""

from concurrent.futures import BrokenExecutor, Future
from typing import Any

from simgap.errors import one_line

_LONGEST = 300


def outcome(future: Future[dict[str, Any]]) -> tuple[dict[str, Any] | None, str]:
    """
    Return what a task that has ended has found, None if it has failed, and why, '' if it has not.

    Raises BrokenExecutor: its process was ended.
    """
    try:
        return future.result(), ''
    except BrokenExecutor:
        raise
    except Exception as error:  # noqa: B902 (a fault of the task must not end the twin)
        return None, one_line(error, _LONGEST)
