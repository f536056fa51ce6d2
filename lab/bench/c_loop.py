# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The emulator's loop in plain C, compiled by the machine's own compiler: the limit."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import ctypes
import math
from pathlib import Path
import shutil
import subprocess
import tempfile
from typing import Any

from antenna_drive.emulator.units import build, inner_steps, SourceUnit
from antenna_drive.emulator.wiring import DRIVE, TEST_SIGNAL
from antenna_drive.parameters.sets import Axis, Drive, MODES_LIMIT, MotorDrive, Share
from antenna_drive.physics.arrays import FloatArray
import numpy as np
from simgap.errors import UserError

_SOURCE = Path(__file__).with_name('drive.c')
COMPILER = 'gcc'
FLAGS = ('-O2',)


class CDrive:
    """One drive, ready to be run by the C loop."""

    def __init__(self, library: ctypes.CDLL, drive: Drive) -> None:
        """Lay the parameters out as the C program reads them: doubles, one after another."""
        self._run = library.run
        self._run.argtypes = [ctypes.c_void_p, ctypes.c_long, ctypes.c_double, ctypes.c_int,
                              ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
        self._run.restype = None
        self._drive = drive
        self._parameters = np.array([*_motor(drive.motor_1), *_motor(drive.motor_2),
                                     *_share(drive.torque_share), *_axis(drive.plant.axis)])

    def prepared(self, duration: float, step_s: float, every: int) -> Callable[[], FloatArray]:
        """
        Compute the command over `duration` [s]; return what runs the loop by steps of `step_s`.

        It returns the samples of every `every`th step and those at t = 0, shape (n, signals, 2).
        """
        count = round(duration / step_s)
        unit = build(TEST_SIGNAL, self._drive)
        assert isinstance(unit, SourceUnit)
        first = unit.start(step_s)
        commands = np.concatenate((first[np.newaxis], unit.ahead(0, count)))

        def run() -> FloatArray:
            kept = np.empty((1 + count // every, len(DRIVE.signals), 2))
            self._run(self._parameters.ctypes.data, count, step_s, inner_steps(step_s), every,
                      commands.ctypes.data, kept.ctypes.data)
            return kept

        return run


@contextmanager
def compiled() -> Iterator[ctypes.CDLL]:
    """Compile the loop into a folder that is removed at the end; UserError where that fails."""
    compiler = shutil.which(COMPILER)
    if compiler is None:
        raise UserError(f'no {COMPILER} found: apt-get install gcc')
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder, 'drive.so')
        done = subprocess.run(
            [compiler, *FLAGS, '-shared', '-fPIC', str(_SOURCE), '-o', str(target), '-lm'],
            capture_output=True, text=True, check=False)
        if done.returncode:
            raise UserError(f'{_SOURCE}: {done.stderr.strip().splitlines()[0]}')
        yield ctypes.CDLL(str(target))


def _motor(p: MotorDrive) -> list[float]:
    amplifier, armature, motor, gear = p.amplifier, p.armature, p.motor, p.gearbox
    return [
        p.sign, p.gear_ratio, p.start_in_gap, p.rate_command.k_s * p.rate_command.k_1,
        p.rate_command.tau_1, amplifier.rate_gain, amplifier.integral_time, amplifier.lag,
        amplifier.current_feedback_gain, amplifier.tach_gain, amplifier.bias_command_gain,
        armature.resistance, armature.inductance, armature.back_emf_constant,
        armature.physical_amperes_per_article_ampere, armature.voltage_limit,
        motor.torque_constant, motor.current_limit, motor.rotor_inertia,
        motor.coulomb_torque * motor.friction_torque_per_ampere, motor.stiction_ratio,
        motor.velocity_threshold, gear.stiffness, gear.half_gap, gear.contact_damping]


def _share(p: Share) -> list[float]:
    circuit, filter_1 = p.circuit, p.filter_1
    return [
        circuit.bias_pot, circuit.fade_out_voltage, circuit.current_to_voltage,
        circuit.saturation_low, circuit.saturation_high, circuit.k_2, circuit.s_2, circuit.k_3,
        circuit.g_4, float(circuit.bias_source == 'fixed'), circuit.fixed_voltage,
        float(circuit.start == 'steady'), filter_1.gain, filter_1.pole, filter_1.difference_gain]


def _axis(p: Axis) -> list[float]:
    def padded(values: Any) -> list[float]:
        return [*values, *[0.0] * (MODES_LIMIT - len(values))]

    return [
        p.gear_ratio, p.inertia_hub,
        p.coulomb_torque * p.friction_torque_per_ampere * p.gear_ratio, p.stiction_ratio,
        p.velocity_threshold, float(p.mode_inertias_count), *padded(p.mode_inertias),
        *padded([2.0 * math.pi * f for f in p.mode_frequencies]),
        *padded(p.mode_damping_ratios), *padded(p.pointing_elevation),
        *padded(p.pointing_cross_elevation)]
