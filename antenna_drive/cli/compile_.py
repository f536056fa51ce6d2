# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Compile the physics for this machine ahead of the first run.

The compiled physics is kept on disk (in NUMBA_CACHE_DIR, XDG_CACHE_HOME or ~/.cache) until its
sources change. Without this command the first run, and each node at its first start, compiles
what it needs, which takes some seconds.
"""

import argparse

from simgap.command.output import Progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command: there are none."""


def run(args: argparse.Namespace) -> int:
    """Step every unit once, alone and in the compiled loop; compile the exchange of its node."""
    from antenna_drive.emulator.run import Emulator
    from antenna_drive.emulator.wiring import UNITS
    from antenna_drive.lockstep.exchange import compile_ahead
    from antenna_drive.parameters import load
    import numpy as np

    with Progress('compiling', len(UNITS) + 1) as progress:
        emulator = Emulator(load())
        for number, unit in enumerate(emulator.units.values()):
            unit.step(0, np.zeros((len(unit.inputs), 2)))
            compile_ahead(unit)
            progress.update(number + 1)
        emulator.restart()
        emulator.advance(1)
    return 0
