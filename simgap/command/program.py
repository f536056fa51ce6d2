# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A program with subcommands: its parser, its errors in one line, and its exit codes."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import difflib
import importlib
import sys
from typing import Any, NamedTuple
import warnings

from simgap.command.interruption import interruptible
from simgap.command.programs import answered, expect_overflow, INTERRUPTED, say
from simgap.errors import UserError

EXIT_CODES = """\
exit codes:
  0    done, and the answer, where there is one, is yes
  1    done, and the answer is no (a comparison failed, a check found a difference)
  2    wrong input: one line says which file, which entry, and what is allowed
  3    something is not installed: one line says what and how to get it
  130  interrupted
"""


class Command(NamedTuple):
    module: str  # that does it, of the program's package if it has no dot
    summary: str


@dataclass(frozen=True)
class Program:
    name: str  # as it is typed
    package: str  # whose modules are the subcommands; its docstring is the description
    version: str  # printed by --version
    commands: Mapping[str, Command]  # by name
    moved: Mapping[str, str] = field(default_factory=dict)  # what to type for a former command

    def main(self, argv: Sequence[str] | None = None) -> int:
        """Run the program; return one of the exit codes that `--help` lists."""
        arguments = list(sys.argv[1:] if argv is None else argv)
        # No option before the command takes a value, so the first plain word is the command.
        name = next((word for word in arguments if not word.startswith('-')), '')
        called = f'{self.name} {name}'.rstrip()
        try:
            with (interruptible(lambda: say(called, 'interrupted', INTERRUPTED)),
                  warnings.catch_warnings()):
                expect_overflow()
                return answered(called, lambda: self._run(name, arguments))
        except KeyboardInterrupt:
            return say(called, 'interrupted', INTERRUPTED)

    def _run(self, name: str, arguments: list[str]) -> int:
        if name and name not in self.commands:
            close = difflib.get_close_matches(name, [*self.commands, *self.moved], n=1)
            guess = (f'did you mean {self.moved.get(close[0], close[0])}?' if close else
                     f'{self.name} --help lists them')
            raise UserError(f'no such command, {guess}')
        parsed = self.parser(name).parse_args(arguments)
        # parse_args has left by now unless there was a command
        return int(self._module(name).run(parsed))

    def parser(self, *names: str) -> argparse.ArgumentParser:
        """
        Return the parser of the command line.

        Only the commands in `names` know their arguments, because only these are imported:
        compiled code takes a while to load.
        """
        parser = argparse.ArgumentParser(
            prog=self.name, description=sys.modules[self.package].__doc__, epilog=EXIT_CODES,
            formatter_class=argparse.RawDescriptionHelpFormatter)
        parser.add_argument('--version', action='version', version=f'{self.name} {self.version}')
        subparsers = parser.add_subparsers(metavar='COMMAND', required=True)
        for command_name, command in self.commands.items():
            if command_name not in names:
                subparsers.add_parser(command_name, help=command.summary)
                continue
            module = self._module(command_name)
            module.add_arguments(subparsers.add_parser(
                command_name, help=command.summary, description=module.__doc__,
                formatter_class=argparse.RawDescriptionHelpFormatter))
        return parser

    def _module(self, name: str) -> Any:
        module = self.commands[name].module
        return importlib.import_module(module if '.' in module else f'{self.package}.{module}')
