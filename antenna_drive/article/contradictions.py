# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Where the article disagrees with itself: what each reading of it gives, to be run again.

Every entry names the passage, the readings that it allows, and the figures that decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from antenna_drive.article import readings
from antenna_drive.article.experiments import (
    experiments, GAINS, SAW_TOOTH, TABLE_1_GAIN, TAU_6_NEW, TAU_6_OLD,
)
from antenna_drive.article.linear import bias_loop, growth, stability_limit
from antenna_drive.article.measures import OLD_CIRCUIT, Results
from antenna_drive.emulator.run import Run, simulate
from antenna_drive.parameters.sets import changed

# Newtons per kilogram force; newton metres per pound-inch.
STANDARD_GRAVITY = 9.80665
POUND_INCH = 0.1129848
# Section V: the saw-tooth's 0.685 deg/s is 85 percent of the maximal rate.
SHARE_OF_GREATEST_RATE = 0.85
# Section IV: the greatest torque and that of 1 A, in 'kGm'.
GREATEST_TORQUE, TORQUE_PER_AMPERE, AXIS_FRICTION = 308.0, 61.0, 9.1e5


@dataclass(frozen=True)
class Interpretation:
    """
    One way to read a passage.

    Attributes
    ----------
    reading : the way, in words
    gives : the figures that follow from it, with their units in their names
    fits : whether they agree with what the article publishes

    """

    reading: str
    gives: Mapping[str, float]
    fits: bool


@dataclass(frozen=True)
class Contradiction:
    """
    A passage that disagrees with another.

    Attributes
    ----------
    id : short name
    passages : what stands against what
    published : the figures that the readings are held against
    readings : what each reading gives
    conclusion : the reading that is used here, and why

    """

    id: str  # noqa: A003
    passages: str
    published: Mapping[str, float]
    readings: tuple[Interpretation, ...]
    conclusion: str


def _variant(results: Results, name: str, **settings: Any) -> Run:
    """Run an experiment with other settings of the torque-share circuit."""
    experiment = experiments()[name]
    drive = experiment.applied_to(results.drives[experiment.circuit])
    return simulate(changed(drive, {f'torque_share.circuit.{key}': value
                                    for key, value in settings.items()}), experiment.duration)


def _bias_range(run: Run) -> dict[str, float]:
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


_RESPONSE = {'overshoot_percent': 5.0, 'settling_s': 0.15}


def filter_1_units(results: Results) -> Contradiction:
    """Read the 1.369 s and 8.889 s of Table 1 against the 0.73 s and 0.1125 s of Section VI."""
    published = {'overshoot_percent': 80.0, 'settling_s': 2.4}
    found = []
    for words, gain, pole in (
            ("Table 1 as k'/(s + p): 4.54/(s + 1.369), p in 1/s", TABLE_1_GAIN, 1.369),
            ('Table 1 literally: 4.54/(1 + 1.369 s)', TABLE_1_GAIN / 1.369, 1.0 / 1.369),
            ('Table 1 as gain and time constant: 4.54/(s + 1/1.369)', TABLE_1_GAIN,
             1.0 / 1.369)):
        gives = _response(results, gain, pole)
        found.append(Interpretation(words, gives, _close(gives, published, _RESPONSE)))
    return Contradiction(
        'filter_1_units', 'Table 1: k_ctfr 4.54 and 66.67, tau_6 1.369 s and 8.889 s; Section '
        'VI: k_ctfr 3.31 and 48.67, tau_6 0.73 s and 0.1125 s', published, tuple(found),
        '1.369 and 8.889 are 1/tau_6 in 1/s, and 4.54 and 66.67 are k_ctfr/0.73: Table 1 is '
        "Filter 1 as k'/(s + p)")


def filter_1_literal(results: Results) -> Contradiction:
    """Return what Section VI's new filter gives, taken literally: it is unstable."""
    published = {'overshoot_percent': 0.0, 'settling_s': 0.8}
    found = []
    drive = results.drives[OLD_CIRCUIT]
    pole = 1.0 / TAU_6_NEW
    for words, gain in (('literally: 48.67/(1 + 0.1125 s)', 48.67 / TAU_6_NEW),
                        ('as Table 1: 48.67/0.73/(s + 8.889)', 48.67 / TAU_6_OLD)):
        gives = {'k_per_s': gain, 'limit_of_k_per_s': stability_limit(drive, pole),
                 'growth_per_s': growth(bias_loop(drive, gain, pole, rotors_held=True)),
                 **_response(results, gain, pole, 'T4e')}
        found.append(Interpretation(words, gives, gives['growth_per_s'] < 0.0
                                    and _close(gives, published, _RESPONSE)))
    return Contradiction(
        'filter_1_literal', 'Section VI: F_1 = k_ctfr/(1 + tau_6 s) with 48.67 and 0.1125 s; '
        'Table 1: 66.67 and 8.889', published, tuple(found),
        'with 0.1125 s put into Eq. (15) the gain at high frequencies is 6.5 times that of '
        "Table 1, beyond the stability limit; k' stays k_ctfr/0.73 while the pole changes")


