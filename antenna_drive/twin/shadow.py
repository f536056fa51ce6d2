# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The emulator in step with a real drive: driven by the command that was measured.

The command is laid onto macro-steps as in a replay (`recording.replay.command_table`): a straight
line between samples, and at a jump as before up to the sample after it. Whether a slope is a jump
is judged by the slopes around it. The shadow therefore stays a few samples behind the newest one.
"""

from antenna_drive.diagnosis.sheet_settings import as_the_sheet_says
from antenna_drive.emulator import units, wiring
from antenna_drive.emulator.run import Changes, Emulator, MACRO_STEP
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters.sets import changed, Drive
from antenna_drive.physics.arrays import IntArray
from antenna_drive.recording.replay import command_table, LaidCommand
from antenna_drive.recording.sheet import TestSheet
import numpy as np
from simgap.logs.channel import Channel, NANOSECONDS, nanoseconds

# So many samples of the command after a moment decide what it did there.
AHEAD = 5
# So many samples before it do, too.
_BEHIND = 40


class Shadow:
    """
    The emulator of a drive, advanced as far as the measured command is known.

    drive : the configuration
    changes : of the drive's parameters, by the macro-step at which each takes effect
    step_s : macro-step [s]
    """

    def __init__(self, drive: Drive, changes: Changes | None = None,
                 step_s: float = MACRO_STEP) -> None:
        """Build the drive; it begins with the first command."""
        self._command = LaidCommand()
        others = {name: units.build(name, drive) for name in wiring.UNITS
                  if name != wiring.TEST_SIGNAL}
        self._emulator = Emulator(drive, step_s, {**others, wiring.TEST_SIGNAL: self._command})
        self._changes = dict(changes or {})
        self._step_s = step_s
        self._stamps = np.zeros(0, np.int64)
        self._values = np.zeros(0)
        # the time stamp at which the drive began [ns]; None before the first command
        self.start_ns: int | None = None
        self.names = self._emulator.names

    def restart(self) -> None:
        """Forget the command; the drive begins at rest with the next one."""
        self.start_ns = None
        self._stamps, self._values = np.zeros(0, np.int64), np.zeros(0)

    @property
    def spacing_s(self) -> float:
        """Return the time between the last samples of the command, 0 before there are two [s]."""
        return float(np.median(np.diff(self._stamps))) / NANOSECONDS if (
            self._stamps.size > 1) else 0.0

    def advance(self, stamps: IntArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
        """
        Take samples of the command and go on as far as they lead.

        stamps : ascending, later than those before [ns]
        values : axis rate command [rad/s]

        Returns the time stamps of the macro-steps that were made, shape (n,) [ns], and the value
        and derivative of every signal at them, shape (n, len(names), 2).
        """
        self._stamps = np.append(self._stamps, stamps)
        self._values = np.append(self._values, values)
        nothing = np.zeros(0, np.int64), np.zeros((0, len(self.names), 2))
        if self._stamps.size <= AHEAD:
            return nothing
        if self.start_ns is None:
            self.start_ns = int(self._stamps[0])
            self._lay(np.array([[self._values[0], 0.0]]), 0)
            self._emulator.restart()
        done = self._emulator.k
        end = int((self._stamps[-AHEAD] - self.start_ns) / NANOSECONDS / self._step_s)
        if end <= done:
            return nothing
        channel = Channel('rad/s', self._stamps, self._values)
        grid = self.start_ns + nanoseconds(np.arange(done + 1, end + 1) * self._step_s)
        self._lay(command_table(channel, grid), done + 1)
        kept = [self._advance_to(stop) for stop in sorted(
            {*(k for k in self._changes if done < k < end), end})]
        before = max(0, int(np.searchsorted(self._stamps, grid[-1])) - _BEHIND)
        self._stamps, self._values = self._stamps[before:], self._values[before:]
        return grid, np.concatenate(kept)

    def _lay(self, command: FloatArray, first: int) -> None:
        """Lay a rate command, shape (n, 2), onto the steps from `first` on; there is no torque."""
        table = np.zeros((len(command), len(self._command.outputs), 2))
        table[:, 0] = command
        self._command.lay(table, first)

    def _advance_to(self, stop: int) -> FloatArray:
        if self._emulator.k in self._changes:
            self._emulator.tune(self._changes[self._emulator.k])
        return self._emulator.advance(stop - self._emulator.k)[1]


def under_test(sheet: TestSheet, drive: Drive, step_s: float) -> tuple[Drive, Changes]:
    """
    Return a drive as a test sheet sets it, and what changes while it runs.

    sheet : of the test
    drive : the configuration
    step_s : macro-step [s]
    """
    drive, bias = as_the_sheet_says(sheet, drive)
    voltage = 'torque_share.circuit.fixed_voltage'
    if drive.torque_share.circuit.bias_source != 'fixed':
        return drive, {}
    changes: Changes = {} if bias.before == bias.after else {
        round(bias.at / step_s): {'torque_share': {'fixed_voltage': bias.after}}}
    return changed(drive, {voltage: bias.before}), changes
