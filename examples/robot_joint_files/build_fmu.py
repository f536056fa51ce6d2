# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Build joint.fmu from joint.c with the C compiler of this machine.

  python examples/robot_joint_files/build_fmu.py 3 examples/robot_joint_files

writes joint.fmu of FMI 3 (or 2) into that folder. The headers of the standard are fmpy's.
"""

from __future__ import annotations

import os
from pathlib import Path
import re
import subprocess
import sys
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZipFile

import fmpy

SOURCE = Path(__file__).resolve().parent / 'joint.c'
TOKEN = '{2f6c3c1e-6f0b-4f57-9d0b-6d1c2b7f5a11}'
# Name, causality, variability and start, in the order of the value references in joint.c.
VARIABLES = (
    ('reference', 'input', 'continuous', 0.0), ('push', 'input', 'continuous', 0.0),
    ('load', 'parameter', 'fixed', 3e-4), ('coulomb', 'parameter', 'fixed', 0.03),
    ('viscous', 'parameter', 'fixed', 8e-4), ('compliance', 'parameter', 'fixed', 0.0),
    ('half_gap', 'parameter', 'fixed', 0.0), ('load_friction', 'parameter', 'fixed', 0.0),
    ('motor_angle', 'output', 'continuous', None), ('torque', 'output', 'continuous', None),
)


def description(version: int) -> str:
    """Return modelDescription.xml."""
    lines, outputs, unknowns = [], [], []
    for k, (name, causality, variability, start) in enumerate(VARIABLES):
        given = '' if start is None else f' start="{start!r}"'
        attributes = (f'name="{name}" valueReference="{k}" causality="{causality}" '
                      f'variability="{variability}"')
        if version == 2:
            lines.append(f'<ScalarVariable {attributes}><Real{given}/></ScalarVariable>')
        else:
            lines.append(f'<Float64 {attributes}{given}/>')
        if causality == 'output':
            outputs.append(f'<Unknown index="{k + 1}"/>' if version == 2 else
                           f'<Output valueReference="{k}"/>')
            unknowns.append(f'<InitialUnknown valueReference="{k}"/>')
    if version == 2:
        token = 'guid'
        structure = (f'<Outputs>{"".join(outputs)}</Outputs>'
                     f'<InitialUnknowns>{"".join(outputs)}</InitialUnknowns>')
    else:
        token, structure = 'instantiationToken', ''.join(outputs + unknowns)
        lines.append(f'<Float64 name="time" valueReference="{len(VARIABLES)}" '
                     'causality="independent" variability="continuous"/>')
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription '
            f'fmiVersion="{version}.0" modelName="joint" {token}="{TOKEN}">\n'
            '<CoSimulation modelIdentifier="joint" canHandleVariableCommunicationStepSize="true"/>'
            f'\n<ModelVariables>\n{chr(10).join(lines)}\n</ModelVariables>\n'
            f'<ModelStructure>{structure}</ModelStructure>\n</fmiModelDescription>\n')


def refusals(version: int, headers: Path) -> str:
    """Return C functions that refuse; an FMU has all functions of the standard."""
    named = set(re.findall(rf'(fmi{version}[A-Z]\w*)TYPE\s*\(?',
                           (headers / f'fmi{version}FunctionTypes.h').read_text()))
    made = set(re.findall(rf'^\S.*?\b(fmi{version}[A-Z]\w*)\(', SOURCE.read_text(), re.M))
    return ''.join(f'int {name}(void) {{ return 3; }}\n' for name in sorted(named - made))


def build(version: int, folder: str | Path) -> Path:
    """Write joint.fmu of FMI 2 or 3 into a folder; return its path."""
    headers = Path(fmpy.__file__).parent / 'c-code'
    platform = fmpy.platform if version == 2 else fmpy.platform_tuple
    made = Path(folder) / 'joint.fmu'
    with TemporaryDirectory() as scratch:
        other, library = Path(scratch, 'refusals.c'), Path(scratch, 'joint.so')
        other.write_text(refusals(version, headers))
        subprocess.run([os.environ.get('CC', 'cc'), '-O2', '-shared', '-fPIC', f'-I{headers}',
                        f'-DFMI_VERSION={version}', str(SOURCE), str(other), '-o', str(library),
                        '-lm'], check=True)
        with ZipFile(made, 'w', ZIP_DEFLATED) as archive:
            archive.writestr('modelDescription.xml', description(version))
            archive.write(library, f'binaries/{platform}/joint{fmpy.sharedLibraryExtension}')
    return made


if __name__ == '__main__':
    if len(sys.argv) != 3 or sys.argv[1] not in ('2', '3'):
        sys.exit('usage: build_fmu.py 2|3 FOLDER')
    print(build(int(sys.argv[1]), sys.argv[2]))
