# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The nuisances: tolerances of the machine, its initial conditions, zeros of the sensors.

They share numbers with the effects.
"""

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from itertools import product
import math

from antenna_drive.diagnosis.field_test import FieldTest
from antenna_drive.diagnosis.modifiers import (
    ADD, add, AntennaParameter, KnownModifiers, Modifier, RecorderError, scale, SupplyGain,
    Unrecorded,
)
from antenna_drive.diagnosis.recorded_command import RecordedCommand
from antenna_drive.readings import Reading, READINGS
from antenna_drive.recording.sheet import Tolerances, USUAL
import numpy as np
from simgap.machine.contract import Effect, Nuisances, Parameter, Point

# The numbers that the configuration knows only within the tolerance of the test sheet.
TOLERANT_MOTOR = (
    'rate_command.k_s', 'rate_command.k_1', 'rate_command.tau_1', 'amplifier.rate_gain',
    'amplifier.integral_time', 'amplifier.lag', 'amplifier.current_feedback_gain',
    'amplifier.forward_gain_share', 'armature.voltage_limit',
    'amplifier.tach_gain', 'amplifier.bias_command_gain', 'armature.inductance',
    'motor.current_limit', 'motor.rotor_inertia', 'motor.coulomb_torque', 'motor.stiction_ratio',
    'gearbox.stiffness', 'gearbox.half_gap', 'gearbox.contact_damping',
)
TOLERANT_DRIVE = (
    *(f'torque_share.circuit.{name}' for name in (
        'bias_pot', 'fade_out_voltage', 'current_to_voltage', 'k_2', 's_2', 'k_3', 'g_4',
        'saturation_high')),
    *(f'torque_share.filter_1.{name}' for name in ('gain', 'pole', 'difference_gain')),
    *(f'plant.axis.{name}' for name in ('inertia_hub', 'coulomb_torque', 'stiction_ratio')),
    *(f'plant.axis.{name}.{j}' for name in (
        'mode_inertias', 'mode_frequencies', 'mode_damping_ratios') for j in range(3)),
)

# Frictions are warmer or colder from test to test, by this standard deviation as a share.
_WARMTH = 0.04
# How many deviations what differs from day to day may have.
_WIDEST = 3.0
_OF_A_DAY = ('plant.axis.coulomb_torque', 'motor_1.motor.coulomb_torque',
             'motor_2.motor.coulomb_torque')
# The rms of a wind that is there every day, as a share of the axis' Coulomb friction.
_WIND = 0.015

# A jump of the command is felt for about this time [s].
_FELT_S = 5.0
# Places inside the gap, as shares of half the gap, at which each motor may start.
_STARTS = np.linspace(-0.95, 0.95, 13)


def nuisances(tests: Sequence[FieldTest], tolerance: float) -> tuple[AntennaParameter, ...]:
    """Return the nuisances of a machine in its tests, whose numbers may be off by this share."""
    return (*_of_the_machine(tests[0], tolerance), *_of_zeros_and_recorders(tests),
            *(item for k, test in enumerate(tests) for item in _of_a_test(k, test, tolerance)))


def _within(name: str, unit: str, half_width: float, modifier: Modifier,
            experiment: int | None = None) -> AntennaParameter:
    """Return a number that is spread evenly within a tolerance."""
    return AntennaParameter(name, unit, -half_width, half_width, 0.3 * half_width,
                            half_width / math.sqrt(3.0), experiment=experiment,
                            modifier=modifier)


def _of_the_machine(test: FieldTest, tolerance: float) -> Iterator[AntennaParameter]:
    def relative(name: str, *others: str) -> AntennaParameter:
        return _within(f'offset:{name}', '1', tolerance, scale(name, *others))

    for motor in ('motor_1', 'motor_2'):
        for name in TOLERANT_MOTOR:
            yield relative(f'{motor}.{name}')
        # a motor's magnets make its torque and its back-EMF
        yield relative(f'{motor}.motor.torque_constant', f'{motor}.armature.back_emf_share')
        yield relative(f'{motor}.armature.back_emf_constant')
        # the amplifier is made for the resistance that the winding should have
        ohms = tolerance * float(test.record[motor]['armature']['resistance'][0])
        path = f'{motor}.armature.resistance_change'
        yield _within(f'offset:{path}', 'ohm', ohms, add(path))
    for name in TOLERANT_DRIVE:
        yield relative(name)


def _allowed(tests: Sequence[FieldTest]) -> Tolerances:
    """Return the greatest tolerances that the sheets of some tests give, or else usual ones."""
    def greatest(name: str) -> float:
        given = [value for test in tests
                 if (value := getattr(test.sheet.tolerances, name, None)) is not None]
        return max(given, default=getattr(USUAL, name))

    return Tolerances(**{item.name: greatest(item.name) for item in fields(Tolerances)})


def _of_zeros_and_recorders(tests: Sequence[FieldTest]) -> Iterator[AntennaParameter]:
    """Yield what may be off beyond the parameters: zeros in the loop, gains, delays."""
    given = _allowed(tests)
    period = max(test.period for test in tests)
    for m in (1, 2):
        motor = f'motor_{m}'
        for size, unit, path in (
                (given.tach_zero_rad_s, 'rad/s', f'{motor}.tachometer.offset'),
                (given.amplifier_zero_V, 'V', f'{motor}.amplifier.offset')):
            if size:
                yield _within(f'offset:{path}', unit, size, add(path))
    for reading in READINGS:
        name = reading.name
        if given.recorder_gain and not reading.sensor.is_counter:
            yield _within(f'gain:{name}', '1', given.recorder_gain,
                          RecorderError('gain', name, (reading.gain,) if reading.gain else ()))
        for kind, seconds in (('delay', given.channel_delay_samples * period),
                              ('lag', given.channel_lag_s)):
            if seconds:
                yield replace(_within(f'{kind}:{name}', 's', seconds, RecorderError(kind, name)),
                              low=0.0)


def _starting_places(k: int, test: FieldTest) -> tuple[AntennaParameter, ...]:
    """Return where in its gap each motor starts in test k, as a share of half the gap."""
    return tuple(AntennaParameter(
        f'start:{test.name}.{motor}', '1', -1.0, 1.0, 0.05, 0.6, experiment=k,
        modifier=add(f'{motor}.start_in_gap')) for motor in ('motor_1', 'motor_2'))


def everyday_wind_torque(test: FieldTest) -> float:
    """Return the rms torque of the wind that is there every day [N m]."""
    axis = test.record['plant']['axis']
    return _WIND * float(axis['coulomb_torque'][0] * axis['friction_torque_per_ampere'][0]
                         * axis['gear_ratio'][0])


def _of_a_test(k: int, test: FieldTest, tolerance: float) -> Iterator[AntennaParameter]:
    yield from _starting_places(k, test)
    if test.record['torque_share']['circuit']['bias_source'][0] == 1:
        yield _within(f'supply:{test.name}', '1', tolerance, SupplyGain(), k)
    yield AntennaParameter(f'clock:{test.name}', 's', -0.01, 0.01, 1e-4, 1e-3, experiment=k,
                           modifier=RecorderError('clock'))

    for path in _OF_A_DAY:
        yield AntennaParameter(f'day:{path}:{test.name}', '1', -_WIDEST * _WARMTH,
                               _WIDEST * _WARMTH, 0.01, _WARMTH, experiment=k,
                               modifier=scale(path))

    if isinstance(test.command, RecordedCommand):
        command = test.command
        for i, begin in enumerate(command.jumps.tolist()):
            # of those before a window the last ones alone are still felt in it
            if not test.time[0] - _FELT_S < begin < test.time[-1]:
                continue
            name = f'jump:{test.name}:{begin:.3f}'
            earlier, later = command.slack[i].tolist()
            half = 0.5 * (later - earlier)
            yield replace(_within(name, 's', half, Unrecorded('jump', i), k), low=earlier,
                          high=later)

        for i, (begin, _) in enumerate(command.holes):
            yield _within(f'hole:{test.name}:{begin:.3f}', 'rad/s',
                          2.0 * float(command.uncertainty[i]), Unrecorded('mean', i), k)

    given = _allowed([test])
    if given.clock_ppm:
        yield _within(f'clock_rate:{test.name}', '1', 1e-6 * given.clock_ppm,
                      RecorderError('clock_rate'), k)

    def zero(reading: Reading, half_width: float) -> AntennaParameter:
        return _within(f'zero:{reading.name}:{test.name}', reading.unit, half_width,
                       RecorderError('zero', reading.name), k)

    # an encoder counts on from an angle that is not known where the start is not
    wide = 1.0 if test.known_start else 50.0
    for reading in READINGS:
        if reading.sensor.is_counter:
            yield replace(zero(reading, 4e-5 * wide), step=2e-6, prior_sigma=1e-5 * wide)
    for reading in READINGS:
        allowance = reading.sensor.zero
        size = (getattr(given, allowance.key) if allowance
                else 2.0 * float(test.sensors.errors(reading).scatter))
        if size:
            yield zero(reading, size)


class AntennaNuisances(Nuisances):
    """
    The tolerances of the antenna drive in some tests; what they do is registered in `modifiers`.

    Starting places of both motors inside their gaps are tried in all combinations: where a bias
    closes both gaps at once, each motor's place looks right or wrong by the other's. One after the
    other they end in a wrong pair.
    """

    def __init__(self, tolerances: Sequence[AntennaParameter], tests: Sequence[FieldTest],
                 modifiers: KnownModifiers) -> None:
        super().__init__(tolerances, {k: [[
            {first.name: one, second.name: other}
            for one, other in product(_STARTS.tolist(), repeat=2)]]
            for k, test in enumerate(tests) for first, second in [_starting_places(k, test)]})
        self._modifiers = modifiers
        modifiers.register(tolerances)
        # the nuisance that changes the same number in the same way
        self._tolerance_of = {(item.modifier.fields[0], item.modifier.how): item
                              for item in tolerances
                              if item.experiment is None and item.modifier.fields}

    def absorb(self, point: Point, removed: Point) -> dict[str, float]:
        """Return the tolerances that take over what they can of an effect that is removed."""
        result = dict(point)
        for name, value in removed.items():
            modifier = self._modifiers.of(name)
            for path in modifier.fields:
                tolerance = self._tolerance_of.get((path, modifier.how))
                if tolerance is None or tolerance.name not in result:
                    continue
                one = result[tolerance.name]
                both = (one + value if modifier.how == ADD else
                        (1.0 + one) * (1.0 + value) - 1.0)
                result[tolerance.name] = min(max(both, tolerance.low), tolerance.high)
        return result


def tolerated(effect: Effect, tolerances: Sequence[AntennaParameter]) -> Effect:
    """Return an effect whose parameters know by how much their numbers may be off anyway."""
    allowed = {(path, item.modifier.how): math.sqrt(3.0) * item.prior_sigma for item in tolerances
               if item.experiment is None for path in item.modifier.fields}

    def known(item: Parameter) -> Parameter:
        assert isinstance(item, AntennaParameter)
        same_number = min((allowed.get((path, item.modifier.how), 0.0)
                           for path in item.modifier.fields), default=0.0)
        return replace(item, tolerance=max(item.tolerance, same_number))

    return replace(effect, forms=tuple(
        replace(form, parameters=tuple(known(p) for p in form.parameters))
        for form in effect.forms))
