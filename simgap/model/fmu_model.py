# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""An FMU for co-simulation (FMI 2 or 3) as a simulation, called without a wrapper between."""

from collections.abc import Callable, Iterable, Mapping
import ctypes
from ctypes import c_bool, c_double, c_int, c_size_t, c_void_p
import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE, fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE, FMU2Slave,
)
from fmpy.fmi3 import FMU3Slave
import numpy as np
from simgap.errors import one_line
from simgap.inputs.schema import nearest
from simgap.machine.contract import FloatArray
from simgap.model.declared import ModelError
from simgap.model.simulator import Ports

_NUMBERS = {'2': ('Real',), '3': ('Float64',)}
# The greatest status with which a simulation goes on: a warning.
_WARNING = 1


class FmuModel:
    """A simulation with an .fmu file; ModelError if it cannot be used or lacks a variable."""

    parallel = False
    longest_step_s = math.inf

    def __init__(self, path: Path, ports: Ports) -> None:
        self._path = path
        self._said = ''
        # lives as long as this object
        self._folder = TemporaryDirectory(prefix='simgap_fmu_')
        try:
            described = fmpy.read_model_description(str(path), validate=False)
            fmpy.extract(str(path), self._folder.name)
        except Exception as error:  # fmpy and the libraries below it raise many kinds
            raise ModelError(f'{path}: no FMU that can be read: {one_line(error)}') from None
        self._version = described.fmiVersion[:1]
        if self._version not in _NUMBERS or described.coSimulation is None:
            raise ModelError(f'{path}: FMI {described.fmiVersion} for '
                             f'{"co-simulation" if described.coSimulation else "model exchange"} '
                             'given, allowed is FMI 2 or 3 for co-simulation; export it so')
        self._described = described
        self._variables = {item.name: item for item in described.modelVariables}
        self._places = self._references(ports.places)
        self.defaults = np.array([float(self._variables[name].start or math.nan)
                                  for name in ports.places])
        for name, key in ports.pushes.items():
            if name in ports.inputs:
                raise ModelError(f'{key}: {name}: a column of the log is fed into it; give the '
                                 'FMU an input of its own for the push')
        self._inputs = self._references({**ports.inputs, **ports.pushes}, 'input')
        self._outputs = self._references(ports.outputs)
        self._slave = self._instance()

    def run(self, values: FloatArray, start_s: float, step_s: float,
            inputs: FloatArray) -> FloatArray:
        outputs = np.full((len(inputs), self._outputs.size), np.nan)
        rows = np.ascontiguousarray(inputs, float)
        self._said = ''
        try:
            self._begin(values, start_s, rows)
        except FMICallException:
            return outputs
        put, get, step = self._calls()
        instance = self._slave.component
        into, reads = self._inputs, self._outputs
        into_at, reads_at = into.ctypes.data, reads.ctypes.data
        row, out = rows.ctypes.data, outputs.ctypes.data
        for k in range(len(rows)):
            if (put(instance, into_at, into.size, row) > _WARNING
                    or get(instance, reads_at, reads.size, out) > _WARNING):
                outputs[k:] = np.nan
                break
            row += rows.strides[0]
            out += outputs.strides[0]
            if k + 1 < len(rows) and not step(start_s + k * step_s, step_s):
                break
        return outputs

    def _begin(self, values: FloatArray, start_s: float, rows: FloatArray) -> None:
        """Put the instance back to its beginning, with the places written."""
        try:
            self._slave.reset()
        except FMICallException:  # it cannot, so another instance begins
            self._slave.freeInstance()
            self._slave = self._instance()
        there = np.isfinite(values)
        self._set(self._places[there], values[there])
        if self._version == '2':
            self._slave.setupExperiment(startTime=start_s)
            self._slave.enterInitializationMode()
        else:
            self._slave.enterInitializationMode(startTime=start_s)
        self._set(self._inputs, rows[0])
        self._slave.exitInitializationMode()

    def _set(self, references: FloatArray, values: Iterable[float]) -> None:
        put = self._slave.setReal if self._version == '2' else self._slave.setFloat64
        if references.size:
            put(references.tolist(), [float(value) for value in values])

    def _instance(self) -> Any:
        slave = FMU2Slave if self._version == '2' else FMU3Slave
        described = self._described
        try:
            made = slave(guid=described.guid, unzipDirectory=self._folder.name,
                         modelIdentifier=described.coSimulation.modelIdentifier,
                         instanceName=self._path.stem)
            if self._version == '2':
                made.instantiate(callbacks=_callbacks(self._say))
            else:
                made.instantiate(logMessage=lambda environment, status, category, text:
                                 self._say(text))
        except Exception as error:  # fmpy raises Exception itself
            raise ModelError(f'{self._path}: {one_line(error)} {self._said}; an FMU holds a '
                             f'library for each platform, this one is {fmpy.platform}') from None
        return made

    def _say(self, text: bytes | None) -> None:
        self._said = one_line((text or b'').decode(errors='replace'))

    def _calls(self) -> tuple[Callable[..., int], Callable[..., int], Callable[..., bool]]:
        """Return what sets the inputs, what reads the outputs, and what does a step [s], [s]."""
        library, instance = self._slave.dll, self._slave.component
        if self._version == '2':
            step2 = _function(library.fmi2DoStep, c_void_p, c_double, c_double, c_int)
            return (_function(library.fmi2SetReal, c_void_p, c_void_p, c_size_t, c_void_p),
                    _function(library.fmi2GetReal, c_void_p, c_void_p, c_size_t, c_void_p),
                    lambda at, over: step2(instance, at, over, 1) <= _WARNING)
        values = (c_void_p, c_void_p, c_size_t, c_void_p, c_size_t)
        put3 = _function(library.fmi3SetFloat64, *values)
        get3 = _function(library.fmi3GetFloat64, *values)
        step3 = _function(library.fmi3DoStep, c_void_p, c_double, c_double, c_bool,
                          *4 * (c_void_p,))
        # event, end, early return, time reached: the step writes into them, so they have to live
        # as long as it does
        cells = c_bool(), c_bool(), c_bool(), c_double()
        told = [ctypes.addressof(cell) for cell in cells]
        return (lambda one, names, count, row: put3(one, names, count, row, count),
                lambda one, names, count, row: get3(one, names, count, row, count),
                lambda at, over: (step3(instance, at, over, True, *told) <= _WARNING
                                  and not cells[1].value))

    def _references(self, names: Mapping[str, str], causality: str = '') -> Any:
        """Return the references of variables if they are numbers, and of a causality."""
        for name, key in names.items():
            if name not in self._variables:
                raise ModelError(f'{key}: {name}: no such variable'
                                 f'{nearest(name, self._variables)} in {self._path.name}')
            variable = self._variables[name]
            if variable.type not in _NUMBERS[self._version] or variable.dimensions:
                raise ModelError(f'{key}: {name}: a variable of type {variable.type}, allowed is '
                                 f'one number of type {_NUMBERS[self._version][0]}')
            if causality and variable.causality != causality:
                raise ModelError(f'{key}: {name}: its causality is {variable.causality}, allowed '
                                 f'is {causality}')
        return np.array([self._variables[name].valueReference for name in names], np.uint32)


def _callbacks(say: Callable[[bytes], None]) -> fmi2CallbackFunctions:
    """Return what an FMU of FMI 2 may call; it keeps standard output clean."""
    made = fmi2CallbackFunctions()
    made.logger = fmi2CallbackLoggerTYPE(
        lambda environment, instance, status, category, text: say(text))
    made.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    made.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
    return made


def _function(found: Any, *kinds: Any) -> Callable[..., int]:
    """Return a function of the library that takes addresses as plain numbers."""
    return ctypes.cast(found, ctypes.CFUNCTYPE(c_int, *kinds))
