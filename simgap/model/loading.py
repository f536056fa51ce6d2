# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Load a model from a Python file, 'my_machine.py:machine', or from a model file in YAML."""

import importlib.util
from pathlib import Path
import sys
import traceback

from simgap.errors import UserError
from simgap.inputs.schema import nearest
from simgap.model.declared import Model, ModelError
from simgap.model.model_file import load_model_file


def load_model(place: str) -> Model:
    """
    Return the model of 'FILE.py:NAME', 'FILE.py' (NAME is machine) or 'FILE.yaml' (`model_file`).

    Raises ModelError if there is no such file or name, or the file fails; the message says at
    which line. Raises ModuleNotFoundError if mujoco or fmpy, which it needs, is missing.
    """
    if place.endswith(('.yaml', '.yml')):
        return load_model_file(Path(place))
    text, mark, name = place.rpartition(':')
    if not mark or not name.isidentifier():
        text, name = place, 'machine'
    path = Path(text).resolve()
    if not path.is_file() or path.suffix != '.py':
        raise ModelError(f'--model {place}: no such Python file; give FILE.py:NAME, or '
                         'FILE.yaml')
    title = f'simgap_model_{path.stem}'
    spec = importlib.util.spec_from_file_location(title, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # compiled functions and modules beside the file are found as in a program that is run
    sys.modules[title] = module
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    except UserError as error:
        raise ModelError(f'{text}: {error}') from None
    except Exception as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__)
                 if frame.filename == str(path)]
        if isinstance(error, SyntaxError):
            lines = [error.lineno]
        where = f'line {lines[-1]}: ' if lines else ''
        raise ModelError(f'{text}: {where}{type(error).__name__}: {error}') from error
    found = getattr(module, name, None)
    if not isinstance(found, Model):
        models = [key for key, value in vars(module).items() if isinstance(value, Model)]
        raise ModelError(f'{text}: {name} is no machine{nearest(name, models)}; write '
                         f'{name} = machine(simulate=..., base=..., readings=...)')
    return found
