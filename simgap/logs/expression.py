# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
A number that a row of a file gives: a column, or a small expression over columns.

An expression is parsed with Python's own grammar, of which the parts listed here are allowed, and
is never evaluated as a program. Names are columns. `v[2]` is the third number of a column of
vectors, `column('T (ms)')` a column of that name, and `column(0)` the first column. Functions of
`whole_columns` need every row of the file before any row has a value.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
import math
import operator
from typing import Any

from simgap.errors import one_line
from simgap.inputs.schema import nearest, ParameterError
from simgap.logs.channel import FloatArray
from simgap.logs.whole_columns import WHOLE

LONGEST = 1000       # characters
MOST_COLUMNS = 10_000
_DEEPEST = 60        # nested parts
_COLUMN = 'column'

OPERATORS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Mod: operator.mod, ast.Pow: math.pow}
SIGNS: dict[type[ast.unaryop], Callable[[float], float]] = {
    ast.UAdd: operator.pos, ast.USub: operator.neg}
# Function and number of arguments; angles are in radians.
FUNCTIONS: dict[str, tuple[Callable[..., float], int]] = {
    'abs': (abs, 1), 'sqrt': (math.sqrt, 1), 'exp': (math.exp, 1), 'log': (math.log, 1),
    'sin': (math.sin, 1), 'cos': (math.cos, 1), 'tan': (math.tan, 1), 'asin': (math.asin, 1),
    'acos': (math.acos, 1), 'atan': (math.atan, 1), 'atan2': (math.atan2, 2),
    'tanh': (math.tanh, 1), 'hypot': (math.hypot, 2), 'floor': (lambda x: float(math.floor(x)), 1),
    'min': (min, 2), 'max': (max, 2),
    'sign': (lambda x: float((x > 0.0) - (x < 0.0)), 1)}
_CALLED: dict[str, tuple[Callable[..., Any], int]] = {**FUNCTIONS, **WHOLE}
CONSTANTS = {'pi': math.pi}

_Term = Callable[[Sequence[float]], float]
# What a function of a whole column takes, and the function, of times [s] and what it takes.
_Whole = tuple[_Term, Callable[[FloatArray, FloatArray], FloatArray]]


@dataclass(frozen=True)
class Reference:
    """A column, by name or by place from 0, and the index of a number in its vectors or None."""

    column: str | int
    index: int | None = None

    def __str__(self) -> str:
        column = self.column if isinstance(self.column, str) else f'number {self.column}'
        return column if self.index is None else f'{column}[{self.index}]'


@dataclass(frozen=True)
class Expression:
    """A number as a function of columns."""

    references: tuple[Reference, ...]  # the columns, each of them once
    # of those, in this order, then of the results of `whole`, the last of these first;
    # ArithmeticError or ValueError if none, as 1 / 0
    value: _Term
    whole: tuple[_Whole, ...] = ()  # each may take the results of those before it

    def bound(self, constants: Mapping[str, float]) -> Expression:
        """Return the expression with constants in the place of columns of their names."""
        left = tuple(column for column in self.references if str(column) not in constants)
        if not left or left == self.references:
            return self
        places = {column: k for k, column in enumerate(left)}

        def of_left(term: _Term) -> _Term:
            return lambda numbers: term([*(
                numbers[places[column]] if column in places else constants[str(column)]
                for column in self.references), *numbers[len(left):]])

        return Expression(left, of_left(self.value), tuple(
            (of_left(term), function) for term, function in self.whole))


def parse_expression(key: str, text: str) -> Expression:
    """Read an expression such as '0.1 * current'; ParameterError names the key."""
    if len(text) > LONGEST:
        raise ParameterError(f'{key}: {len(text)} characters given, allowed are {LONGEST}')
    try:
        tree = ast.parse(text.strip(), mode='eval').body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        said = error.msg if isinstance(error, SyntaxError) else error
        raise ParameterError(f'{key}: {one_line(repr(text), 60)} is no expression, '
                             f'{one_line(str(said) or "nested too deeply")}') from None
    parser = _Parser(key, text.strip())
    value = parser.term(tree, 0)
    return Expression(tuple(parser.places), value, tuple(parser.whole))


