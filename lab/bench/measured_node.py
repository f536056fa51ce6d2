# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
One of the drive's nodes, unchanged except that it records the times of its steps.

python -m lab.bench.measured_node UNIT FILE LAST --ros-args ...
"""

from collections.abc import Iterator
from functools import partial
import importlib
import sys

from antenna_drive.emulator.wiring import DRIVE
from lab.bench.stamps import Stamps, WARM_STEPS


def main() -> int:
    """Run the node of UNIT and record its steps; return its exit code."""
    from antenna_drive.emulator.unit import FloatArray
    from antenna_drive.lockstep import node
    from antenna_drive.lockstep.exchange import Exchange

    unit, path, last, *arguments = sys.argv[1:]
    stamps = Stamps(path, int(last))

    class MeasuredNode(node.DriveNode):
        def _publish(self, outputs: FloatArray) -> None:
            step = self._member.step
            if step == 1 and self._pace is not None and self._pace.factor > 0.0:
                stamps.due_s = self._pace.due(0, self._member.step_s)
            stamps.note(step)
            super()._publish(outputs)

        def _pauses(self) -> Iterator[int]:
            yield from super()._pauses()
            yield from (WARM_STEPS, int(last))

        def _exchanged(self, exchange: Exchange) -> bool:
            before = self._member.step
            done = super()._exchanged(exchange)
            if self._member.step != before:
                stamps.note_all(exchange.stamps, before + 1, self._member.step)
            return done

    node.DriveNode = MeasuredNode  # type: ignore[misc]
    node.Exchange = partial(  # type: ignore[misc,assignment,attr-defined]
        Exchange, stamps=int(last) + 1)
    return int(importlib.import_module(DRIVE.units[unit].node).main(arguments))


if __name__ == '__main__':
    sys.exit(main())
