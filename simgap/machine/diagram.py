# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a machine as blocks and lines, on which a verdict marks the suspected parts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

# The default layout: number of blocks in a row, their width and the gap between them.
_IN_A_ROW, _WIDTH, _GAP = 4, 170, 20


@dataclass(frozen=True)
class DiagramBlock:
    """A part of the machine."""

    component: str  # as the effects of the catalogue name it
    label: str  # for people
    x: float  # of its upper left corner
    y: float
    width: float  # of the block


@dataclass(frozen=True)
class Diagram:
    """Blocks and the lines between them."""

    height: ClassVar[int] = 26  # of a block
    blocks: tuple[DiagramBlock, ...]  # in the order in which they are drawn
    lines: tuple[tuple[float, float, float, float], ...] = ()  # x and y of their two ends
    # components that are several blocks, with the components of those
    several: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, components: Iterable[str]) -> Diagram:
        """Return the diagram of a machine that gives none: a block for each component, in rows."""
        return cls(tuple(
            DiagramBlock(component, component.replace('_', ' '),
                         _GAP + i % _IN_A_ROW * (_WIDTH + _GAP),
                         _GAP + i // _IN_A_ROW * (cls.height + _GAP), _WIDTH)
            for i, component in enumerate(dict.fromkeys(components))))

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Return x, y, width and height of what holds all blocks, with a margin."""
        left, top = (min(b.x for b in self.blocks) - 2, min(b.y for b in self.blocks) - 2)
        return (left, top, max(b.x + b.width for b in self.blocks) + 2 - left,
                max(b.y for b in self.blocks) + self.height + 2 - top)

    def shares(self, suspicion: Mapping[str, float]) -> dict[str, float]:
        """Return the share of each component that has a block, from those of all components."""
        found: dict[str, float] = {}
        for component, share in suspicion.items():
            for one in self.several.get(component, (component,)):
                found[one] = found.get(one, 0.0) + share
        return found
