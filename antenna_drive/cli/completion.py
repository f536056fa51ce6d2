# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Print the completion of this command for a shell: TAB then completes commands, options and files.

For example:
  mkdir -p ~/.local/share/bash-completion/completions ~/.zfunc
  antenna-drive completion bash > ~/.local/share/bash-completion/completions/antenna-drive
  antenna-drive completion zsh > ~/.zfunc/_antenna-drive     # with ~/.zfunc in fpath
"""

import argparse

from simgap.command.programs import OK

SHELLS = ('bash', 'zsh', 'tcsh')
# What is completed with the names of files or folders, by what the help calls it.
FILES = ('FILE', 'CSV', 'VERDICT', 'RECORDING', 'BAG', 'LOG', 'TARGETS', 'TEST', 'CONFIG')
FOLDERS = ('DIR', 'FOLDER', 'OUT', 'TRIAL')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('shell', choices=SHELLS, help='bash, zsh or tcsh')


def run(arguments: argparse.Namespace) -> int:
    """Print the script; shtab writes it from the parsers of all commands."""
    import shtab

    from antenna_drive.cli import COMMANDS, make_parser
    parser = make_parser(*COMMANDS)
    for action in _actions(parser):
        names = {action.metavar} if isinstance(action.metavar, str) else set()
        if names & {*FILES}:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        elif names & {*FOLDERS}:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
    print(shtab.complete(parser, arguments.shell))
    return OK


def _actions(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    found = list(parser._actions)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for sub in action.choices.values():
                found += _actions(sub)
    return found
