# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What several commands need to speak to people and to machines."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, ExitStack
import math
import os
from pathlib import Path
import sys
import time
from typing import IO
import warnings

from simgap.drafts import drafted
from simgap.errors import UserError
from simgap.inputs.plain import strict_json
from simgap.inputs.schema import Entry
from simgap.logs.channel import RecordingWarning
from simgap.logs.text import READ

STANDARD_OUTPUT = '-'


def add_json_option(parser: argparse.ArgumentParser) -> None:
    """Add `--json FILE|-`, to be answered with `give`."""
    parser.add_argument('--json', metavar='FILE',
                        help='write the result as JSON to FILE; - writes it to standard output, '
                             'and the text to standard error')


def give(result: object, target: str | None, text: str) -> None:
    """
    Print a result as text, and write it as JSON where `--json` asks for it.

    `target` is a file, '-' for standard output, or None for no JSON. The text goes to standard
    output unless the JSON does; then it goes to standard error.
    """
    if target:
        write_json(result, target)
    print(text, file=sys.stderr if target == STANDARD_OUTPUT else sys.stdout)


def check_options(arguments: argparse.Namespace, **allowed: Entry) -> None:
    """Check the options that are given; UserError if one is outside its range."""
    for name, entry in allowed.items():
        value = getattr(arguments, name)
        if value is not None:
            entry.check(f'--{name.replace("_", "-")}', value)


def write_json(result: object, target: str | os.PathLike[str]) -> None:
    """
    Write `result` as strict JSON to a file, whole or not at all, or to standard output, '-'.

    Raises UserError if the file cannot be written; ValueError, TypeError as `strict_json`.
    """
    text = strict_json(result)
    if str(target) == STANDARD_OUTPUT:
        sys.stdout.write(text)
        return
    with replaced(Path(target)) as stream:
        stream.write(text.encode(errors='backslashreplace'))


@contextmanager
def replaced(path: Path) -> Iterator[IO[bytes]]:
    """
    Give a stream whose content takes the place of `path` at the end, if all went well.

    A reader of `path` sees the old content or the new, never a part of it. Raises UserError, with
    the reason, if the file cannot be written there.
    """
    try:
        with drafted(path) as stream:
            yield stream
    except OSError as error:
        raise UserError(f'{path}: cannot be written, {error.strerror}') from error


class Progress:
    """
    One line on standard error that shows how far long work has got; none if `quiet` is asked for.

    Where standard error is no terminal, such as a log, it is a line of its own every half minute.
    """

    REFRESH_S = 0.1
    LINE_S = 30.0

    def __init__(self, label: str, total: float, *, quiet: bool = False) -> None:
        """Prepare to show how much of `total` is done; ValueError if that is not above zero."""
        if not total > 0:
            raise ValueError(f'total is {total}, must be more than zero')
        self._label, self._total, self._shown = label, total, not quiet
        self._on_terminal = sys.stderr.isatty()
        self._started = time.monotonic()
        self._refreshed = -math.inf if self._on_terminal else self._started

    def __enter__(self) -> Progress:
        self.update(0)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Leave the line complete, or as far as the work got."""
        if self._shown and self._on_terminal:
            if kind is None:
                self._draw(self._total)
            print(file=sys.stderr, flush=True)

    def update(self, done: float) -> None:
        """Show that `done` of the total is done; cheap enough to call at every turn."""
        now = time.monotonic()
        pause = self.REFRESH_S if self._on_terminal else self.LINE_S
        if self._shown and now - self._refreshed >= pause:
            self._refreshed = now
            self._draw(done)

    def _draw(self, done: float) -> None:
        part = min(1.0, max(0.0, done / self._total))
        bar = '#' * round(30 * part)
        spent = time.monotonic() - self._started
        line = f'{self._label}  [{bar:<30}] {100 * part:3.0f} %  {spent:.0f} s'
        print(f'\r{line}' if self._on_terminal else line, file=sys.stderr, flush=True,
              end='' if self._on_terminal else '\n')


@contextmanager
def reading() -> Iterator[None]:
    """While recordings are read, show how far a large one is, and warnings without their place."""
    with warnings.catch_warnings(record=True) as caught, ExitStack() as stack:
        warnings.simplefilter('always', RecordingWarning)
        line: list[Progress] = []

        def tell(share: float) -> None:
            line[:] = line or [stack.enter_context(Progress('reading', 1.0))]
            line[0].update(share)

        stack.callback(READ.reset, READ.set(tell))
        yield
    for warning in caught:
        if issubclass(warning.category, RecordingWarning):
            print(f'warning: {warning.message}', file=sys.stderr)
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename,
                                   warning.lineno)
