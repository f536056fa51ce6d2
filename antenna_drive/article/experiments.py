# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The article's experiments as data: command, circuit and initial state.

T1 and T2 are Section IV (Figs. 8-13), T3a and T3b Section V (Figs. 18-20), T4 Section VI
(Figs. 21-23). docs/article.md explains how each figure is obtained.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import math
from typing import Any

from antenna_drive.parameters import Drive, load
from antenna_drive.parameters.sets import changed

# Table 1 gives k' = k_ctfr / 0.73: Section VI's k_ctfr is k' times tau_6.
TAU_6_OLD = 0.73
TAU_6_NEW = 0.1125
# Table 1's k_ctfr, old [1/s]; Fig. 22's captions round it to 3.3 of Section VI's.
TABLE_1_GAIN = 4.54
# k_ctfr of Fig. 21 and tau_6 [s] of Fig. 22.
GAINS = (3.31, 33.14, 48.67, 69.60, 106.03)
LAGS = (0.73, 0.20, 0.1125, 0.073, 0.050)
# The square wave of Section IV and the saw-tooth of Section V.
SQUARE: dict[str, Any] = {'waveform': 'square', 'amplitude': math.radians(0.013), 'period': 6.3}
SAW_TOOTH: dict[str, Any] = {
    'waveform': 'saw_tooth', 'amplitude': math.radians(0.685), 'period': 5.0}
# The rate step whose overshoot measures the damping of the rate loop [rad/s].
RATE_STEP = math.radians(0.1)


@dataclass(frozen=True)
class DriveExperiment:
    """One experiment."""

    name: str  # as in the article's table of results, 'T3a'
    duration: float  # [s]
    circuit: str  # set in config/ that overrides the configuration
    # further settings, by dotted name in `Drive`
    settings: Mapping[str, Any] = field(default_factory=dict)
    # torque bias from a fixed source, as a share of the greatest current; None to use the circuit
    bias_share: float | None = None

    def drive(self, *configuration: str) -> Drive:
        """Return the drive of this experiment, built on the given files or on the reference."""
        return self.applied_to(load(*configuration, self.circuit))

    def applied_to(self, drive: Drive) -> Drive:
        """Return a drive that has this experiment's circuit, with its other settings applied."""
        settings = dict(self.settings)
        if self.bias_share is not None:
            settings['torque_share.circuit.bias_source'] = 'fixed'
            settings['torque_share.circuit.fixed_voltage'] = (
                self.bias_share * drive.motor_1.motor.current_limit
                * drive.torque_share.filter_1.difference_gain)
        return changed(drive, settings)


def _rate(waveform: Mapping[str, Any]) -> dict[str, Any]:
    return {f'test_signal.rate.{name}': value for name, value in waveform.items()}


def filter_variant(gain: float, pole: float) -> DriveExperiment:
    """Return T4 with another Filter 1: k' [1/s] and p [1/s]."""
    return DriveExperiment(f'T4 k {gain:.4g} p {pole:.4g}', 8.0, 'old_circuit', {
        'torque_share.circuit.bias_pot': 0.7,
        'torque_share.filter_1.gain': gain, 'torque_share.filter_1.pole': pole})


def experiments() -> dict[str, DriveExperiment]:
    """Return T1 to T4 by name."""
    square = _rate(SQUARE)
    saw_tooth = _rate(SAW_TOOTH)
    steady = {'torque_share.circuit.start': 'steady'}
    pot = 'torque_share.circuit.bias_pot'
    return {item.name: item for item in (
        DriveExperiment('T1', 4 * 6.3, 'old_circuit', square, 0.0),
        DriveExperiment('T2', 4 * 6.3, 'old_circuit', square, 0.15),
        DriveExperiment('T3a', 20.0, 'old_circuit', {**saw_tooth, **steady, pot: 0.8}),
        DriveExperiment('T3b', 20.0, 'new_circuit', {**saw_tooth, **steady, pot: 0.892}),
        DriveExperiment('T4a', 8.0, 'old_circuit', {pot: 0.7}),
        DriveExperiment('T4e', 8.0, 'new_circuit', {pot: 0.7}),
    )}


def filter_variants() -> dict[str, DriveExperiment]:
    """Return T4b and T4d by name: Filter 1 with the gains of Fig. 21, the lags of Fig. 22."""
    variants = {f'T4b {gain:g}': filter_variant(gain / TAU_6_OLD, 1.0 / TAU_6_OLD)
                for gain in GAINS}
    variants.update({f'T4d {lag:g}': filter_variant(TABLE_1_GAIN, 1.0 / lag) for lag in LAGS})
    return {name: replace(variant, name=name) for name, variant in variants.items()}


def rate_step() -> DriveExperiment:
    """Return a step of the rate command without bias, which the article does not have."""
    return DriveExperiment('step', 6.0, 'old_circuit', _rate(
        {'waveform': 'step', 'amplitude': RATE_STEP, 'start_after': 1.0}), 0.0)
