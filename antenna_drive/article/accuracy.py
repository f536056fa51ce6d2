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
How far the lock-step is from the converged reference, on the article's experiments.

The reference is the same drive at a macro-step of `FINE_STEP`. Two things are measured: the rms
distance of every signal of T1 to T4, as a share of that signal's rms, and the gain of Filter 1
at which the torque bias becomes unstable (T4c), which a delay in the exchange would lower.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache

from antenna_drive.article.experiments import Experiment, experiments, filter_variant
from antenna_drive.emulator.run import Emulator, FINE_STEP, Run, simulate
import numpy as np

STEPS = (5e-4, 1e-3, 2e-3, 4e-3)
# Signals that are compared; a missed impulse is a correction of one scheme, not a signal.
_LEFT_OUT = ('test_signal/external_torque', 'missed_impulse')
# Both runs are compared at these times [s]: a multiple of every macro-step above.
_GRID = 4e-3

_OLD_POLE = 1.369863
# The limit is sought between these gains k' [1/s], to this width.
_GAINS = (120.0, 160.0)
_GAIN_WIDTH = 0.02


@dataclass(frozen=True)
class Distance:
    """The rms distance of a signal from the reference, as a share of the signal's rms."""

    experiment: str
    signal: str
    share: float


@lru_cache(maxsize=8)
def _reference(name: str) -> Run:
    return _kept(experiments()[name], FINE_STEP)


def _kept(experiment: Experiment, step_s: float) -> Run:
    return simulate(experiment.drive(), experiment.duration, step_s,
                    every=round(_GRID / step_s))


def distances(step_s: float, names: Iterable[str] | None = None,
              progress: Callable[[str], None] | None = None) -> list[Distance]:
    """
    Measure the distance of every signal of the experiments at a macro-step.

    Parameters
    ----------
    step_s
        macro-step [s], a whole part of 4 ms
    names
        of the experiments, all of T1 to T4 if left out
    progress
        told the name of each experiment as it begins

    """
    found = []
    for name in names or experiments():
        if progress:
            progress(name)
        reference = _reference(name)
        run = _kept(experiments()[name], step_s)
        for signal in run.names:
            if signal.endswith(_LEFT_OUT):
                continue
            size = float(np.sqrt(np.mean(reference[signal] ** 2)))
            error = float(np.sqrt(np.mean((run[signal] - reference[signal]) ** 2)))
            if size > 0.0:
                found.append(Distance(name, signal, error / size))
    return found


def stability_limit(step_s: float) -> float:
    """
    Return the gain k' [1/s] of Filter 1, at the old pole, at which the torque bias goes unstable.

    The loop is brought to its steady bias, where static friction holds the rotors; from there a
    small disturbance shrinks or grows, and the limit is where it does neither.

    Parameters
    ----------
    step_s
        macro-step [s]

    """
    low, high = _GAINS
    while high - low > _GAIN_WIDTH:
        gain = 0.5 * (low + high)
        if growth_rate(gain, step_s) > 0.0:
            high = gain
        else:
            low = gain
    return 0.5 * (low + high)


def growth_rate(gain: float, step_s: float, settled_s: float = 12.0, watched_s: float = 6.0,
                ) -> float:
    """
    Return how fast a small disturbance of the steady torque bias grows [1/s].

    Parameters
    ----------
    gain
        k' of Filter 1 [1/s]
    step_s
        macro-step [s]
    settled_s
        time given to the loop, at a stable gain, to become steady [s]
    watched_s
        time over which the disturbance is watched [s]

    """
    emulator = Emulator(filter_variant(_SETTLING_GAIN, _OLD_POLE).drive(), step_s)
    emulator.advance(round(settled_s / step_s))
    emulator.tune({'torque_share': {'filter_1.gain': gain, 'bias_source': 'fixed',
                                    'fixed_voltage': _bias_at(gain, emulator)}})
    _, samples = emulator.advance(round(watched_s / step_s))
    difference = (samples[:, emulator.names.index('motor_2/current'), 0]
                  - samples[:, emulator.names.index('motor_1/current'), 0])
    difference = difference - difference.mean()
    # the swing in the first and in the last third, once the quick transients are gone
    third = difference.size // 3
    middle, last = difference[third:2 * third], difference[2 * third:]
    return float(np.log(last.std() / middle.std()) / (third * step_s))


_SETTLING_GAIN = 45.4
# The disturbance [V], so small that static friction keeps on holding the rotors.
_DISTURBANCE = 1e-3


def _bias_at(gain: float, emulator: Emulator) -> float:
    """Return the bias voltage at which the present state is steady but for the disturbance."""
    counter_torque = emulator.now[emulator.names.index('torque_share/counter_torque'), 0]
    difference = (emulator.now[emulator.names.index('motor_2/current'), 0]
                  - emulator.now[emulator.names.index('motor_1/current'), 0])
    settings = emulator.units['torque_share'].settings()
    difference_gain = settings['filter_1.difference_gain'][1]
    assert isinstance(difference_gain, float)
    return float(difference_gain * difference + _OLD_POLE * counter_torque / gain) + _DISTURBANCE
