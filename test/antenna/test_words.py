# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive's effects in plain words, against sentences written by hand from known numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from antenna_drive.diagnosis.catalogue import catalogue
from antenna_drive.diagnosis.words import ratio, words
from antenna_drive.parameters import load
from antenna_drive.parameters.records import record_of
import pytest
from simgap.verdict.record import Named
from simgap.verdict.sentence import said

EFFECTS = catalogue()
DRIVE = load()
WORDS = words(EFFECTS.values(), DRIVE, record_of(DRIVE))


def number(value: float, low: float, high: float, unit: str = '1') -> dict[str, Any]:
    return {'value': value, 'ci95': [low, high], 'unit': unit}


def what(effect: str, **numbers: dict[str, Any]) -> str:
    """Return what is said of an effect with some numbers."""
    return told(effect, {f'{effect}.{name}': item for name, item in numbers.items()})


def told(effect: str, parameters: dict[str, Any]) -> str:
    verdict: Any = SimpleNamespace(
        word='explained', which=[Named([effect], 0.95, parameters)], confusable=[], planning={},
        reproducibility=[],
        machine=SimpleNamespace(catalogue=EFFECTS, words=WORDS),
        how_far={'judged': [], 'explained_fraction': {'value': None}})
    return said(verdict).what


# The reference drive has a gear of 23.6 N m/rad, a winding of 0.46 ohm, a motor friction of
# 0.069 article A, a first mode of 2.2 Hz and no tachometer error.
@pytest.mark.parametrize('found, text', [
    (what('gearbox_2.stiffness', change=number(-0.4, -0.42, -0.38)),
     'Gearbox 2 is 40 percent softer than configured: 14.2 N m/rad (13.7 to 14.6) instead of '
     '23.6.'),
    (what('gearbox_1.stiffness', change=number(0.5, 0.4, 0.6)),
     'Gearbox 1 is 50 percent stiffer than configured: 35.4 N m/rad (33 to 37.8) instead of '
     '23.6.'),
    (what('motor_1.armature_resistance', change=number(0.23, 0.184, 0.276, 'ohm')),
     'The armature of motor 1 has 50 percent more resistance than configured: 0.69 ohm (0.644 to '
     '0.736) instead of 0.46.'),
    (what('motors.coulomb_friction', torque=number(-0.0345, -0.0414, -0.0276, 'A')),
     'Each motor rubs 50 percent less than configured: 0.0345 article A (0.0276 to '
     '0.0414) instead of 0.069.'),
    (what('axis.mode_frequency', change_1=number(0.1, 0.05, 0.15)),
     'The frequency of mode 1 is 10 percent higher than configured: 2.42 Hz (2.31 to 2.53) '
     'instead of 2.2.'),
    # three modes have no frequency in common
    (what('axis.mode_frequency', change=number(-0.1, -0.12, -0.08)),
     'The frequency of all modes is 10 percent (8 to 12) lower than configured.'),
    # the shape of what it names, where it has a unit
    (what('axis.extra_mode', inertia=number(2e6, 1.9e6, 2.1e6, 'kg m^2'),
          frequency=number(3.1, 3.0, 3.2, 'Hz'), damping=number(0.03, 0.02, 0.04)),
     'The structure has one more mode, with an inertia: 2e6 kg m^2 (1.9e6 to 2.1e6), frequency '
     '3.1 Hz.'),
    # a number that the configuration lacks; its shape is no size
    (what('axis.viscous_friction', torque_per_rate=number(8e7, 7e7, 9e7, 'N m s/rad'),
          flow_index=number(1e9, 1e9, 1e9)),
     'The axis drags the more, the faster it turns, by more than the model has: 8e7 N m s/rad '
     '(7e7 to 9e7).'),
    (what('loop.delay', error_time=number(0.02, 0.018, 0.022, 's')),
     'The rate error comes late in the rate loop: 0.02 s (0.018 to 0.022).'),
    (what('encoder.offset', offset=number(-0.05, -0.06, -0.04, 'rad')),
     'The encoder is shifted: -0.05 rad (-0.06 to -0.04).'),
    (what('motor_2.friction_asymmetry', share=number(-0.2, -0.25, -0.15)),
     'Motor 2 rubs 20 percent (15 to 25) above its mean backwards, and as much below it '
     'forwards.'),
    # 3 and 4 at right angles are 5
    (told('motor_1.torque_ripple', {
        'motor_1.torque_ripple.sine@12': number(3.0, 2.9, 3.1, 'N m'),
        'motor_1.torque_ripple.cosine@12': number(-4.0, -4.1, -3.9, 'N m')}),
     'The torque of motor 1 varies with the angle of its rotor: 5 N m (4.9 to 5.1), 12 cycles a '
     'turn.'),
    (told('gearbox_2.stiffness', {
        'gearbox_2.stiffness.change[load=A]': number(-0.1, -0.2, 0.0),
        'gearbox_2.stiffness.change[load=B]': number(-0.5, -0.6, -0.4)}),
     'Gearbox 2 is 50 percent softer than configured: 11.8 N m/rad (9.44 to 14.2) instead of '
     '23.6, where load=B.'),
])
def test_what_is_said_of_an_effect(found: str, text: str) -> None:
    assert found == text


@pytest.mark.parametrize('effect', EFFECTS)
def test_every_effect_has_words_and_next_steps(effect: str) -> None:
    for form in EFFECTS[effect].forms:
        for item in form.sizes:
            inspect, predict, repeat = WORDS[effect]({item.name: number(1.0, 1.0, 1.0)})[1]
            assert inspect.startswith('inspect ') and repeat.startswith('repeat ')
            assert '`antenna-drive predict RECORDING ' in predict
        for value in {form.sizes[0].high, form.sizes[0].low} - {0.0}:
            text = told(effect, {form.sizes[0].name: number(value, 0.9 * value, 1.1 * value,
                                                            form.sizes[0].unit)})
            assert 'the model lacks' not in text and '{' not in text and text[0].isupper()
            assert any(digit in text for digit in '123456789')


def test_what_is_compared_is_that_of_the_drive_in_its_test() -> None:
    record = record_of(DRIVE)
    record['motor_2']['gearbox']['stiffness'] = 50.0
    said_of = words(EFFECTS.values(), DRIVE, record)['gearbox_2.stiffness']
    assert said_of({'gearbox_2.stiffness.change': number(-0.1, -0.2, 0.0)})[0] == (
        'gearbox 2 is 10 percent softer than configured: 45 N m/rad (40 to 50) instead of 50')


@pytest.mark.parametrize('change, text', [
    (-0.4, '40 percent'), (3.0, '300 percent'), (0.053, '5.3 percent'), (930.0, '930 times')])
def test_a_change_is_a_share_or_a_multiple(change: float, text: str) -> None:
    assert ratio(change) == text
