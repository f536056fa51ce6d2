# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""How a parameter is declared in a set: its entry is kept with the field."""

from dataclasses import field
from typing import Any

from simgap.inputs.schema import Entry

# A choice is a text in a set; in the set's record it is the text's place among the choices.
Choice = Any


def given(unit: str, low: float, high: float, description: str, *, live: bool = False) -> Any:
    """Declare a number that a configuration must give."""
    return field(metadata={'entry': Entry(unit, low, high, description, live)})


def effect(neutral: float, unit: str, low: float, high: float, description: str) -> Any:
    """Declare the term of an unmodelled effect, with its neutral value."""
    return field(default=neutral, metadata={'entry': Entry(unit, low, high, description)})


def option(default: Any, entry: Entry) -> Any:
    return field(default=default, metadata={'entry': entry})
