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
Sizes that a truth and a verdict both state: as the number of the same thing in the same unit.

Comparable are changes of a constant, and numbers of a law that the trial's antenna and the
catalogue share. Left out are effects whose laws differ (viscous and Stribeck friction, friction
by load, tight spots, dead zones, worn bull gears), waves, whose amplitude a verdict states in
parts, and gusts, which have no size in a verdict. Under family B, all effects of another law are
left out too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from antenna_drive.trial.effect import Parameters
from antenna_drive.trial.family_b import LAWS
from antenna_drive.trial.machine import DESIGN, nominal
from antenna_drive.trial.verdict import Interval, Verdict


class Size(NamedTuple):
    """How a verdict states the size of an effect."""

    parameter: str                              # of the verdict, behind the effect's id
    unit: str
    of: Callable[[Parameters], float]           # from the quantities of the truth


class StatedSize(NamedTuple):
    """The size of an effect: the true one, and what a verdict says."""

    effect: str
    true: float
    stated: Interval

    @property
    def relative_error(self) -> float:
        """Return the size of the error over the true size."""
        return abs(self.stated.value - self.true) / abs(self.true)

    @property
    def covered(self) -> bool:
        """Return whether the 95 percent interval holds the true size."""
        return self.stated.low <= self.true <= self.stated.high


def _relative(parameter: str = 'change') -> Size:
    return Size(parameter, '1', lambda values: values['factor'] - 1.0)


def _same(parameter: str, quantity: str, unit: str) -> Size:
    return Size(parameter, unit, lambda values: values[quantity])


_BY_NAME: Mapping[str, Size] = {
    'friction_asymmetry': _same('share', 'share', '1'),
    'torque_constant': _relative(),
    'armature_resistance': Size(
        'change', 'ohm',
        lambda values: (values['factor'] - 1.0) * nominal('motors', 'resistance')),
    'amplifier_gain': _relative(),
    'amplifier_offset': _same('offset', 'voltage', 'V'),
    'current_limit': _relative(),
    'gap': _relative(),
    'stiffness': _relative(),
    'hysteresis': _same('share', 'share', '1'),
    'bias_pot': _relative(),
    'fade_out_voltage': Size(
        'change', '1', lambda values: values['shift'] / nominal('circuit', 'fade_out')),
    'share_filter': _relative('rate_change'),
    'filter_1_gain': _relative(),
    'filter_1_pole': _relative(),
    'gravity_imbalance': _same('torque', 'torque', 'N m'),
    'wind_steady': _same('torque', 'torque', 'N m'),
    'inertia': _relative(),
    'mode_damping': _relative('factor'),
    'extra_mode': _same('inertia', 'inertia', 'kg m^2'),
    'gain': _same('change', 'error', '1'),
    'offset': _same('offset', 'offset', ''),
    'quantisation': _same('step', 'step', 'rad'),
    'delay': _same('error_time', 'delay', 's')}
_COULOMB = {
    'axis': _relative(),
    'motor': Size('torque', 'A', lambda values: (
        (values['factor'] - 1.0) * DESIGN['motor_coulomb']))}


def size_of(effect: str, values: Parameters) -> Size | None:
    """
    Return how a verdict states the size of an effect; None if it is not comparable.

    Parameters
    ----------
    effect
        id
    values
        its quantities in the truth

    """
    component, name = effect.split('.', 1)
    if name == 'coulomb_friction':
        return _COULOMB['axis' if component == 'axis' else 'motor']
    if name == 'mode_frequency':
        return _relative(f'change_{int(values["mode"])}')
    return _BY_NAME.get(name)


def stated_sizes(truth: Mapping[str, Any], verdict: Verdict) -> list[StatedSize]:
    """
    Return the sizes of the true effects that the first entry of a verdict names and states.

    Parameters
    ----------
    truth
        of the case
    verdict
        of the case

    """
    first, found = verdict.which[0], []
    for entry in truth['effects']:
        key = entry['id']
        if key not in first.effects or (
                truth.get('family') == 'b' and key.split('.')[1] in LAWS):
            continue
        size = size_of(key, entry['parameters'])
        stated = first.parameters.get(f'{key}.{size.parameter}') if size else None
        if size and stated and size.unit in ('', stated.unit):
            found.append(StatedSize(key, size.of(entry['parameters']), stated))
    return found
