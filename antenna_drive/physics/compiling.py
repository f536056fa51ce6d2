# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The physics is compiled once for this machine, and again when one of its sources changes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simgap.laws import compiling
from simgap.laws.compiling import Keeping

PHYSICS = Path(__file__).resolve().parent
KEEPING = Keeping('antenna_drive', frozenset({PHYSICS}))
compiled = KEEPING.compiled


def generated(name: str, text: str, names: Mapping[str, Any], sources: frozenset[Path]) -> Any:
    """Compile functions that a program has written with the physics; see `compiling.generated`."""
    return compiling.generated(Keeping(KEEPING.owner, KEEPING.sources | sources), name, text,
                               names)
