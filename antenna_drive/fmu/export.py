# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the drive as an FMU, with PythonFMU for FMI 2 and PythonFMU3 for FMI 3."""

from hashlib import sha256
from importlib import import_module
from pathlib import Path
import sys
import tempfile

from antenna_drive.fmu.slave import DRIVE_FILE, drive_file
from antenna_drive.parameters.sets import Drive
from antenna_drive.recording.atomic import new_file

LIBRARIES = {2: 'pythonfmu', 3: 'pythonfmu3'}
# The module that the FMU's binary imports. It finds the class by the text of its first line.
_MODULE = '''\
"""The antenna drive as an FMU, written by antenna-drive fmu."""

import sys

import {library}
from {library} import Fmi{fmi}Slave

lacking = ''
try:
    from antenna_drive.fmu import slave
except ImportError as error:
    lacking = (f'this FMU needs antenna_drive in the Python that runs it, {{sys.executable}}: '
               f'{{error}}; install antenna_drive there')


class AntennaDrive(Fmi{fmi}Slave):
    def __init__(self, **known):
        super().__init__(**known)
        if lacking:
            print(lacking, file=sys.stderr)
            raise ImportError(lacking)
        self.drive = slave.joined(self, {library}, {fmi})

    def to_xml(self, *options):
        return slave.with_units(super().to_xml(*options), self.drive.variables)

    def do_step(self, time, step):
        slave.told(self.drive.step, step)
        return True
'''


def write_fmu(drive: Drive, path: Path, fmi: int, step_s: float) -> None:
    """
    Write a drive as an FMU for co-simulation.

    drive : as configured; its numbers are where the FMU's parameters start
    path : a file that is not there yet
    fmi : 2 or 3
    step_s : macro-step [s]

    Raises ParameterError: the macro-step is not allowed.
    Raises RecordingError: the file is there already or cannot be written.
    Raises ModuleNotFoundError: the library is not installed.
    """
    builder = import_module(LIBRARIES[fmi]).FmuBuilder
    text = drive_file(drive, step_s)
    # one process may load several FMUs, and Python has one module of a name
    module = f'antenna_drive_fmi{fmi}_{sha256(text.encode()).hexdigest()[:16]}'
    with new_file(path) as stream, tempfile.TemporaryDirectory() as folder:
        source = Path(folder, f'{module}.py')
        source.write_text(_MODULE.format(library=LIBRARIES[fmi], fmi=fmi), encoding='utf-8')
        Path(folder, DRIVE_FILE).write_text(text, encoding='utf-8')
        places = list(sys.path)
        try:
            built = builder.build_FMU(
                source, folder, [Path(folder, DRIVE_FILE)],
                canHandleVariableCommunicationStepSize=False)
        finally:
            sys.path[:] = places
            sys.modules.pop(module, None)
        stream.write(Path(built).read_bytes())
