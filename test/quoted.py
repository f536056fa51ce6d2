# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Commands and output as the pages quote them, and whether a command is one that there is."""

from __future__ import annotations

from collections.abc import Iterator
import os
from pathlib import Path
import re
import shlex

from antenna_drive import cli as drive
from antenna_drive.emulator.units import build
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.parameters import load
from installations import NODES, ROOT
from lab import cli as laboratory
import pytest
from simgap import cli as engine

PROGRAMS = {item.PROGRAM.name: item.PROGRAM for item in (drive, engine, laboratory)}
_BLOCK = re.compile(r'^```\n(.*?)^```$', re.M | re.S)
_QUOTED = (*PROGRAMS, 'ros2', 'make', 'pip', 'python')
_EXTRAS = re.compile(r"'(\.|\./simgap)\[(.*)\]'")
_NUMBER = re.compile(r'-?\d[\d.]*(?:e[-+]\d+)?')


def blocks_of(page: Path) -> list[str]:
    """Return the blocks of a page that are in no language: commands, output and drawings."""
    return [found[1] for found in _BLOCK.finditer(page.read_text(encoding='utf-8'))]


def commands_of(page: Path) -> Iterator[tuple[Path, str]]:
    """Yield each command in the blocks of a page, and the folder in which it is typed."""
    for block in blocks_of(page):
        folder = ROOT
        for line in block.replace('\\\n', ' ').splitlines():
            command = line.removeprefix('$ ').strip()
            if command.startswith('cd '):
                folder = ROOT / command.split()[1]
            elif command.split(' ')[0] in _QUOTED:
                yield folder, command


def understood(command: str, folder: Path = ROOT) -> None:
    """Fail unless program, command and options are there, and the options have what they take."""
    for part in command.split('&&'):
        words = shlex.split(part.partition('>')[0], comments=True)
        match words:
            case ['ros2', 'run', 'antenna_drive', node, *_]:
                assert node in NODES, command
            case ['ros2', 'run', package, node, *_]:
                setup = ROOT / 'examples' / package / 'setup.py'
                assert re.search(rf"'{node} *=", setup.read_text()), command
            case ['ros2', 'param', 'set' | 'get' | 'describe', node, name, *_]:
                if not list((ROOT / 'examples').rglob(f'*{node.strip("/")}*')):
                    _check_parameter(node.strip('/'), name)
            case ['ros2', 'topic' | 'service', *_]:
                pass  # typed by a test in test/ros2cli
            case ['make', target, *_]:
                assert re.search(rf'^{target}:', (ROOT / 'Makefile').read_text(), re.M), command
            case ['pip', 'install', *_]:
                _check_extras(part)
            case ['python', script, *_]:
                assert (folder / script).is_file(), command
            case [program, *_]:
                name = next((word for word in words[1:] if not word.startswith('-')), '')
                if name:
                    assert PROGRAMS[program].parser(name).parse_args(words[1:])
        assert [word for word in words if re.match(r'(examples|config|test|lab)/', word)
                and not (ROOT / word.partition(':')[0]).exists()] == [], command


def options_known(command: str) -> bool:
    """Return whether a command in a sentence, which may lack arguments, and its options exist."""
    program, *words = command.split()
    name = next((word for word in words if not word.startswith('-')), '')
    known = PROGRAMS[program]
    if name not in ('', *known.commands):
        return False
    text = known.parser(name)._subparsers._group_actions[0].choices.get(  # type: ignore
        name, known.parser()).format_help()
    return all(word.strip('.,') in re.findall(r'--[a-z][a-z-]*|-\w\b', text)
               for word in words if word.startswith('-'))


def _check_parameter(unit: str, name: str) -> None:
    own = pytest.importorskip('antenna_drive.lockstep.node_parameters').OWN_PARAMETERS
    assert unit in UNITS
    assert name in (*build(unit, load()).settings(), *own), f'{unit} {name}'


def _check_extras(command: str) -> None:
    for place, extras in _EXTRAS.findall(command):
        text = (ROOT / 'setup.py' if place == '.' else ROOT / place / 'pyproject.toml').read_text()
        for extra in extras.split(','):
            assert re.search(rf"^ *'?{extra}'?( =|:) \[", text, re.M), f'{place}: {extra}'


def shown_in(quoted: str, said: str, apart: float) -> list[str]:
    """
    Return which lines of an output, as a page quotes it, a program has not said.

    A page wraps lines and leaves parts out, with '...' in their place. Numbers may be apart by
    this share of the quoted one: the last digits are those of one machine.
    """
    words = _words(said)
    missing = []
    for part in re.split(r'\.\.\.', quoted):
        wanted = _words(part)
        if not any(_alike(wanted, words[at:at + len(wanted)], apart)
                   for at in range(len(words) - len(wanted) + 1)):
            missing.append(part.strip())
    return missing


def _words(text: str) -> list[str]:
    return [word for part in text.split() for word in re.split(rf'({_NUMBER.pattern})', part)
            if word]


def _alike(wanted: list[str], found: list[str], apart: float) -> bool:
    for one, other in zip(wanted, found, strict=True):
        if one != other and not (
                _NUMBER.fullmatch(one) and _NUMBER.fullmatch(other)
                and abs(float(one.rstrip('.')) - float(other.rstrip('.')))
                <= apart * abs(float(one.rstrip('.')))):
            return False
    return True


def environment() -> dict[str, str]:
    """Return that of a process that finds this source tree and its tests."""
    return {**os.environ, 'PYTHONPATH': os.pathsep.join(
        filter(None, (str(ROOT), str(ROOT / 'test'), os.environ.get('PYTHONPATH'))))}
