# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The public face of machines of your own for the diagnosis, see docs/own-machine.md."""

from simgap.logs.log import Log, LogError, OneTest, read_log, read_logs, without_gaps
from simgap.model.allowed_tests import OwnTests, propose
from simgap.model.bench import investigate, ModelBench
from simgap.model.checking import check_model, Checked
from simgap.model.declaration import (
    effect, form, free, known, machine, push, reading, ripple, shape, size, within,
)
from simgap.model.declared import Model, ModelError, Numbers, OwnEffect as Effect
from simgap.model.diagnose import diagnose_logs, pushes_found
from simgap.model.loading import load_model
from simgap.model.machine import OwnMachine
from simgap.model.unseen import Unseen, unseen

__all__ = [
    'check_model', 'Checked', 'diagnose_logs', 'effect', 'Effect', 'form', 'free', 'investigate',
    'known', 'load_model', 'Log', 'LogError', 'machine', 'Model', 'ModelBench', 'ModelError',
    'Numbers', 'OneTest', 'OwnMachine', 'OwnTests', 'propose', 'push', 'pushes_found', 'reading',
    'read_log', 'read_logs', 'ripple', 'shape', 'size', 'Unseen', 'unseen', 'within',
    'without_gaps',
]
