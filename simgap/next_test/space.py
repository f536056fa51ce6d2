# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The tests that a machine may run: what they may be is the machine's to say."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from simgap.machine.contract import FloatArray, Machine, Point


class TestSpace(ABC):
    """The tests that a machine may run: names of their families, and limits by name."""

    __test__ = False  # not a test case, whatever pytest makes of the name

    families: Sequence[str]
    limits: Mapping[str, float] = MappingProxyType({})

    @abstractmethod
    def draw(self, family: str, random: np.random.Generator) -> Any:
        """Return a test of a family, drawn at random."""

    @abstractmethod
    def machine(self, test: Any) -> Machine:
        """Return the machine in this test alone; what it measured does not count."""

    @abstractmethod
    def use(self, machine: Machine, points: Sequence[Point]) -> Mapping[str, float]:
        """Return the share of each limit that a test uses at the worst of the points."""

    def command(self, test: Any) -> tuple[FloatArray, FloatArray, str] | None:
        """Return times [s] and values of the command of a test, shape (n,), and their unit."""
        return None

    def as_data(self, test: Any) -> Any:
        """Return a test as plain data, for the JSON."""
        return repr(test)

    def files(self, test: Any, path: Path) -> Mapping[Path, str]:
        """Return the texts of the files from which a test is run, the first one at `path`."""
        return {path: f'{self.as_data(test)}\n'}

    def unread(self, machine: Machine, one: Point, other: Point) -> Mapping[str, float]:
        """Return the rms difference of two variants, over the signal's, by unread signal."""
        return {}
