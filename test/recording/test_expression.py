# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""An expression gives what Python gives; nothing but numbers can be said in one."""

from __future__ import annotations

import math
import operator
from typing import Any

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from simgap.inputs.schema import ParameterError
from simgap.logs.expression import Expression, parse_expression, Reference

NAMES = ('a', 'b', 'c')
# The same functions by numpy, which shares no code with the parser's.
NUMPY = {'abs': np.abs, 'sqrt': np.sqrt, 'exp': np.exp, 'log': np.log, 'sin': np.sin,
         'cos': np.cos, 'tan': np.tan, 'asin': np.arcsin, 'acos': np.arccos, 'atan': np.arctan,
         'tanh': np.tanh, 'floor': np.floor, 'sign': np.sign}
NUMPY_OF_TWO = {'atan2': np.arctan2, 'hypot': np.hypot, 'min': np.minimum, 'max': np.maximum}
OPERATORS = {'+': operator.add, '-': operator.sub, '*': operator.mul, '/': operator.truediv,
             '%': np.mod, '**': np.power}
NUMBERS = st.floats(-1e3, 1e3, allow_subnormal=False)


def value_of(tree: Any, row: dict[str, float]) -> np.float64:
    """Return the number of a tree in numpy's arithmetic."""
    kind, *parts = tree
    if kind == 'number':
        return np.float64(parts[0])
    if kind == 'name':
        return np.float64(row[parts[0]])
    numbers = [value_of(part, row) for part in parts]
    if kind == 'negative':
        return -numbers[0]
    table: dict[str, Any] = {**NUMPY, **NUMPY_OF_TWO, **OPERATORS}
    return np.float64(table[kind](*numbers))


def text_of(tree: Any) -> str:
    """Return a tree as a person would write it, with all brackets."""
    kind, *parts = tree
    if kind in ('number', 'name'):
        return repr(parts[0]) if kind == 'number' else str(parts[0])
    texts = [text_of(part) for part in parts]
    if kind == 'negative':
        return f'(-{texts[0]})'
    if kind in OPERATORS:
        return f'({texts[0]} {kind} {texts[1]})'
    return f'{kind}({", ".join(texts)})'


TREES = st.recursive(
    st.tuples(st.just('number'), st.floats(0.0, 1e3, allow_subnormal=False))
    | st.tuples(st.just('name'), st.sampled_from(NAMES)),
    lambda inner: st.tuples(st.sampled_from([*NUMPY, 'negative']), inner)
    | st.tuples(st.sampled_from([*OPERATORS, *NUMPY_OF_TWO]), inner, inner), max_leaves=12)


def result(expression: Expression, row: dict[str, float]) -> float:
    try:
        return float(expression.value([row[str(r.column)] for r in expression.references]))
    except (ArithmeticError, ValueError):
        return math.nan


@settings(deadline=None, max_examples=300)
@given(TREES, st.tuples(NUMBERS, NUMBERS, NUMBERS))
def test_an_expression_has_the_value_that_numpy_gives(tree: Any,
                                                      numbers: tuple[float, ...]) -> None:
    row = dict(zip(NAMES, numbers, strict=True))
    text = text_of(tree)
    with np.errstate(all='ignore'):
        expected = value_of(tree, row)
    found = result(parse_expression('k', text), row) if len(text) <= 1000 else math.nan
    if math.isfinite(found) and np.isfinite(expected):
        # a floor or a remainder may fall on the other side of a rounding
        if not {'floor', '%', 'sign', 'tan'} & set(text.replace('(', ' ').split()):
            assert found == pytest.approx(float(expected), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(('text', 'value'), [
    ('1 + 2 * 3 - 4', 3.0), ('2 ** 3 ** 2', 512.0), ('-2 ** 2', -4.0), ('-7 % 3', 2.0),
    ('8 / 4 / 2', 1.0), ('a - b - c', -4.0), ('sign(-a) * hypot(3, 4)', -5.0),
    ('min(a, b) + max(b, c)', 4.0), ('atan2(a, 0) / pi', 0.5), ('floor(-1.5)', -2.0)])
def test_precedence_is_that_of_arithmetic(text: str, value: float) -> None:
    row = {'a': 1.0, 'b': 2.0, 'c': 3.0}
    assert result(parse_expression('k', text), row) == pytest.approx(value)


def test_columns_are_named_by_word_by_text_by_place_and_by_index() -> None:
    found = parse_expression('k', 'v[2] + column("T (ms)") + column(0) * v[2] + column(3)[1]')
    assert found.references == (Reference('v', 2), Reference('T (ms)'), Reference(0),
                                Reference(3, 1))
    assert found.value([2.0, 10.0, 3.0, 1.0]) == 19.0


@pytest.mark.parametrize('text', [
    '__import__("os")', 'a.__class__', '(lambda: 1)()', '[x for x in a]', 'a if b else c',
    'a.real', 'a < b', 'a and b', '"x" * 9', 'f"{a}"', 'a // b', 'a @ b', 'a << 2', 'not a', '~a',
    'True', 'None', '1j', 'open(a)', 'eval("1")', 'abs(*a)', 'abs(a, key=b)', 'a[b]', 'a[-1]',
    'a[0][1]',
    'column(a)', 'column(-1)', '(a := 1)', '{a: 1}', 'a, b', '', '   ', 'a b', '1e999',
    '9' * 400, '(' * 300 + 'a' + ')' * 300, '-' * 900 + 'a', 'a' * 1001, 'abs()', 'hypot(a)',
    'x\nimport os', '\x00', 'a[0:1]', 'column("x", 1)', '1_0 if a else 2'])
def test_what_is_no_arithmetic_of_columns_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ParameterError, match=r'^k: ') as refusal:
        parse_expression('k', text)
    assert '\n' not in str(refusal.value)


@pytest.mark.parametrize('text', ['a / (b - 2)', 'sqrt(-a)', 'exp(1e5 * a)', '(-a) ** 0.5'])
def test_no_number_is_told(text: str) -> None:
    found = parse_expression('k', text)
    with pytest.raises((ArithmeticError, ValueError)):
        found.value([{'a': 1.0, 'b': 2.0}[str(r.column)] for r in found.references])
