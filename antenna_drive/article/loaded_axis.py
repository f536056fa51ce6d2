# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Figs. 2 and 17 from the dynamic model: motor torque against axial torque, on a loaded axis.

The rate command is zero. A torque on the axis rises and falls slowly enough for the circuits to
follow. The torques by Eq. (14) alone, for the same load, are given for comparison.
"""

from dataclasses import dataclass
from functools import lru_cache

from antenna_drive.article.experiments import DriveExperiment
from antenna_drive.article.static_profile import bias_voltage
from antenna_drive.emulator.run import MACRO_STEP, simulate
from antenna_drive.emulator.unit import FloatArray
from antenna_drive.parameters import Drive
import numpy as np
from numpy.typing import NDArray

# The torque bias of the three curves in each figure, as a share of the greatest motor torque.
SHARES = (0.1, 0.2, 0.3)
# The load rises and falls once in this time [s], to this share of the greatest axial torque.
PERIOD = 400.0
AMPLITUDE = 0.95
_KEPT_EVERY = 50
# The fade-out begins and ends at these shares of the bias without load.
_FADE_FROM, _FADE_TO = 0.9, 0.1
# Below this the motors count as unloaded, percent of the greatest torque.
_AT_NO_LOAD = 5


@dataclass(frozen=True)
class LoadedAxis:
    """One cycle of the load, from one extreme to the other and back."""

    load: FloatArray  # axial torque, percent of the greatest, shape (n,)
    torques: FloatArray  # of the two motors, percent of the greatest, shape (n, 2)
    rising: NDArray[np.bool_]  # True where the load rises, shape (n,)

    @property
    def bias(self) -> FloatArray:
        """Return the difference of the torques, percent of the greatest, shape (n,)."""
        return np.asarray(self.torques[:, 1] - self.torques[:, 0])

    @property
    def drive(self) -> FloatArray:
        """Return the mean of the torques, percent of the greatest, shape (n,)."""
        return np.asarray(self.torques.mean(axis=1))


def greatest_axial_torque(drive: Drive) -> float:
    """Return the greatest torque of both motors together on the axis [N m]."""
    motor = drive.motor_1.motor
    return 2.0 * motor.current_limit * motor.torque_constant * drive.plant.axis.gear_ratio


def bias_pot(drive: Drive, share: float) -> float:
    """Return the bias pot that gives a torque bias, as a share of the greatest torque."""
    greatest = drive.torque_share.circuit.saturation_high
    return (share * drive.motor_1.motor.current_limit
            * drive.torque_share.filter_1.difference_gain / greatest)


# Six cycles of one parameter set, and the same for a second one: figures and drawings share them.
@lru_cache(maxsize=12)
def loaded(drive: Drive, circuit: str, share: float) -> LoadedAxis:
    """
    Simulate the drive while the load rises and falls.

    drive : with one of the circuits
    circuit : the circuit's name
    share : torque bias at no load, as a share of the greatest torque
    """
    experiment = DriveExperiment(f'loaded axis {share:g}', 1.25 * PERIOD, circuit, {
        'torque_share.circuit.bias_pot': bias_pot(drive, share),
        'torque_share.circuit.start': 'steady',
        'test_signal.torque.waveform': 'saw_tooth',
        'test_signal.torque.amplitude': AMPLITUDE * greatest_axial_torque(drive),
        'test_signal.torque.period': PERIOD})
    run = simulate(experiment.applied_to(drive), experiment.duration, MACRO_STEP,
                   every=_KEPT_EVERY)
    # the first quarter brings the load from zero to its greatest value
    loop = run.time >= 0.25 * PERIOD
    torques = np.column_stack([run[f'motor_{m}/current'][loop] for m in (1, 2)])
    # the sign under which load and motor torque balance
    load = -run['test_signal/external_torque'][loop] / greatest_axial_torque(drive)
    return LoadedAxis(100.0 * load, 100.0 * torques / drive.motor_1.motor.current_limit,
                      np.asarray(np.gradient(load) > 0.0))


def by_equation_14(drive: Drive, share: float, load: FloatArray) -> FloatArray:
    """
    Return the torques of the motors by Eq. (14) alone: no friction, no filter, no dynamics.

    drive : with one of the circuits
    share : torque bias at no load, as a share of the greatest torque
    load : axial torque, percent of the greatest, shape (n,)

    Returns them in percent of the greatest torque, shape (n, 2).
    """
    most = drive.motor_1.motor.current_limit
    circuit = drive.torque_share.circuit
    volts = bias_voltage(circuit, 2.0 * most * load / 100.0) / circuit.bias_pot
    half = 50.0 * share * volts / circuit.saturation_high
    return np.column_stack([load - half, load + half])


def bias_at_rest(axis: LoadedAxis) -> float:
    """Return the torque bias where the motors carry no load, percent of the greatest torque."""
    return float(np.median(axis.bias[np.abs(axis.drive) < _AT_NO_LOAD]))


def fade_out(load: FloatArray, bias: FloatArray) -> tuple[float, float]:
    """
    Return the loads between which the bias fades from 90 to 10 percent of its value at no load.

    load : mean torque of the motors, percent of the greatest, shape (n,)
    bias : difference of their torques, shape (n,)
    """
    # the median in each percent of load: the currents swing when teeth meet or the axis breaks
    # away
    size = np.abs(load)
    bins = np.arange(0.0, size.max(), 1.0)
    place = np.digitize(size, bins)
    used = np.unique(place)
    medians = np.array([np.median(bias[place == k]) for k in used])
    share = medians / medians[:_AT_NO_LOAD].mean()
    centres = bins[used - 1] + 0.5
    return (float(centres[np.flatnonzero(share >= _FADE_FROM)[-1]]),
            float(centres[np.flatnonzero(share >= _FADE_TO)[-1]]))
