# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Passages in which the article disagrees with itself, and what each reading of them gives.

Every entry names the passages, runs the possible readings on the configuration at hand, and
draws its conclusion from the figures obtained.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antenna_drive.article import readings
from antenna_drive.article.experiments import (
    experiments, GAINS, SAW_TOOTH, TABLE_1_GAIN, TAU_6_NEW, TAU_6_OLD,
)
from antenna_drive.article.measures import OLD_CIRCUIT, Results
from antenna_drive.article.published import SIGNIFICANT_TIME
from antenna_drive.article.stability import bias_loop, growth, stability_limit
from antenna_drive.emulator.run import simulate
from antenna_drive.parameters.sets import changed
import numpy as np
from simgap.inputs.plain_yaml import read_yaml

# Newtons per kilogram force; newton metres per pound-inch.
STANDARD_GRAVITY = 9.80665
POUND_INCH = 0.1129848
# Section V: the 0.685 deg/s of the saw-tooth are 85 percent of the maximal rate.
SHARE_OF_GREATEST_RATE = 0.85
# Section IV: the greatest torque of a motor, the torque of 1 A and the friction of the axis, in
# 'kGm'.
GREATEST_TORQUE, TORQUE_PER_AMPERE, AXIS_FRICTION = 308.0, 61.0, 9.1e5
# Section VI: k_ctfr of the new filter, and the bias of Fig. 21 [percent].
NEW_FILTER_GAIN, BIAS_PERCENT = 48.67, 22.0
_POT = 'torque_share.circuit.bias_pot'
# No motor of such a drive is larger.
_LARGEST_MOTOR_KW = 100.0


@dataclass(frozen=True)
class Interpretation:
    """One way to read a passage."""

    reading: str  # in words
    gives: Mapping[str, float]  # the figures that follow from it, with their units in their names
    fits: bool  # whether they agree with the published figures


@dataclass(frozen=True)
class Contradiction:
    """A passage that disagrees with another."""

    # short name
    id: str  # noqa: A003
    passages: str  # the passages that disagree
    published: Mapping[str, float]  # the figures that the readings are compared with
    readings: tuple[Interpretation, ...]  # what each reading gives
    conclusion: str  # which readings fit, and the figures that decide


def _saw_tooth_bias(results: Results, name: str, settings: dict[str, Any]) -> dict[str, float]:
    """Read the bias of T3a or T3b with other settings."""
    experiment = experiments()[name]
    drive = experiment.applied_to(results.drives[experiment.circuit])
    run = simulate(changed(drive, settings), experiment.duration)
    found = readings.bias_range(run.time, run['torque_share/bias_voltage'], SAW_TOOTH['period'])
    return {'low_V': found.low_V, 'high_V': found.high_V,
            'time_at_zero_percent': 100.0 * found.zero_fraction}


def _response(results: Results, gain: float, pole: float, name: str = 'T4a') -> dict[str, float]:
    """Read the torque bias of T4a or T4e with another Filter 1."""
    experiment = experiments()[name]
    drive = changed(experiment.applied_to(results.drives[experiment.circuit]), {
        'torque_share.filter_1.gain': gain, 'torque_share.filter_1.pole': pole})
    run = simulate(drive, experiment.duration)
    found = readings.step_response(run.time, run['motor_2/current'] - run['motor_1/current'])
    return {'final_percent': 100.0 * found.final / drive.motor_1.motor.current_limit,
            'overshoot_percent': 100.0 * found.overshoot, 'settling_s': found.settling_s}


def _close(found: Mapping[str, float], published: Mapping[str, float],
           tolerances: Mapping[str, float]) -> bool:
    return all(abs(found[key] - published[key]) <= tolerance
               for key, tolerance in tolerances.items())


def _which(found: Sequence[Interpretation]) -> str:
    """Return a sentence that names the readings that fit."""
    fitting = [item.reading for item in found if item.fits]
    if not fitting:
        return 'No reading fits.'
    if len(fitting) == len(found):
        return 'All readings fit.'
    return f'Fits: {"; ".join(fitting)}.'


