# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the package uses of rclpy is what docs/distributions.md says, and it is there."""

from __future__ import annotations

import ast
from collections.abc import Iterator
import importlib
import importlib.util
import inspect
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs' / 'distributions.md').read_text()
IMPORTS = set(re.findall(r'^\| `(rclpy\.[\w.]+)` \|', PAGE, re.M))
METHODS = {name: set(re.findall(r'`(\w+)`', keywords))
           for name, keywords in re.findall(r'^\| `(\w+)` \| (.*?)\| ', PAGE, re.M)}
# not in every distribution: asked for with hasattr
OPTIONAL = {'add_pre_set_parameters_callback'}
ros_installed = pytest.mark.skipif(importlib.util.find_spec('rclpy') is None,
                                   reason='rclpy is not installed')


def nodes_of(kind: type[ast.AST]) -> Iterator[ast.AST]:
    for path in (ROOT / 'antenna_drive').rglob('*.py'):
        yield from (node for node in ast.walk(ast.parse(path.read_text()))
                    if isinstance(node, kind))


def test_imports_are_those_of_the_page() -> None:
    used = {f'{node.module}.{name.name}' for node in nodes_of(ast.ImportFrom)
            if isinstance(node, ast.ImportFrom) and (node.module or '').startswith('rclpy')
            for name in node.names}
    assert used == IMPORTS


@ros_installed
def test_methods_are_those_of_the_page() -> None:
    """Whatever rclpy's node has, and is asked of something called node, is one of these."""
    from rclpy.node import Node
    used: dict[str, set[str]] = {}
    for call in nodes_of(ast.Call):
        assert isinstance(call, ast.Call)
        method = call.func
        if isinstance(method, ast.Attribute) and ast.unparse(method.value).split('.')[-1] in (
                'node', '_node'):
            used.setdefault(method.attr, set()).update(
                keyword.arg for keyword in call.keywords if keyword.arg)
    assert {name: words for name, words in used.items()
            if name in OPTIONAL or hasattr(Node, name)} == METHODS


@ros_installed
@pytest.mark.parametrize('name', sorted(IMPORTS))
def test_import_is_there(name: str) -> None:
    module, _, item = name.rpartition('.')
    assert hasattr(importlib.import_module(module), item)


@ros_installed
@pytest.mark.parametrize('method', sorted(METHODS))
def test_method_is_there(method: str) -> None:
    from rclpy.node import Node
    if method in OPTIONAL and not hasattr(Node, method):
        pytest.skip('not in this distribution')
    assert METHODS[method] <= set(inspect.signature(getattr(Node, method)).parameters)


@ros_installed
def test_acknowledgements_can_be_waited_for() -> None:
    from rclpy.publisher import Publisher
    assert '`Publisher.wait_for_all_acked`' in PAGE
    assert 'timeout' in inspect.signature(Publisher.wait_for_all_acked).parameters


@ros_installed
@pytest.mark.usefixtures('fresh_domain')
def test_a_node_ends_where_the_middleware_has_no_acknowledgements(
        monkeypatch: pytest.MonkeyPatch) -> None:
    from antenna_drive.lockstep.leaving import leave
    from antenna_drive.lockstep.ros_link import FrameLink
    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.publisher import Publisher
    asked = []

    def unsupported(publisher: object, timeout: object) -> bool:
        asked.append(timeout)
        raise RuntimeError('unsupported')

    monkeypatch.setattr(Publisher, 'wait_for_all_acked', unsupported)
    context = Context()
    context.init(args=[])
    node = Node('leaver', context=context)
    try:
        FrameLink(node, {}).await_delivery(1.0)
    finally:
        leave(node)
    assert len(asked) == 1


@ros_installed
def test_what_is_not_public_is_there() -> None:
    from rclpy.impl.implementation_singleton import rclpy_implementation
    assert {'add_guard_condition', 'add_subscription', 'clear_entities', 'is_ready', 'wait'} <= {
        *dir(rclpy_implementation.WaitSet)}
    assert 'publish_raw' in dir(rclpy_implementation.Publisher)
    assert 'take_message' in dir(rclpy_implementation.Subscription)


@ros_installed
def test_parameters_given_at_the_start_can_be_read_undeclared() -> None:
    from rclpy.context import Context
    from rclpy.node import Node
    context = Context()
    context.init(args=[])
    node = Node('given', context=context, cli_args=['--ros-args', '-p', 'a:=[]', '-p', 'b:=1'])
    try:
        assert {name: parameter.value for name, parameter in node._parameter_overrides.items()
                } == {'a': None, 'b': 1}
    finally:
        node.destroy_node()
        context.try_shutdown()