class _Parser:
    """Turns the parts of a syntax tree into functions, and collects the columns."""

    def __init__(self, key: str, text: str) -> None:
        self.places: dict[Reference, int] = {}
        self.whole: list[_Whole] = []
        self._key, self._text = key, text

    def term(self, node: ast.expr, depth: int) -> _Term:
        """Return a part of an expression as a function of the columns' numbers."""
        if depth > _DEEPEST:
            raise ParameterError(f'{self._key}: nested too deeply, allowed are {_DEEPEST} levels')
        if isinstance(node, ast.Constant):
            return self._constant(node)
        if isinstance(node, ast.Name) and node.id in CONSTANTS:
            constant = CONSTANTS[node.id]
            return lambda numbers: constant
        if isinstance(node, ast.UnaryOp) and type(node.op) in SIGNS:
            sign, operand = SIGNS[type(node.op)], self.term(node.operand, depth + 1)
            return lambda numbers: sign(operand(numbers))
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            combined = OPERATORS[type(node.op)]
            left, right = self.term(node.left, depth + 1), self.term(node.right, depth + 1)
            return lambda numbers: combined(left(numbers), right(numbers))
        if isinstance(node, ast.Call) and self._name(node.func) in _CALLED:
            return self._call(node, depth)
        place = self.places.setdefault(self._reference(node), len(self.places))
        return lambda numbers: numbers[place]

    def _constant(self, node: ast.Constant) -> _Term:
        given, value = node.value, math.nan
        with suppress(OverflowError):
            if isinstance(given, (int, float)) and not isinstance(given, bool):
                value = float(given)
        if not math.isfinite(value):
            raise self._refused(node)
        return lambda numbers: value

    def _call(self, node: ast.Call, depth: int) -> _Term:
        name = self._name(node.func)
        function, count = _CALLED[name]
        if len(node.args) != count or node.keywords:
            raise ParameterError(f'{self._key}: {name} takes {count} '
                                 f'{"number" if count == 1 else "numbers"}')
        if name in WHOLE:
            return self._whole(name, node.args, depth)
        terms = [self.term(argument, depth + 1) for argument in node.args]
        if count == 1:
            [only] = terms
            return lambda numbers: function(only(numbers))
        return lambda numbers: function(*[term(numbers) for term in terms])

    def _whole(self, name: str, arguments: list[ast.expr], depth: int) -> _Term:
        term = self.term(arguments[0], depth + 1)
        numbers = [self._constant(argument)([]) if isinstance(argument, ast.Constant) else 0.0
                   for argument in arguments[1:]]
        if any(number <= 0.0 for number in numbers):
            raise ParameterError(f'{self._key}: {name} takes a column and a number above 0')
        self.whole.append((term, lambda time, values: WHOLE[name][0](time, values, *numbers)))
        # counted from the end, because further columns may follow
        place = -len(self.whole)
        return lambda numbers: numbers[place]

    def _reference(self, node: ast.expr) -> Reference:
        if isinstance(node, ast.Subscript):
            index = node.slice.value if isinstance(node.slice, ast.Constant) else None
            inner = self._reference(node.value)
            if type(index) is not int or inner.index is not None:
                raise self._refused(node)
            return Reference(inner.column, index)
        if isinstance(node, ast.Name):
            return Reference(node.id)
        if (isinstance(node, ast.Call) and self._name(node.func) == _COLUMN
                and len(node.args) == 1 and not node.keywords):
            [argument] = node.args
            column = argument.value if isinstance(argument, ast.Constant) else None
            if type(column) is str or type(column) is int and 0 <= column < MOST_COLUMNS:
                return Reference(column)
        raise self._refused(node)

    @staticmethod
    def _name(node: ast.expr) -> str:
        return node.id if isinstance(node, ast.Name) else ''

    def _refused(self, node: ast.expr) -> ParameterError:
        called = self._name(node.func) if isinstance(node, ast.Call) else ''
        part = ast.get_source_segment(self._text, node) or self._text
        return ParameterError(
            f'{self._key}: {one_line(repr(part), 60)} is not allowed'
            f'{nearest(called, _CALLED) if called else ""}; allowed are columns, numbers, '
            f'+ - * / % **, {", ".join([*CONSTANTS, *_CALLED])}, v[0] and {_COLUMN}("name")')
