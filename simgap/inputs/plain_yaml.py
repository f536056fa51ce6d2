# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
YAML files that people write: read as plain data, and refused where YAML would guess.

PyYAML keeps the last of two equal keys, and an alias can make a small file a huge one; both are
refused here, as are files that are no text or too long to be meant. It also takes 8.74e6 and 1e3
for texts, as YAML 1.1 does; here they are numbers, as in YAML 1.2 and in Python.
"""

from functools import cache
from pathlib import Path
import re
from typing import Any

from simgap.errors import one_line
from simgap.inputs.schema import ParameterError

LONGEST_FILE = 1_000_000  # bytes; a test sheet has some hundred
IS_NUMBER = ('tag:yaml.org,2002:float', re.compile(
    r'[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$', re.ASCII), list('-+.0123456789'))


@cache
def _loader() -> Any:
    """Return a safe loader that refuses aliases and repeated keys."""
    import yaml  # who reads no YAML needs no PyYAML

    class Loader(yaml.SafeLoader):
        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.events.AliasEvent):
                event = self.peek_event()  # type: ignore[no-untyped-call]
                raise yaml.constructor.ConstructorError(
                    None, None, 'an alias is not allowed', event.start_mark)
            return super().compose_node(parent, index)

        def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
            seen: set[str] = set()
            for key, _ in node.value:
                if not isinstance(key, yaml.ScalarNode):
                    raise yaml.constructor.ConstructorError(
                        None, None, 'a key must be a word', key.start_mark)
                if key.value in seen:
                    raise yaml.constructor.ConstructorError(
                        None, None, f'the key {one_line(key.value)} is given twice',
                        key.start_mark)
                seen.add(key.value)
            return super().construct_mapping(node, deep=deep)

    Loader.add_implicit_resolver(*IS_NUMBER)  # type: ignore[no-untyped-call]
    return Loader


def parse_yaml(text: str | bytes) -> Any:
    """Read YAML as plain data; ParameterError names the place, ModuleNotFoundError PyYAML."""
    import yaml
    try:
        if isinstance(text, bytes):
            text = text.decode()
        return yaml.load(text, Loader=_loader())
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f'line {mark.line + 1}, column {mark.column + 1}: ' if mark else ''
        problem = error.problem or error.context or 'no YAML'
        raise ParameterError(where + one_line(problem)) from None
    except yaml.YAMLError as error:
        raise ParameterError(f'no YAML, {one_line(error)}') from None
    except UnicodeDecodeError:
        raise ParameterError('the text is not UTF-8') from None
    except RecursionError:
        raise ParameterError('nested too deeply') from None
    except (ValueError, TypeError, ArithmeticError, LookupError) as error:
        # a date or number that looks right to the resolver and is not, such as 2026-13-45
        raise ParameterError(f'no YAML, {one_line(error)}') from None


def read_yaml(path: Path) -> Any:
    """Read a YAML file as plain data; ParameterError, with its name, if that is impossible."""
    try:
        with path.open('rb') as file:
            text = file.read(LONGEST_FILE + 1)
    except OSError as error:
        raise ParameterError(f'{path}: {error.strerror}') from None
    if len(text) > LONGEST_FILE:
        raise ParameterError(f'{path}: longer than {LONGEST_FILE} bytes')
    try:
        return parse_yaml(text)
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None
