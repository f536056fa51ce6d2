# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Plain data written as YAML that is read back as it was."""

from typing import Any

from simgap.inputs.plain_yaml import IS_NUMBER
import yaml


class _Dumper(yaml.SafeDumper):
    """Quotes a text that would be read as a number."""


_Dumper.add_implicit_resolver(*IS_NUMBER)  # type: ignore[no-untyped-call]


def dump_yaml(tree: object, **options: Any) -> str:
    """Write plain data, in the order given, so that `parse_yaml` reads the same."""
    return yaml.dump(tree, Dumper=_Dumper, sort_keys=False, **options)


def yaml_float(value: float) -> str:
    """Return a number as YAML 1.1 reads it, which wants a point in front of an exponent."""
    text = repr(value)
    return text if 'e' not in text or '.' in text else text.replace('e', '.0e')
