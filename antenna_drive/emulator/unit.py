# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What every unit of the drive is: inputs, outputs, a start and a step.

A unit neither knows who steps it nor where its inputs come from. The emulator
steps it in one process, a node steps it over ROS 2, and both get the same bits.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from antenna_drive.physics.arrays import FloatArray
from antenna_drive.physics.block import Signal
from simgap.inputs.schema import Entry, nearest, ParameterError, Value

__all__ = ['FloatArray', 'Signal', 'Unit']


def check_changes(changes: Mapping[str, object], entries: Mapping[str, Entry]) -> dict[str, Value]:
    """
    Check a set of live changes, all or nothing.

    Raises ParameterError if a key is unknown or no tuning parameter, or its value not allowed.
    """
    checked: dict[str, Value] = {}
    for key, value in changes.items():
        if key not in entries:
            raise ParameterError(f'{key}: no such parameter{nearest(key, tuple(entries))}')
        if not entries[key].live:
            raise ParameterError(f'{key}: a physical constant, read-only while the drive runs')
        checked[key] = entries[key].check(key, value)
    return checked


class Unit(ABC):
    """
    One unit of the drive, stepped from t_k to t_k+1 by the caller that holds its inputs at t_k.

    Subclass it to put a unit of your own in the place of one of ours: keep the name and
    the outputs of the unit that you replace, and choose any of the drive's signals as inputs.

    inputs : names of the signals this unit reads, each as 'unit/signal'
    outputs : the signals that it puts out, in the order of the rows of `start` and `step`
    """

    inputs: ClassVar[tuple[str, ...]] = ()
    outputs: ClassVar[tuple[Signal, ...]] = ()

    def __init__(self, name: str) -> None:
        """Name the unit: the name of its node and the first half of its signals' names."""
        self.name = name

    @abstractmethod
    def start(self, step_s: float) -> FloatArray:
        """
        Return to the initial state and give the outputs at t = 0.

        step_s : length of one macro-step [s]

        Returns an array of shape (len(outputs), 2): value and time derivative of each output.
        """

    @abstractmethod
    def step(self, k: int, inputs: FloatArray) -> FloatArray:
        """
        Advance the state from t_k to t_k+1 and give the outputs at t_k+1.

        k : number of the macro-step; t_k = k * step_s
        inputs : array of shape (len(inputs), 2), value and time derivative of each input at t_k;
            between t_k and t_k+1 an input is value + derivative * (t - t_k)

        Returns an array of shape (len(outputs), 2): value and derivative of each output at t_k+1.
        """

    def settings(self) -> Mapping[str, tuple[Entry, Value]]:
        """Return every parameter of this unit: its name, what may be said of it, its value."""
        return {}

    def tune(self, changes: Mapping[str, Value]) -> None:
        """
        Change tuning parameters: all of them or, if one is refused, none.

        Raises ParameterError: a name is unknown or not a tuning parameter, or a value is not
        allowed; the message names the key and what is allowed.
        """
        self.check(changes)

    def check(self, changes: Mapping[str, Value]) -> None:
        """
        Raise ParameterError if `changes` cannot be applied; change nothing.

        A unit is asked from the thread that serves parameters while it is being stepped in
        another, so this reads nothing that `step` writes.
        """
        check_changes(changes, {name: entry for name, (entry, _) in self.settings().items()})