# How far a figure of the torque bias may be from the published one.
_RESPONSE = {'overshoot_percent': 5.0, 'settling_s': 0.15}
# What the readings of a passage give, and the figures that its conclusion states.
_Judged = tuple[list[Interpretation], dict[str, Any]]


def filter_1_units(results: Results, published: Mapping[str, float]) -> _Judged:
    """Compare the 1.369 s and 8.889 s of Table 1 with the 0.73 s and 0.1125 s of Section VI."""
    found = []
    for words, gain, pole in (
            ("Table 1 as k'/(s + p): 4.54/(s + 1.369), p in 1/s", TABLE_1_GAIN, 1.369),
            ('Table 1 literally: 4.54/(1 + 1.369 s)', TABLE_1_GAIN / 1.369, 1.0 / 1.369),
            ('Table 1 as gain and time constant: 4.54/(s + 1/1.369)', TABLE_1_GAIN,
             1.0 / 1.369)):
        gives = _response(results, gain, pole)
        found.append(Interpretation(words, gives, _close(gives, published, _RESPONSE)))
    return found, {'old_pole': 1.0 / TAU_6_OLD, 'new_pole': 1.0 / TAU_6_NEW,
                   'old_gain': GAINS[0] / TAU_6_OLD, 'new_gain': NEW_FILTER_GAIN / TAU_6_OLD}


def filter_1_literal(results: Results, published: Mapping[str, float]) -> _Judged:
    """Try Section VI's new filter as printed, and with the gain of Table 1."""
    found = []
    drive = results.drives[OLD_CIRCUIT]
    pole = 1.0 / TAU_6_NEW
    limit = stability_limit(drive, pole)
    for words, gain in (('literally: 48.67/(1 + 0.1125 s)', NEW_FILTER_GAIN / TAU_6_NEW),
                        ('as Table 1: 48.67/0.73/(s + 8.889)', NEW_FILTER_GAIN / TAU_6_OLD)):
        gives = {'k_per_s': gain, 'limit_of_k_per_s': limit,
                 'growth_per_s': growth(bias_loop(drive, gain, pole, rotors_held=True)),
                 **_response(results, gain, pole, 'T4e')}
        found.append(Interpretation(words, gives, gives['growth_per_s'] < 0.0
                                    and _close(gives, published, _RESPONSE)))
    literal, table = (item.gives['k_per_s'] / limit for item in found)
    return found, {'ratio': literal / table, 'literal': literal, 'table': table}


def stability_limit_units(results: Results, published: Mapping[str, float]) -> _Judged:
    """Compare the limit of 146 with k_ctfr as in Section VI and as in Table 1."""
    limit = stability_limit(results.drives[OLD_CIRCUIT], 1.0 / TAU_6_OLD)
    last = GAINS[-1]
    found = [Interpretation(words, {'limit': found, 'figure_21e': gain},
                            abs(found - published['limit']) <= 3.0)
             for words, found, gain in (
                 ("as Table 1's k'", limit, last / TAU_6_OLD),
                 ("as Section VI's k_ctfr", limit * TAU_6_OLD, last))]
    return found, {'last': last, 'gain': last / TAU_6_OLD, 'limit': limit,
                   'side': 'below' if last / TAU_6_OLD < limit else 'above'}


def gain_k_2(results: Results, published: Mapping[str, float]) -> _Judged:
    """Compare transfer function 4 with 2.6 and with 2.8 times transfer function 2."""
    found = []
    for gain, source in ((2.6, 'text and Eq. (14)'), (2.8, 'Table 1')):
        gives = _saw_tooth_bias(results, 'T3a', {'torque_share.circuit.g_4': gain})
        found.append(Interpretation(f'{gain:g}, {source}', gives,
                                    gives['low_V'] == 0.0
                                    and gives['time_at_zero_percent'] >= SIGNIFICANT_TIME))
    return found, {'times': [item.gives['time_at_zero_percent'] for item in found]}


