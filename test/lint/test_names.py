# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What things are called."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize('house', ['simgap', 'antenna_drive', 'lab'])
def test_a_class_name_means_one_thing(house: str) -> None:
    """A reader who searches a house for a class finds one."""
    files = defaultdict(list)
    for source in sorted((ROOT / house).rglob('*.py')):
        for node in ast.walk(ast.parse(source.read_text(encoding='utf-8'))):
            if isinstance(node, ast.ClassDef):
                files[node.name].append(str(source.relative_to(ROOT)))
    assert len(files) > 50, 'no classes were found'
    assert {name: where for name, where in files.items() if len(where) > 1} == {}