def stability_limit_units(results: Results) -> Contradiction:
    """Ask whether the limit of 146 is k_ctfr of Section VI or of Table 1."""
    limit = stability_limit(results.drives[OLD_CIRCUIT], 1.0 / TAU_6_OLD)
    last = GAINS[-1]
    return Contradiction(
        'stability_limit', f'Section VI: k_ctfr > 146 is unstable; Fig. 21(e) has k_ctfr {last:g}',
        {'limit': 146.0},
        (Interpretation("as Table 1's k'", {'limit': limit, 'figure_21e': last / TAU_6_OLD},
                        abs(limit - 146.0) <= 3.0),
         Interpretation("as Section VI's k_ctfr", {'limit': limit * TAU_6_OLD,
                                                   'figure_21e': last},
                        abs(limit * TAU_6_OLD - 146.0) <= 3.0)),
        "106.03 is k' = 145.2, the last gain below the limit: 146 is k' of Table 1. The model's "
        'inductance is fitted to it, so that this reading is chosen and not found')


def gain_k_2(results: Results) -> Contradiction:
    """Ask whether transfer function 4 is 2.6 or 2.8 times transfer function 2."""
    published = {'low_V': 0.0, 'high_V': 10.4}
    found = []
    for gain, source in ((2.6, 'text and Eq. (14)'), (2.8, 'Table 1')):
        gives = _bias_range(_variant(results, 'T3a', g_4=gain))
        found.append(Interpretation(f'{gain:g}, {source}', gives,
                                    gives['low_V'] == 0.0
                                    and gives['time_at_zero_percent'] >= 10.0))
    return Contradiction(
        'k_2', 'Eq. (11) and Fig. 15: k_2 = 2.6; Table 1: 2.8 (old), and k_2 is also the name '
        'of the gain of transfer function 2', published, tuple(found),
        '2.8: it keeps the bias at zero for a significant time, as Fig. 19 shows; 2.6 is '
        "DSS-13's")


def bias_pot(results: Results) -> Contradiction:
    """Return what the two published bias pots give, and the one that Fig. 20 needs."""
    published = {'T3a_high_V': 10.4, 'T3b_low_V': 7.2, 'T3b_high_V': 11.6}
    found = []
    for pot, source in ((0.7, 'Fig. 15'), (0.8, 'Eq. (9)'), (0.892, 'what 11.6 V of 13 V needs')):
        old = _bias_range(_variant(results, 'T3a', bias_pot=pot))
        new = _bias_range(_variant(results, 'T3b', bias_pot=pot))
        gives = {'T3a_high_V': old['high_V'], 'T3b_low_V': new['low_V'],
                 'T3b_high_V': new['high_V']}
        found.append(Interpretation(
            f'{pot:g}, {source}', gives, _close(gives, published, dict.fromkeys(published, 0.2))))
    return Contradiction(
        'k_p', 'Eq. (9): k_p = 0.8; Fig. 15: 0.7; Fig. 19: 10.4 V (analysis), 11.2 V (field); '
        'Fig. 20: 11.6 V', published, tuple(found),
        'no one pot gives all: 10.4 V is 0.8 of 13 V, 11.6 V is 0.892 of it, and the 11.2 V of '
        'the field, 0.862 of it, cannot come from 0.8 either. Each figure has its own here')


def fade_out_voltage(results: Results) -> Contradiction:
    """Return what DSS-13's fade-out voltage gives in the tests, which were made at DSS-26."""
    found = []
    fitted = results.drives[OLD_CIRCUIT].torque_share.circuit.fade_out_voltage
    for volts, source in ((-9.0, 'as implemented at DSS 13'), (-11.0, 'Fig. 15(a)'),
                          (fitted, 'fitted')):
        old = _bias_range(_variant(results, 'T3a', fade_out_voltage=volts))
        new = _bias_range(_variant(results, 'T3b', fade_out_voltage=volts))
        gives = {'T3a_time_at_zero_percent': old['time_at_zero_percent'],
                 'T3b_low_V': new['low_V'], 'T3b_high_V': new['high_V']}
        found.append(Interpretation(f'{volts:g} V, {source}', gives,
                                    abs(gives['T3b_low_V'] - 7.2) <= 0.2))
    return Contradiction(
        'f_o', 'Fig. 15: f_o = -9 V, as implemented at DSS 13; Figs. 19 and 20 are from DSS 26',
        {'T3b_low_V': 7.2}, tuple(found),
        "-9 V is DSS-13's; DSS-26's figures want between -10.5 and -10.8 V")


