# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Says why a real machine and its simulation part: where, which effect, and how far it shrinks.

A `Model` is a simulation with what is known of its numbers, and `Effect`s that it may lack. Each
test of the real machine is a `Log`. `diagnose` says in a `Verdict` which effect closes the gap.
`propose` designs the test that separates the answers of a verdict, a `Proposal`:

>>> import simgap
>>> model = simgap.load_model('first.py:machine')                   # doctest: +SKIP
>>> logs = simgap.read_logs(['steps.csv', 'sweep.csv'])             # doctest: +SKIP
>>> print(simgap.check(model, logs).summary())                               # doctest: +SKIP
>>> verdict = simgap.diagnose(model, logs)                          # doctest: +SKIP
>>> print(verdict.summary())                                        # doctest: +SKIP
>>> proposal = simgap.propose(model, verdict)                       # doctest: +SKIP

examples/robot_joint/first.py is the whole in one file. A name is loaded when it is first used.
"""

import importlib
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from simgap.model import (
        check_model as check, diagnose_logs as diagnose, Effect, effect, form, free, investigate,
        known, load_model, Log, machine as declare, Model, Numbers, OneTest, propose, push,
        read_log, read_logs, reading, ripple, shape, size, unseen, within,
    )
    from simgap.next_test.candidate import Proposal
    from simgap.verdict.record import Verdict

__version__ = '0.1.0'
__all__ = [
    'check', 'declare', 'diagnose', 'effect', 'Effect', 'form', 'free', 'investigate', 'known',
    'load_model', 'Log', 'Model', 'Numbers', 'OneTest', 'Proposal', 'propose', 'push', 'read_log',
    'read_logs', 'reading', 'ripple', 'shape', 'size', 'unseen', 'Verdict', 'within',
]
_ELSEWHERE = {'Proposal': 'simgap.next_test.candidate', 'Verdict': 'simgap.verdict.record'}
_NAMES = {'check': 'check_model', 'declare': 'machine', 'diagnose': 'diagnose_logs'}


def __getattr__(name: str) -> Any:
    """Load what a name means: a node that imports `simgap.errors` does not wait for scipy."""
    if name not in __all__:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    module = importlib.import_module(_ELSEWHERE.get(name, 'simgap.model'))
    return getattr(module, _NAMES.get(name, name))
