# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How many threads linear algebra may use while something is done."""

from __future__ import annotations

from collections.abc import Callable

from threadpoolctl import threadpool_info, threadpool_limits

Look = Callable[[], None]


def during(work: Callable[[Look], object]) -> set[int]:
    """Return the numbers that `work` sees, which calls what it is given to look."""
    seen: set[int] = set()
    with threadpool_limits(2, 'blas'):
        work(lambda: seen.update(_allowed()))
        assert _allowed() == {2}  # as before
    return seen


def _allowed() -> set[int]:
    return {pool['num_threads'] for pool in threadpool_info() if pool['user_api'] == 'blas'}
