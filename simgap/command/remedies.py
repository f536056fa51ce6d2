# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a plain installation may lack, and how to get it."""

from importlib.util import find_spec
from traceback import walk_tb

from simgap.errors import one_line

# By module. A package that needs more adds to it when it is imported.
REMEDIES = {module: f'pip install {name}' for module, name in {
    'yaml': 'PyYAML', 'jinja2': 'Jinja2', 'mujoco': 'mujoco', 'fmpy': 'fmpy', 'mcap': 'mcap',
    'rosbags': 'rosbags', 'mcap_protobuf': 'mcap-protobuf-support'}.items()}


def remedy(error: ImportError) -> str | None:
    """Return in one line what is missing, or does not load; None if the program is at fault."""
    missing = (error.name or '').partition('.')[0]
    if isinstance(error, ModuleNotFoundError) and missing in REMEDIES and not find_spec(missing):
        return f'needs {missing}: {REMEDIES[missing]}'
    loading = {frame.f_globals.get('__name__', '').partition('.')[0]
               for frame, _ in walk_tb(error.__traceback__)}
    return next((f'{name} does not load, {one_line(error, 500)}'
                 for name in REMEDIES if name in loading), None)