def bias_pot(results: Results, published: Mapping[str, float]) -> _Judged:
    """Try the two published bias pots and the one that Fig. 20 needs."""
    most = results.drives[OLD_CIRCUIT].torque_share.circuit.saturation_high
    found = []
    for pot, source in ((0.7, 'Fig. 15'), (0.8, 'Eq. (9)'), (0.892, 'what 11.6 V of 13 V needs')):
        old, new = (_saw_tooth_bias(results, name, {_POT: pot}) for name in ('T3a', 'T3b'))
        gives = {'T3a_high_V': old['high_V'], 'T3b_low_V': new['low_V'],
                 'T3b_high_V': new['high_V']}
        found.append(Interpretation(
            f'{pot:g}, {source}', gives, _close(gives, published, dict.fromkeys(published, 0.2))))
    used = ' and '.join(f'{experiments()[name].settings[_POT]:g} in {name}'
                        for name in ('T3a', 'T3b'))
    return found, {'most': most, 'shares': [volts / most for volts in (10.4, 11.6, 11.2)],
                   'used': used}


def fade_out_voltage(results: Results, published: Mapping[str, float]) -> _Judged:
    """Try the fade-out voltage of DSS-13 in the tests, which were made at DSS-26."""
    found, points = [], []
    own = results.drives[OLD_CIRCUIT].torque_share.circuit.fade_out_voltage
    for volts, source in ((-9.0, 'as implemented at DSS 13'), (-11.0, 'Fig. 15(a)'),
                          (own, 'of this configuration')):
        changes = {'torque_share.circuit.fade_out_voltage': volts}
        old, new = (_saw_tooth_bias(results, name, changes) for name in ('T3a', 'T3b'))
        gives = {'T3a_time_at_zero_percent': old['time_at_zero_percent'],
                 'T3b_low_V': new['low_V'], 'T3b_high_V': new['high_V']}
        found.append(Interpretation(f'{volts:g} V, {source}', gives,
                                    _close(gives, published, {'T3b_low_V': 0.2})))
        points.append((gives['T3b_low_V'], volts))
    lowest, levels = np.array(sorted(points)).T
    ends = np.interp((7.0, 7.4), lowest, levels, left=np.nan, right=np.nan)
    needed = ('a voltage beyond the readings' if np.isnan(ends).any() else
              f'{ends[0]:.2f} to {ends[1]:.2f} V, interpolated between the readings')
    return found, {'needed': needed}


def torque_unit(results: Results, published: Mapping[str, float]) -> _Judged:
    """Compare the readings of 'kGm' by the power that a motor would need."""
    ratio = results.drives[OLD_CIRCUIT].plant.axis.gear_ratio
    greatest_rate = SAW_TOOTH['amplitude'] / SHARE_OF_GREATEST_RATE * ratio
    found = []
    for words, unit in (('kilogram-force metres', STANDARD_GRAVITY), ('pound-inches', POUND_INCH)):
        power = GREATEST_TORQUE * unit * greatest_rate / 1e3
        # the drives of a 34-m antenna are motors of some kilowatts
        found.append(Interpretation(words, {'torque_N_m': GREATEST_TORQUE * unit,
                                            'power_of_a_motor_kW': power},
                                    power < _LARGEST_MOTOR_KW))
    powers = [item.gives['power_of_a_motor_kW'] for item in found]
    return found, {'powers': powers, 'both': 2e-3 * powers[0]}


def ampere(results: Results, published: Mapping[str, float]) -> _Judged:
    """Test whether the article's ampere is a real one by the back-EMF that would follow."""
    drive = results.drives[OLD_CIRCUIT]
    greatest_rate = SAW_TOOTH['amplitude'] / SHARE_OF_GREATEST_RATE * drive.plant.axis.gear_ratio
    torque = TORQUE_PER_AMPERE * POUND_INCH
    kappa = drive.motor_1.armature.physical_amperes_per_article_ampere
    limit = drive.motor_1.armature.voltage_limit
    found = []
    for words, real in (('one real ampere', 1.0), (f'{kappa:g} real amperes', kappa)):
        back_emf = torque / real * greatest_rate
        found.append(Interpretation(words, {'torque_constant_N_m_per_real_A': torque / real,
                                            'back_emf_at_greatest_rate_V': back_emf},
                                    back_emf < limit))
    voltages = [item.gives['back_emf_at_greatest_rate_V'] for item in found]
    return found, {'torque': torque, 'voltages': voltages, 'kappa': kappa, 'limit': limit}


