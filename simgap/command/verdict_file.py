# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Read what the JSON of a diagnosis says for whatever comes after it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, TYPE_CHECKING

from simgap.errors import UserError

if TYPE_CHECKING:
    from simgap.next_test.rivals import Findings


def planning_of(path: Path) -> dict[str, Any]:
    """Return a verdict's entry `planning`; UserError if it has none, OSError if unreadable."""
    try:
        return dict(json.loads(path.read_text(encoding='utf-8'))['planning'])
    except (ValueError, TypeError) as error:
        raise UserError(f'{path}: no JSON of a diagnosis: {error}') from error
    except KeyError as error:
        raise UserError(f'{path}: no entry {error.args[0]}: a verdict of an earlier version; '
                        'diagnose the recordings again') from error


def findings_of(path: Path, planning: dict[str, Any]) -> Findings:
    """Return what the tests of a verdict have told; UserError if its `planning` is damaged."""
    from simgap.next_test.rivals import Findings
    try:
        return Findings.of_data(planning)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UserError(f'{path}: planning: {error!r}: damaged; diagnose the recordings '
                        'again') from error
