# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The stability limit of the torque bias by simulation: a small disturbance grows or decays.

Only the sign of the growth counts, since friction and limits bound the amplitude. `linear` gives
the same limit from eigenvalues.
"""

from antenna_drive.article.experiments import filter_variant
from antenna_drive.article.linear import stability_limit
from antenna_drive.emulator.run import Emulator, MACRO_STEP
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters import Drive
import numpy as np

# A stable gain k' [1/s], at which the bias settles before it is disturbed.
_SETTLING_GAIN = 45.4
# The disturbance [V], so small that static friction keeps on holding the rotors.
_DISTURBANCE = 1e-3
# The limit is searched for within this share of the linear one, down to this width [1/s]. Far
# above the limit the disturbance is already large when the observation begins.
_SHARE = 0.1
_GAIN_WIDTH = 0.05


def growth_rate(drive: Drive, gain: float, pole: float, step_s: float = MACRO_STEP,
                settled_s: float = 12.0, watched_s: float = 6.0) -> float:
    """
    Return the growth rate of a small disturbance of the steady torque bias [1/s].

    drive : with the old circuit
    gain, pole : k' and p of Filter 1 [1/s]
    step_s : macro-step [s]
    settled_s : settling time at a stable gain before the disturbance [s]
    watched_s : time over which the disturbance is observed [s]
    """
    emulator = Emulator(filter_variant(_SETTLING_GAIN, pole).applied_to(drive), step_s)
    emulator.advance(round(settled_s / step_s))
    # the voltage that keeps the present state steady at the new gain
    difference_gain = drive.torque_share.filter_1.difference_gain
    counter_torque = emulator.now[emulator.names.index('torque_share/counter_torque'), 0]
    steady = (difference_gain * _difference(emulator, emulator.now[np.newaxis])[0]
              + pole * counter_torque / gain)
    emulator.tune({'torque_share': {'filter_1.gain': gain, 'bias_source': 'fixed',
                                    'fixed_voltage': float(steady + _DISTURBANCE)}})
    _, samples = emulator.advance(round(watched_s / step_s))
    difference = _difference(emulator, samples)
    swing = difference - difference.mean()
    # compare the second third with the last: the fast transients have decayed by then
    third = swing.size // 3
    middle, last = swing[third:2 * third], swing[2 * third:]
    if last.std() == 0.0:
        return float('-inf')
    return float(np.log(last.std() / middle.std()) / (third * step_s))


def _difference(emulator: Emulator, samples: FloatArray) -> FloatArray:
    """Return i_2 - i_1 [article A], shape (n,), of samples of shape (n, signals, 2)."""
    first, second = (emulator.names.index(f'motor_{m}/current') for m in (1, 2))
    return np.asarray(samples[:, second, 0] - samples[:, first, 0], np.float64)


def simulated_limit(drive: Drive, pole: float, step_s: float = MACRO_STEP) -> float:
    """
    Return the gain k' of Filter 1 above which a small disturbance grows [1/s].

    drive : with the old circuit
    pole : p of Filter 1 [1/s]
    step_s : macro-step [s]

    Returns the gain [1/s]; NaN if it is not within ten percent of the linear one.
    """
    linear = stability_limit(drive, pole)
    low, high = (1.0 - _SHARE) * linear, (1.0 + _SHARE) * linear
    if not growth_rate(drive, low, pole, step_s) < 0.0 < growth_rate(drive, high, pole, step_s):
        return float('nan')
    while high - low > _GAIN_WIDTH:
        gain = 0.5 * (low + high)
        if growth_rate(drive, gain, pole, step_s) > 0.0:
            high = gain
        else:
            low = gain
    return 0.5 * (low + high)
