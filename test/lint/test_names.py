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
"""What things are called."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / 'antenna_drive'


def test_a_class_name_means_one_thing() -> None:
    """A reader who searches for a class finds one."""
    files = defaultdict(list)
    for source in sorted(PACKAGE.rglob('*.py')):
        for node in ast.walk(ast.parse(source.read_text(encoding='utf-8'))):
            if isinstance(node, ast.ClassDef):
                files[node.name].append(str(source.relative_to(PACKAGE)))
    assert len(files) > 100, 'no classes were found'
    assert {name: where for name, where in files.items() if len(where) > 1} == {}
