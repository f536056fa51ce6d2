# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is missing or wrong in a machine is told at once, by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from simgap.errors import UserError
from simgap.machine.check import check_machine, idle_effects, MachineError, without
from simgap.machine.contract import Effect, Experiment, FloatArray, Form, Machine, Parameter, Point
from simgap.verdict.diagnosis import diagnose

TIME: FloatArray = np.arange(50, dtype=np.float64) * 0.1
NUISANCE = Parameter('spring', '1', -0.1, 0.1, 1e-3, 0.05)
SIZE = Parameter('shaft.play.size', 'rad', 0.0, 1.0, 1e-3)
SHAPE = Parameter('shaft.play.shape', '1', 0.5, 2.0, 1e-2, start=1.0, is_shape=True)
PLAY = Effect('shaft.play', 'shaft', 'wear', (Form('', (SIZE, SHAPE)),))
TEST = Experiment('step', TIME, ('angle', 'current'), ('rad', 'A'), np.zeros((50, 2)),
                  np.ones((50, 2)))


class Shaft(Machine):
    """A machine whose readings are given."""

    def __init__(self, *, test: Experiment = TEST, nuisance: Parameter = NUISANCE,
                 effect: Effect = PLAY, reading: Any = None) -> None:
        self.reading = np.zeros(test.measured.shape) if reading is None else reading
        super().__init__([test], [nuisance], [effect])

    def predict(self, point: Point, experiment: int) -> FloatArray:
        """Return the given readings."""
        return np.asarray(self.reading)


def with_parameter(item: Parameter) -> Effect:
    return replace(PLAY, forms=(Form('', (item,)),))


def holed(values: Any, value: float) -> Any:
    values = np.array(values)
    values[3, 1] = value
    return values


@pytest.mark.parametrize(('changes', 'words'), [
    ({'reading': np.zeros((50, 1))}, 'prediction of step: shape (50, 1)'),
    ({'reading': np.zeros(50)}, 'prediction of step: shape (50,)'),
    ({'reading': holed(np.zeros((50, 2)), np.nan)}, 'current: 1 of 50 samples are NaN'),
    ({'test': replace(TEST, noise=holed(TEST.noise, 0.0))}, 'noise of current: 0 given'),
    ({'test': replace(TEST, noise=np.ones(2))}, 'noise: shape (2,) given'),
    ({'test': replace(TEST, measured=np.zeros((49, 2)))}, 'measured: shape (49, 2) given'),
    ({'test': replace(TEST, measured=np.full((50, 2), np.nan))}, 'no finite sample'),
    ({'test': replace(TEST, measured=holed(TEST.measured, np.inf))}, 'infinite samples'),
    ({'test': replace(TEST, time=TIME[::-1])}, 'increasing times'),
    ({'test': replace(TEST, units=('rad',))}, '1 given for 2 channels'),
    ({'test': replace(TEST, quantised=('rate',))}, 'rate: no such channel'),
    ({'nuisance': replace(NUISANCE, low=0.01)}, 'nuisance spring: bounds 0.01 to 0.1'),
    ({'nuisance': replace(NUISANCE, step=0.0)}, 'spring: step: 0 given'),
    ({'nuisance': replace(NUISANCE, high=np.inf)}, 'allowed are finite ones'),
    ({'nuisance': replace(NUISANCE, prior_sigma=-1.0)}, 'prior_sigma: -1 given'),
    ({'nuisance': replace(NUISANCE, experiment=1)}, 'experiment: 1 given, allowed is 0 to 0'),
    ({'nuisance': replace(NUISANCE, name='shaft.play.size')}, 'the name is there twice'),
    ({'effect': with_parameter(replace(SIZE, low=0.1))}, 'without the neutral value 0'),
    ({'effect': with_parameter(SHAPE)}, 'no parameter but shape parameters'),
    ({'effect': replace(PLAY, forms=())}, 'forms: there is none'),
    ({'effect': replace(PLAY, id='play')}, 'allowed is component.effect'),
    ({'effect': replace(PLAY, parts=('shaft.wear',))}, 'parts: shaft.wear: no such effect'),
    ({'effect': replace(PLAY, simpler=('shaft.wear',))}, 'simpler: shaft.wear: no such effect'),
])
def test_what_is_wrong_is_told_by_name(changes: Any, words: str) -> None:
    with pytest.raises(MachineError) as caught:
        diagnose(Shaft(**changes))
    assert words in str(caught.value) and '\n' not in str(caught.value)
    # the command line shows it without a traceback
    assert isinstance(caught.value, UserError)


def test_what_is_left_out_and_what_matters_has_to_be_there() -> None:
    assert list(without(Shaft(), ['shaft.play'], ['angle']).catalogue) == []
    for effects, limits, words in ((['shaft.pley'], [], 'shaft.pley: no such effect, did you mean '
                                    'shaft.play?; there are shaft.play'),
                                   ([], ['angel'], 'angel: no such signal, did you mean angle?')):
        with pytest.raises(UserError) as caught:
            without(Shaft(), effects, limits)
        assert words in str(caught.value)


def test_a_machine_in_order_passes() -> None:
    check_machine(Shaft())


def test_a_reading_that_was_not_recorded_may_be_anything() -> None:
    missing = holed(TEST.measured, np.nan)
    check_machine(Shaft(test=replace(TEST, measured=missing, noise=holed(TEST.noise, np.nan)),
                        reading=missing))


def test_effects_that_do_nothing_or_act_at_zero_are_named() -> None:
    assert list(idle_effects(Shaft())) == [
        'effect shaft.play: changes no reading in these experiments']

    class Biased(Shaft):
        def predict(self, point: Point, experiment: int) -> FloatArray:
            return np.asarray(self.reading + point.get('shaft.play.size', 0.0)
                              + 0.5 * ('shaft.play.shape' in point))

    (line,) = idle_effects(Biased())
    assert line.startswith('effect shaft.play: changes a reading by 0.5 standard deviations')
