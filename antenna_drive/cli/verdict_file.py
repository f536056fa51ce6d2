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
"""Read what the JSON of a diagnosis says for whatever comes after it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, TYPE_CHECKING

from antenna_drive.errors import UserError

if TYPE_CHECKING:
    from antenna_drive.diagnosis import Findings


def planning_of(path: Path) -> dict[str, Any]:
    """
    Return the entry `planning` of a verdict.

    Raises
    ------
    UserError : the file is no JSON of a diagnosis, or one of an earlier version
    OSError : it cannot be read

    """
    try:
        data = json.loads(path.read_text(encoding='utf-8'))
        return dict(data['planning'])
    except (ValueError, TypeError) as error:
        raise UserError(f'{path}: no JSON of a diagnosis: {error}') from error
    except KeyError as error:
        raise UserError(f'{path}: no entry {error.args[0]}: a verdict of an earlier version; '
                        'diagnose the recordings again') from error


def findings_of(path: Path, planning: dict[str, Any]) -> Findings:
    """
    Return what the tests of a verdict have told, from its entry `planning`.

    Raises
    ------
    UserError : the entry is damaged

    """
    from antenna_drive.diagnosis import Findings
    try:
        return Findings.of_data(planning)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UserError(f'{path}: planning: {error!r}: damaged; diagnose the recordings '
                        'again') from error
