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
"""The tables of this program: YAML files of this folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml


def read_table(name: str) -> dict[str, Any]:
    """Return the content of a YAML file of this folder, or of one below it."""
    text = (Path(__file__).parent / name).read_text(encoding='utf-8')
    # libyaml, where it is there, is several times as fast
    loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
    content: dict[str, Any] = yaml.load(text, Loader=loader)
    return content
