# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of this program: YAML files beside the modules that read them."""

from pathlib import Path
from typing import Any

import yaml


def read_table(name: str, folder: Path = Path(__file__).parent) -> dict[str, Any]:
    """Return the content of a YAML file, of the antenna's unless a folder is given."""
    text = (folder / name).read_text(encoding='utf-8')
    # libyaml, where it is there, is several times as fast
    loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
    content: dict[str, Any] = yaml.load(text, Loader=loader)
    return content
