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
A machine of your own for the diagnosis: a simulation in, the missing effect out.

This is its public face; docs/own-machine.md leads through it step by step.
"""

from antenna_drive.machines.own.allowed_tests import own_tests, OwnTests
from antenna_drive.machines.own.checking import check_model, Checked
from antenna_drive.machines.own.declaration import (
    effect, form, free, known, machine, Model, ModelError, push, reading, ripple, shape, size,
    within,
)
from antenna_drive.machines.own.diagnose import diagnose_logs, pushes_found, summary_of
from antenna_drive.machines.own.gaps import without_gaps
from antenna_drive.machines.own.loading import load_model
from antenna_drive.machines.own.log import Log, LogError, OneTest, read_log, read_logs
from antenna_drive.machines.own.machine import OwnMachine
from antenna_drive.machines.own.named_numbers import Numbers
from antenna_drive.machines.own.unseen import Unseen, unseen

__all__ = [
    'check_model', 'Checked', 'diagnose_logs', 'effect', 'form', 'free', 'known', 'load_model',
    'Log', 'LogError', 'machine', 'Model', 'ModelError', 'Numbers', 'OneTest', 'OwnMachine',
    'own_tests', 'OwnTests', 'push', 'pushes_found', 'reading', 'read_log',
    'read_logs', 'ripple', 'shape', 'size', 'summary_of', 'Unseen', 'unseen',
    'within', 'without_gaps',
]
