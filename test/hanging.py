# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What happens to a test that hangs, as hooks of pytest; conftest.py registers them.

pytest-timeout raises in the main thread. This ends what the test has started, and the whole
process should compiled code keep the main thread from raising.
"""

from __future__ import annotations

from collections.abc import Generator
import faulthandler
import os
import sys

import leftovers
import pytest

# How long a test marked trial may take; setup.cfg has the limit of the others [s].
TRIAL_TIMEOUT_S = 3600.0
_STDERR = pytest.StashKey[int]()        # where faults are told, whatever is captured
_BEFORE = pytest.StashKey[set[int]]()   # processes that a test found running


def pytest_configure(config: pytest.Config) -> None:
    """Mark what is started from now on."""
    leftovers.mark(hasattr(config, 'workerinput'))
    config.stash[_STDERR] = os.dup(2)


def pytest_unconfigure(config: pytest.Config) -> None:
    """End what the tests have left running, and say what it was."""
    for command in leftovers.end(leftovers.started()):
        print(f'left running by the tests, ended: {command}', file=sys.stderr)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give trials their own limit."""
    for item in items:
        if item.get_closest_marker('trial') and not item.get_closest_marker('timeout'):
            item.add_marker(pytest.mark.timeout(TRIAL_TIMEOUT_S))


@pytest.hookimpl(tryfirst=True, hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, None, None]:
    """End the process, after telling where it is, if a test goes on at twice its time."""
    mark = item.get_closest_marker('timeout')
    known = item.config.pluginmanager.hasplugin('timeout')
    seconds = float(mark.args[0] if mark else known and item.config.getini('timeout') or 0.0)
    if seconds:
        faulthandler.dump_traceback_later(2.0 * seconds, exit=True,
                                          file=item.config.stash[_STDERR])
    item.stash[_BEFORE] = leftovers.started()
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None],
                              ) -> Generator[None, None, None]:
    """End what a test has started that came to no end: it would disturb those that follow."""
    yield
    if call.excinfo is not None and 'pytest-timeout' in str(call.excinfo.value):
        before = item.stash[_BEFORE]
        leftovers.end(leftovers.started() - before)
