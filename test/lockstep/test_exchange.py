# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where the compiled exchange is used, and where it is not."""

from __future__ import annotations

from collections.abc import Sequence
import ctypes
import struct
import time

from antenna_drive.emulator.unit import Signal
from antenna_drive.emulator.units import BlockUnit, build, SourceUnit
from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep import compiled_loop
from antenna_drive.lockstep.compiled_unit import form_of
from antenna_drive.lockstep.conductor import Conductor, SLACK
from antenna_drive.lockstep.exchange import Exchange
from antenna_drive.lockstep.pace import Pace
from antenna_drive.parameters import load
from memory_channel import Frame, MemoryChannel
import numpy as np
import pytest

OUTPUTS = {'test_signal': (Signal('a', 'rad', ''), Signal('b', 'V', '')),
           'plant': (Signal('a', 'rad', ''),)}


class Conducted:
    """A conductor with a loop, a plant and an observer, as far as frames can tell."""

    def __init__(self, last_step: int | None = None, step_s: float = 1e-3,
                 readings: Sequence[tuple[int, float, int]] = ()) -> None:
        self.sent: list[Frame] = []
        unit = build('test_signal', load())
        form = form_of(unit)
        assert form is not None
        self.member = Conductor(unit, 1.0, step_s, last_step, OUTPUTS, ['watcher'])
        self.channel = MemoryChannel(self.member.layout, self.member.layouts, self.sent.append,
                                     readings)
        self.exchange = Exchange(self.member, form, self.channel)
        self.member.receive('plant', (0.0, 2.0, 0.0, 7.0, 0.0, 0.0))
        self.member.receive('watcher', (0.0, 2.0, 0.0, 8.0))
        assert self.member.new_run(10.0) is not None
        self.run_id = self.member.run

    def run(self, pace: Pace | None = None, every: int = 0) -> int:
        """Run the loop, until it returns for more than a sender that was not known."""
        reason = self.exchange.run(every, pace, limit_s=60.0)
        if reason == compiled_loop.FOREIGN:
            assert not self.member.inbox.refused
            reason = self.exchange.run(every, pace, limit_s=60.0)
        return reason

    def give(self, first: int, last: int) -> None:
        """Let the plant's frames arrive."""
        self.channel.arrived['plant'] += [
            (self.run_id, float(k), 1e-3, 7.0, 0.0, 0.0) for k in range(first, last + 1)]

    def report(self, *steps: int) -> None:
        """Take the observer's reports of its progress; the loop knows no observers."""
        for k in steps:
            self.member.receive('watcher', (self.run_id, float(k), 1e-3, 8.0))


def test_every_unit_of_the_drive_has_a_loop_but_a_subclass_has_none() -> None:
    drive = load()
    for name in UNITS:
        unit = build(name, drive)
        assert form_of(unit) is not None
        kind = type('Other', (type(unit),), {})
        assert isinstance(unit, (BlockUnit, SourceUnit))
        unit.__class__ = kind
        assert form_of(unit) is None, 'its step may do something else'


def test_the_loop_waits_for_an_observer_that_falls_behind() -> None:
    drive = Conducted()
    drive.give(0, 2 * SLACK)
    assert drive.run() == compiled_loop.LAST_STEP
    assert drive.member.step == 0, 'the watcher has not begun the run'
    drive.report(0)
    assert drive.run() == compiled_loop.LAST_STEP
    assert drive.member.step == SLACK + 1
    assert drive.member.missing() == ('watcher',)
    drive.report(3, 7)
    assert drive.run() == compiled_loop.LAST_STEP
    assert drive.member.step == SLACK + 8
    assert drive.member.missing() == ('watcher',)
    assert [frame[1] for frame in drive.sent] == list(range(1, SLACK + 9))


def test_the_loop_gives_the_steps_of_python() -> None:
    drive, alone = Conducted(last_step=40), build('test_signal', load())
    drive.give(0, 40)
    drive.report(0)
    drive.exchange.pauses = [7]
    assert drive.run() == compiled_loop.STEPPED
    assert drive.member.step == 7
    assert drive.run() == compiled_loop.LAST_STEP
    alone.start(1e-3)
    law = [alone.step(k, np.zeros((0, 2))).ravel().tolist() for k in range(40)]
    assert [list(frame[4:]) for frame in drive.sent] == law


def test_the_loop_publishes_readings_and_the_clock() -> None:
    readings = [(1, 1.0, 50), (0, 6.25, 51), (compiled_loop.TIME, 1.0, 52)]
    drive = Conducted(last_step=3000, step_s=0.0703, readings=readings)
    drive.member.unit.tune({'waveform': 'saw_tooth', 'amplitude': 0.01, 'period': 47.0})
    drive.give(0, 3000)
    drive.report(3000)
    assert drive.run(every=1000) == compiled_loop.LAST_STEP
    want = []
    for k in (1000, 2000, 3000):
        values = drive.sent[k - 1][4:]
        want += [(50, struct.pack('<4sd', b'\0\1\0\0', values[2])),
                 (51, struct.pack('<4sd', b'\0\1\0\0', 6.25 * values[0])),
                 (52, struct.pack('<4siI', b'\0\1\0\0', *divmod(70_300_000 * k, 10**9)))]
    assert drive.channel.read_out == want
    assert want[1][1] != want[4][1], 'the signal moves'


def test_the_loop_counts_late_steps_and_returns_when_it_is_asked() -> None:
    drive, pace = Conducted(last_step=5), Pace(1.0)
    pace.note(0, 1e-3, 0.0)  # due long ago, on the clock since the machine was started
    drive.give(0, 5)
    drive.report(0)
    drive.exchange.ask()
    assert drive.run(pace) == compiled_loop.LIMIT
    assert drive.member.step == 0
    drive.exchange.listen()
    assert drive.run(pace) == compiled_loop.LAST_STEP
    assert pace.late_steps == 5
    assert pace.delays.counts.sum() == 5
    assert 0.0 < pace.worst_s < time.monotonic()


def test_what_is_not_there_is_named() -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    from antenna_drive.lockstep import rcl_channel
    with pytest.raises(rcl_channel.Unusable, match='no_such_function is not there'):
        rcl_channel._address(ctypes.CDLL(None), 'no_such_function')
    with pytest.raises(rcl_channel.Unusable, match='libno_such_library is not loaded'):
        rcl_channel._loaded('no_such_library')
