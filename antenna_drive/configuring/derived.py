# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Every number of a configuration from a sheet, each with its source.

The greatest current of the drive is that of the reference drive in article amperes. So one article
ampere is another number of real ones, and the torque-share circuit keeps its shape against the
drive's greatest torque.
"""

from collections.abc import Iterator
import math
from typing import NamedTuple

from antenna_drive.configuring.sheet import FIGURES, Sheet
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import Drive
from antenna_drive.physics.arrays import FloatArray
import numpy as np
from scipy.optimize import brentq
from simgap.inputs.schema import ParameterError

_TWO_MOTORS = 2.0
# Bandwidths: corner of the integral below, and of the lag above, the bandwidth of the rate loop.
_INTEGRAL_BELOW, _LAG_ABOVE = 4.0, 10.0
# Between these the lowest resonance goes from near zero to that of a rigid structure.
_SCALES = 1e-3, 1e2


class Number(NamedTuple):
    """One entry of a configuration: its section and name, its value [SI], and where it is from."""

    section: str
    name: str
    value: float | tuple[float, ...]
    source: str


def reference(circuit: str) -> Drive:
    """Return the reference drive with the old or the new circuit."""
    return load(f'{circuit}_circuit')


def kappa(sheet: Sheet) -> float:
    """Return how many real amperes one article ampere of this drive is."""
    limit = reference(sheet.circuit).motor_1.motor.current_limit
    return sheet['amplifier.greatest_current'] / limit


def derived(sheet: Sheet) -> Iterator[Number]:
    """
    Yield every number that follows from a sheet; what is not yielded stays that of the reference.

    Raises ParameterError: the figures contradict one another; the message says which and the
    remedy.
    """
    drive = reference(sheet.circuit)
    yield from _motor(sheet, drive)
    yield from _gearbox(sheet, drive)
    yield from _axis(sheet, drive)
    yield from _friction(sheet, drive)
    yield from _loops(sheet, drive)


def _shown(sheet: Sheet, *keys: str) -> str:
    return ', '.join(f'{key} = {sheet.figures[key].written}' for key in keys)


def _as_given(sheet: Sheet, section: str, name: str, key: str) -> Number:
    return Number(section, name, sheet[key], f'sheet: {_shown(sheet, key)}')


def _motor(sheet: Sheet, drive: Drive) -> Iterator[Number]:
    real, limit = kappa(sheet), drive.motor_1.motor.current_limit
    constant = sheet['motor.torque_constant'] * real
    per_ampere = (f'derived: {_shown(sheet, "motor.torque_constant")} times {real:.4g} real '
                  'amperes')
    yield Number('armature', 'physical_amperes_per_article_ampere', real,
                 f'derived: {_shown(sheet, "amplifier.greatest_current")} over {limit:g} article '
                 'amperes')
    yield Number('motor', 'current_limit', limit,
                 'by definition: the greatest current is that of the reference drive in article '
                 'amperes')
    yield Number('motor', 'torque_constant', constant, per_ampere)
    for section in ('motor', 'axis'):
        yield Number(section, 'friction_torque_per_ampere', constant, per_ampere)
    yield _as_given(sheet, 'armature', 'resistance', 'motor.resistance')
    yield _as_given(sheet, 'armature', 'inductance', 'motor.inductance')
    yield _as_given(sheet, 'armature', 'voltage_limit', 'amplifier.greatest_voltage')
    if 'motor.back_emf' in sheet.figures:
        yield _as_given(sheet, 'armature', 'back_emf_constant', 'motor.back_emf')
    else:
        yield Number('armature', 'back_emf_constant', sheet['motor.torque_constant'],
                     'assumed: as large as the torque constant')
    yield _as_given(sheet, 'motor', 'rotor_inertia', 'motor.rotor_inertia')


def _stiffness(sheet: Sheet) -> float:
    """Return the stiffness of one gearbox at the motor shaft [N m/rad]."""
    given, ratio = sheet.figures['gear.stiffness'], sheet['gear.ratio']
    return given.value if given.at_motor else given.value / ratio**2


def _gearbox(sheet: Sheet, drive: Drive) -> Iterator[Number]:
    ratio, stiffness = sheet['gear.ratio'], _stiffness(sheet)
    backlash = sheet.figures['gear.backlash']
    motor, gearbox = drive.motor_1.motor, drive.motor_1.gearbox
    damping = gearbox.contact_damping / (
        2.0 * math.sqrt(gearbox.stiffness * motor.rotor_inertia))
    squared = '' if sheet.figures['gear.stiffness'].at_motor else ' over gear.ratio squared'
    times = '' if backlash.at_motor else ' times gear.ratio'
    yield _as_given(sheet, 'axis', 'gear_ratio', 'gear.ratio')
    yield Number('gearbox', 'stiffness', stiffness,
                 f'derived: {_shown(sheet, "gear.stiffness")}{squared}')
    yield Number('gearbox', 'half_gap',
                 0.5 * backlash.value * (1.0 if backlash.at_motor else ratio),
                 f'derived: half of {_shown(sheet, "gear.backlash")}{times}')
    yield Number('gearbox', 'contact_damping',
                 2.0 * damping * math.sqrt(stiffness * sheet['motor.rotor_inertia']),
                 f'assumed: damping ratio {damping:.3g} of rotor and gearbox, as in the reference')


def _axis(sheet: Sheet, drive: Drive) -> Iterator[Number]:
    axis, ratio = drive.plant.axis, sheet['gear.ratio']
    whole = axis.inertia_hub + sum(axis.mode_inertias)
    share = sheet['axis.inertia'] / whole
    hub, inertias = share * axis.inertia_hub, share * np.asarray(axis.mode_inertias)
    frequencies = np.asarray(axis.mode_frequencies)
    stiffness = _TWO_MOTORS * _stiffness(sheet) * ratio**2
    try:
        scale = mode_scale(hub, inertias, frequencies, stiffness, sheet['axis.first_resonance'])
    except ValueError:
        rigid = rigid_frequency(sheet['axis.inertia'], stiffness)
        raise ParameterError(
            f'{sheet.source}: axis.first_resonance: '
            f'{sheet.figures["axis.first_resonance"].written} given, but '
            f'{_shown(sheet, "axis.inertia", "gear.stiffness")} resonate at {rigid:.3g} Hz with '
            'the rotors held, even if the structure is rigid; one of the three is wrong') from None
    yield Number('axis', 'inertia_hub', hub,
                 f'derived: {_shown(sheet, "axis.inertia")}, hub and modes as in the reference')
    yield Number('axis', 'mode_inertias', tuple(inertias), 'derived: as the hub')
    yield Number('axis', 'mode_frequencies', tuple(scale * frequencies),
                 f'derived: {scale:.4g} times those of the reference give '
                 f'{_shown(sheet, "axis.first_resonance")}')


def _friction(sheet: Sheet, drive: Drive) -> Iterator[Number]:
    """Yield Coulomb and viscous friction from the currents at two rates."""
    real, rates = kappa(sheet), (sheet['friction.slow_rate'], sheet['friction.fast_rate'])
    currents = sheet['friction.slow_current'], sheet['friction.fast_current']
    if rates[1] <= rates[0]:
        raise ParameterError(f'{sheet.source}: friction.fast_rate: '
                             f'{sheet.figures["friction.fast_rate"].written} given, allowed is a '
                             'rate above friction.slow_rate')
    slope = (currents[1] - currents[0]) / (rates[1] - rates[0])
    level = currents[0] - slope * rates[0]
    if slope < 0.0 or level <= 0.0:
        raise ParameterError(
            f'{sheet.source}: friction.fast_current: '
            f'{sheet.figures["friction.fast_current"].written} given, allowed is between '
            f'friction.slow_current and {rates[1] / rates[0]:.3g} times it: friction that falls '
            'with the rate is that of creep, give two faster rates')
    motor, axis = drive.motor_1.motor, drive.plant.axis
    both = axis.coulomb_torque + _TWO_MOTORS * motor.coulomb_torque
    two = _shown(sheet, 'friction.slow_current', 'friction.fast_current')
    for section, part in (('axis', axis), ('motor', motor)):
        share = part.coulomb_torque / both  # type: ignore[attr-defined]
        yield Number(section, 'coulomb_torque', share * level / real,
                     f'derived: {two} are {level:.4g} real A at rate zero; '
                     f'{100 * share:.3g} percent of it, as in the reference')
        if 'friction.stiction_ratio' in sheet.figures:
            yield _as_given(sheet, section, 'stiction_ratio', 'friction.stiction_ratio')
    yield Number('axis', 'viscous_friction',
                 slope * sheet['motor.torque_constant'] * sheet['gear.ratio'],
                 f'derived: slope of {two} over the rates, times torque constant and gear.ratio; '
                 'all of it at the axis')


def _loops(sheet: Sheet, drive: Drive) -> Iterator[Number]:
    """Yield the gains of amplifiers and Filter 1 from bandwidths."""
    ratio, tachometer = sheet['gear.ratio'], sheet['amplifier.tachometer']
    wanted = 2.0 * math.pi * sheet['amplifier.rate_loop']
    inertia = sheet['motor.rotor_inertia'] + sheet['axis.inertia'] / (_TWO_MOTORS * ratio**2)
    constant = sheet['motor.torque_constant'] * kappa(sheet)
    gain = wanted * inertia / (tachometer * constant)
    yield _as_given(sheet, 'amplifier', 'tach_gain', 'amplifier.tachometer')
    k_s = drive.motor_1.rate_command.k_s
    yield Number('rate_command', 'k_1', tachometer * ratio / k_s,
                 f'derived: the tachometer times gear.ratio over k_s = {k_s:g}')
    yield Number('amplifier', 'rate_gain', gain,
                 f'derived: {_shown(sheet, "amplifier.rate_loop")} with {inertia:.4g} kg m^2 at '
                 'each motor shaft')
    found = {'amplifier.integral_time': _INTEGRAL_BELOW / wanted,
             'amplifier.lag': 1.0 / (_LAG_ABOVE * wanted)}
    for figure in FIGURES:
        if figure.key in found:
            own = sheet.get(figure.key)
            found[figure.key] = found[figure.key] if own is None else own
            yield Number('amplifier', figure.key.partition('.')[2], found[figure.key],
                         f'assumed: {figure.optional}' if own is None
                         else f'sheet: {_shown(sheet, figure.key)}')
    current = 2.0 * math.pi * sheet['amplifier.current_loop'] * sheet['motor.inductance']
    if current < sheet['motor.resistance']:
        slowest = sheet['motor.resistance'] / (2.0 * math.pi * sheet['motor.inductance'])
        raise ParameterError(
            f'{sheet.source}: amplifier.current_loop: '
            f'{sheet.figures["amplifier.current_loop"].written} given, but the armature alone has '
            f'{slowest:.3g} Hz: give at least that')
    yield Number('amplifier', 'current_feedback_gain', current - sheet['motor.resistance'],
                 f'derived: {_shown(sheet, "amplifier.current_loop")} times motor.inductance, '
                 'less motor.resistance')
    circuit, limit = drive.torque_share.circuit, drive.motor_1.motor.current_limit
    difference = circuit.bias_pot * circuit.saturation_high / (sheet['bias.share'] * limit)
    yield Number('filter_1', 'difference_gain', difference,
                 f'derived: {_shown(sheet, "bias.share")} of {limit:g} article A for '
                 f'{circuit.bias_pot:g} times {circuit.saturation_high:g} V')
    yield _bias_gain(sheet, drive, gain, difference, found, current)


def _bias_gain(sheet: Sheet, drive: Drive, gain: float, difference: float,
               found: dict[str, float], current: float) -> Number:
    amplifier, armature = drive.motor_1.amplifier, drive.motor_1.armature
    filter_1 = drive.torque_share.filter_1

    def size(omega: float, loop: float, integral_time: float, lag: float,
             current_lag: float) -> float:
        """Return how much the loop amplifies at a frequency [rad/s]; all times in s."""
        s = 1j * omega
        return abs(loop * (1.0 + 1.0 / (s * integral_time)) * filter_1.gain / (s + filter_1.pole)
                   / (1.0 + s * lag) / (1.0 + s * current_lag))

    before = (2.0 * amplifier.bias_command_gain * amplifier.rate_gain * filter_1.difference_gain,
              amplifier.integral_time, amplifier.lag,
              armature.inductance / (armature.resistance + amplifier.current_feedback_gain))
    crossing = float(brentq(lambda omega: size(omega, *before) - 1.0, 1e-3, 1e5))
    after = size(crossing, 2.0 * gain * difference, found['amplifier.integral_time'],
                 found['amplifier.lag'], sheet['motor.inductance'] / current)
    return Number('amplifier', 'bias_command_gain', 1.0 / after,
                  f'derived: the loop through Filter 1 crosses over at {crossing:.3g} rad/s with '
                  'held rotors, as in the reference')


def locked_rotor_frequency(hub: float, inertias: FloatArray, frequencies: FloatArray,
                           stiffness: float) -> float:
    """
    Return the lowest resonance of hub and modes on gearboxes whose rotors are held [Hz].

    hub : its inertia [kg m^2]
    inertias, frequencies : of each mode [kg m^2], with the hub held [Hz]
    stiffness : of all gearboxes together, at the axis [N m/rad]
    """
    springs = inertias * (2.0 * math.pi * frequencies) ** 2
    matrix = np.diag(np.concatenate([[stiffness + springs.sum()], springs]))
    matrix[0, 1:] = matrix[1:, 0] = -springs
    root = 1.0 / np.sqrt(np.concatenate([[hub], inertias]))
    lowest = np.linalg.eigvalsh(root[:, None] * matrix * root)[0]
    return math.sqrt(max(lowest, 0.0)) / (2.0 * math.pi)


def rigid_frequency(inertia: float, stiffness: float) -> float:
    """Return that resonance of a structure that does not bend [Hz]: no other one is higher."""
    return math.sqrt(stiffness / inertia) / (2.0 * math.pi)


def mode_scale(hub: float, inertias: FloatArray, frequencies: FloatArray, stiffness: float,
               wanted: float) -> float:
    """
    Return by what to multiply the frequencies of the modes for a lowest resonance [Hz].

    Raises ValueError: it is not below that of a rigid structure.
    """
    if wanted >= 0.999 * rigid_frequency(hub + float(inertias.sum()), stiffness):
        raise ValueError('not below that of a rigid structure')

    def miss(logarithm: float) -> float:
        return locked_rotor_frequency(
            hub, inertias, frequencies * math.exp(logarithm), stiffness) - wanted

    return math.exp(brentq(miss, *map(math.log, _SCALES), xtol=1e-10))
