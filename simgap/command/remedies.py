# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a plain installation may lack, and how to get it."""

from __future__ import annotations

# By module. A package that needs more adds to it when it is imported.
REMEDIES = {
    'yaml': 'pip install PyYAML',
    'jinja2': 'pip install Jinja2',
    'mujoco': 'pip install mujoco',
    'fmpy': 'pip install fmpy',
}


def remedy(error: ModuleNotFoundError) -> str | None:
    """Return in one line what is missing and how to get it; None if the program is at fault."""
    missing = (error.name or '').partition('.')[0]
    return f'needs {missing}: {REMEDIES[missing]}' if missing in REMEDIES else None
