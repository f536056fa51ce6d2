# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
