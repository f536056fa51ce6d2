# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says in its log as it starts: that it is ready, whom it waits for, its namesake."""

from collections.abc import Callable, Sequence

from antenna_drive.lockstep.namesakes import namesake
from antenna_drive.lockstep.report import PATIENCE_S
from rclpy.node import Node


def say_ready(node: Node, waits_for: str) -> None:
    """Say once that the node can take part, whom it waits for, and whether its name is taken."""
    log = node.get_logger()
    log.info(f'ready; waits for {waits_for}')
    if said := namesake(node):
        log.warning(said)


class Absence:
    """Says in the log of a node that only reads whose frames it waits for, when that changes."""

    def __init__(self, node: Node, publishers: Callable[[], dict[str, int]]) -> None:
        """Say that the node is ready; `publishers` counts those of each unit's frames."""
        self._log = node.get_logger()
        self._publishers = publishers
        self._absent = self._told = self._missing()
        self._since_s = 0.0
        say_ready(node, f'the frames of {", ".join(self._absent) or "the drive"}')

    def _missing(self) -> Sequence[str]:
        return [unit for unit, count in self._publishers().items() if not count]

    def look(self, now: float) -> None:
        """Look at `now` [s] who is there."""
        absent = self._missing()
        if absent != self._absent:
            self._absent, self._since_s = absent, now
        if absent != self._told and now - self._since_s >= PATIENCE_S:
            self._told = absent
            self._log.info(f'waiting for the frames of {", ".join(absent)}' if absent
                           else 'the frames of every unit come')
