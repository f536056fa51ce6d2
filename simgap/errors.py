# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Errors that the user can correct, each one line long."""

_CUT = ' ... '


class UserError(Exception):
    """
    Something is missing or wrong: a file, a name, a value, an installation.

    The message is one line that names the thing and the remedy. The simgap command
    prints it without a traceback. Every error that the user can correct is one of these; a
    fault of the program is not.
    """

    # The exit code of a program that ends with it: wrong input.
    status = 2

    # A file may give a megabyte where a number should be. Paths have at most 4096 characters.
    LONGEST = 6000

    def __init__(self, message: str) -> None:
        """Keep the message in one printable line of bounded length, whatever it may quote."""
        line = _printable(message)
        if len(line) > self.LONGEST:
            half = (self.LONGEST - len(_CUT)) // 2
            line = f'{line[:half]}{_CUT}{line[-half:]}'
        super().__init__(line)


def one_line(text: object, longest: int = 120) -> str:
    """Return a text that fits into an error of one line, whatever a file held."""
    line = _printable(str(text)[:10 * longest])
    return line if len(line) <= longest else line[:longest - 3] + '...'


def _printable(text: str) -> str:
    """Return a text with single spaces in the place of whatever does not print."""
    return ' '.join(''.join(c if c.isprintable() else ' ' for c in text).split())