def place_of_friction(results: Results, published: Mapping[str, float]) -> _Judged:
    """Compare friction at the motors with friction at the axis."""
    experiment = experiments()['T4a']
    drive = experiment.applied_to(results.drives[OLD_CIRCUIT])
    own, on_axis = drive.motor_1.motor.coulomb_torque, drive.plant.axis.coulomb_torque
    total = own + 0.5 * on_axis
    found = []
    for words, at_motor in ((f'{own:.3g} article A at each motor, '
                             f'{on_axis:.3g} article A at the axis', own),
                            (f'{total:.3g} article A at each motor, none at the axis', total)):
        changes = {f'motor_{m}.motor.coulomb_torque': at_motor for m in (1, 2)}
        run = simulate(changed(drive, {**changes, 'plant.axis.coulomb_torque':
                                       2.0 * (total - at_motor)}), experiment.duration)
        greatest = drive.motor_1.motor.current_limit * drive.motor_1.motor.torque_constant
        torque = (run['motor_2/gear_torque'] - run['motor_1/gear_torque']) / greatest
        response = readings.step_response(
            run.time, run['motor_2/current'] - run['motor_1/current'])
        gives = {'bias_at_the_gears_percent': float(100.0 * torque[run.time > run.time[-1] - 1.0]
                                                    .mean()),
                 'overshoot_percent': 100.0 * response.overshoot}
        found.append(Interpretation(words, gives,
                                    _close(gives, published, {'overshoot_percent': 5.0})))
    return found, {'current': 0.5 * BIAS_PERCENT / 100.0 * drive.motor_1.motor.current_limit,
                   'own': own, 'total': total,
                   'at_gears': [item.gives['bias_at_the_gears_percent'] for item in found]}


def saw_tooth(results: Results, published: Mapping[str, float]) -> _Judged:
    """Compare a saw-tooth that rises and falls with one that jumps, Fig. 18."""
    found = []
    for words, waveform in (('symmetric, from zero, rising', 'saw_tooth'),
                            ('with a jump', 'saw_tooth_jump')):
        gives = _saw_tooth_bias(results, 'T3b', {'test_signal.rate.waveform': waveform})
        found.append(Interpretation(words, gives, _close(gives, published,
                                                         {'low_V': 0.2, 'high_V': 0.2})))
    return found, {'lows': [item.gives['low_V'] for item in found]}


def gear_ratio(results: Results, published: Mapping[str, float]) -> _Judged:
    """Compare the gear ratios that two pairs of figures give."""
    used = results.drives[OLD_CIRCUIT].plant.axis.gear_ratio
    # each pair is given to two or three figures
    found = [Interpretation(words, {'gear_ratio': ratio, 'used': used},
                            abs(ratio / used - 1.0) <= rounding)
             for words, ratio, rounding in (
                 ('193 deg/s over 0.013 deg/s', 193.0 / 0.013, 0.5 / 13.0),
                 ("9.1e5 'kGm' over 61 'kGm'", AXIS_FRICTION / TORQUE_PER_AMPERE,
                  0.05 / 9.1 + 0.5 / 61.0))]
    return found, {'used': used}


# By the short names of contradictions.yaml.
_ALL: dict[str, Callable[[Results, Mapping[str, float]], _Judged]] = {
    'filter_1_units': filter_1_units, 'filter_1_literal': filter_1_literal,
    'stability_limit': stability_limit_units, 'k_2': gain_k_2, 'k_p': bias_pot,
    'f_o': fade_out_voltage, 'kGm': torque_unit, 'ampere': ampere,
    'place_of_friction': place_of_friction, 'saw_tooth': saw_tooth, 'gear_ratio': gear_ratio}


def contradictions(results: Results, only: Iterable[str] = ()) -> list[Contradiction]:
    """
    Run the readings of every contradiction.

    results : of the parameter set
    only : short names; all if empty
    """
    table = read_yaml(Path(__file__).with_suffix('.yaml'))
    entries = []
    for name in tuple(only) or _ALL:
        text = table[name]
        found, figures = _ALL[name](results, text['published'])
        conclusion = text['conclusion'].format(fits=_which(found), **figures)
        entries.append(Contradiction(name, text['passages'], text['published'], tuple(found),
                                     conclusion))
    return entries