def torque_unit(results: Results) -> Contradiction:
    """Ask whether 'kGm' can be kilogram-force metres."""
    ratio = results.drives[OLD_CIRCUIT].plant.axis.gear_ratio
    greatest_rate = SAW_TOOTH['amplitude'] / SHARE_OF_GREATEST_RATE * ratio
    found = []
    for words, unit in (('kilogram-force metres', STANDARD_GRAVITY), ('pound-inches', POUND_INCH)):
        power = GREATEST_TORQUE * unit * greatest_rate / 1e3
        # the drives of a 34-m antenna are motors of some kilowatts
        found.append(Interpretation(words, {'torque_N_m': GREATEST_TORQUE * unit,
                                            'power_of_a_motor_kW': power},
                                    power < 100.0))
    return Contradiction(
        'kGm', "Section IV: the maximal torque of a motor is 308 'kGm'", {}, tuple(found),
        'as kilogram-force metres the motors of one axis would take 1.2 megawatts at the '
        'greatest rate; as pound-inches 7 kW each, which is what such a drive has')


def ampere(results: Results) -> Contradiction:
    """Ask whether the article's ampere can be one: a torque constant is a back-EMF constant."""
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
    return Contradiction(
        'ampere', "Section IV: 1 A is 61 'kGm' of motor torque, 6.9 N m even as pound-inches",
        {}, tuple(found),
        'a motor of 6.9 N m/A has a back-EMF constant of 6.9 V s/rad and would need 1.4 kV at '
        'the greatest rate; the plotted ampere stands for about 6 real ones')


def place_of_friction(results: Results) -> Contradiction:
    """Ask whether the 1 A of friction can sit at each motor."""
    experiment = experiments()['T4a']
    drive = experiment.applied_to(results.drives[OLD_CIRCUIT])
    own, on_axis = drive.motor_1.motor.coulomb_torque, drive.plant.axis.coulomb_torque
    total = own + 0.5 * on_axis
    found = []
    for words, at_motor in ((f'{own:.3g} A at each motor, {on_axis:.3g} A at the axis', own),
                            (f'{total:.3g} A at each motor, none at the axis', total)):
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
        found.append(Interpretation(words, gives, abs(gives['overshoot_percent'] - 80.0) <= 5.0))
    return Contradiction(
        'place_of_friction', 'Fig. 7 and Section IV: 1 A of friction at each motor; Fig. 21: a '
        'bias of 22 percent, 0.56 A per motor, settles after an overshoot of 80 percent',
        {'overshoot_percent': 80.0}, tuple(found),
        'friction of 1 A at the motor cannot be overcome by 0.56 A: the rotors stand still, the '
        'gears feel nothing of the bias and nothing overshoots. Most of it is on the axis')


def saw_tooth(results: Results) -> Contradiction:
    """Ask whether the saw-tooth of Fig. 18 rises and falls, or jumps."""
    published = {'low_V': 7.2, 'high_V': 11.6}
    found = []
    experiment = experiments()['T3b']
    for words, waveform in (('symmetric, from zero, rising', 'saw_tooth'),
                            ('with a jump', 'saw_tooth_jump')):
        variant = replace(experiment, settings={**experiment.settings,
                                                'test_signal.rate.waveform': waveform})
        drive = variant.applied_to(results.drives[variant.circuit])
        gives = _bias_range(simulate(drive, variant.duration))
        found.append(Interpretation(words, gives, _close(gives, published,
                                                         {'low_V': 0.2, 'high_V': 0.2})))
    return Contradiction(
        'saw_tooth', "Section V: 'a saw-tooth wave ... of 0.685 deg/s and period of 5 s', Fig. 18",
        published, tuple(found), 'the triangle fits Fig. 20; the jump, which the word allows, '
        'does not, and is offered as a waveform of its own')


def gear_ratio(results: Results) -> Contradiction:
    """Return the gear ratios that two pairs of figures give."""
    used = results.drives[OLD_CIRCUIT].plant.axis.gear_ratio
    pairs = (('193 deg/s over 0.013 deg/s', 193.0 / 0.013),
             ("9.1e5 'kGm' over 61 'kGm'", AXIS_FRICTION / TORQUE_PER_AMPERE))
    # each pair is given to two or three figures
    rounding = (0.5 / 13.0, 0.05 / 9.1 + 0.5 / 61.0)
    return Contradiction(
        'gear_ratio', 'Section IV: 0.013 deg/s corresponds to 193 deg/s; 61 kGm to 9.1e5 kGm; '
        'the ratio itself is not given', {},
        tuple(Interpretation(words, {'gear_ratio': ratio, 'used': used},
                             abs(ratio / used - 1.0) <= share)
              for (words, ratio), share in zip(pairs, rounding)),
        'both agree with 14868 within their rounding. The second also takes the friction of '
        'one motor, 61, for that of the axis: with two motors it is twice 9.1e5')


_ALL: tuple[Callable[[Results], Contradiction], ...] = (
    filter_1_units, filter_1_literal, stability_limit_units, gain_k_2, bias_pot, fade_out_voltage,
    torque_unit, ampere, place_of_friction, saw_tooth, gear_ratio)


def contradictions(results: Results, only: Iterable[str] = ()) -> list[Contradiction]:
    """
    Run every contradiction's readings.

    Parameters
    ----------
    results
        of the parameter set
    only
        names of the functions of this module, all if there are none

    """
    wanted = tuple(only)
    return [entry(results) for entry in _ALL if not wanted or entry.__name__ in wanted]
