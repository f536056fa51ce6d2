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
"""What became of a task that is done beside the watch: the watch goes on, whatever it fails of."""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, Future
from typing import Any

from antenna_drive.errors import one_line

_LONGEST = 300


def outcome(future: Future[dict[str, Any]]) -> tuple[dict[str, Any] | None, str]:
    """
    Return what a task that has ended has found, None if it has failed, and why, '' if it has not.

    Raises
    ------
    BrokenExecutor : its process was ended

    """
    try:
        return future.result(), ''
    except BrokenExecutor:
        raise
    except Exception as error:  # noqa: B902 (a fault of the task must not end the twin)
        return None, one_line(error, _LONGEST)
