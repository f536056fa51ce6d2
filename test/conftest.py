# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What every test may count on: a ROS 2 domain of its own, on this machine alone."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import ExitStack
import os

import hanging
from hypothesis import settings
from installations import install_with_colcon, install_with_pip, Installation
from lab.campaign.domains import claimed_domain
import pytest

# Nothing here is judged by how long it takes: the first call of compiled code compiles.
settings.register_profile('antenna_drive', deadline=None)
settings.load_profile('antenna_drive')

# Fixtures of tests that no two workers run at the same time.
ONE_AT_A_TIME = {'session_domain', 'module_domain', 'fresh_domain', 'colcon_installation',
                 'pip_installation'}


def pytest_configure(config: pytest.Config) -> None:
    """Put the whole session, and every process that it starts, into a domain of its own."""
    ending = ExitStack()
    config.add_cleanup(ending.close)
    config.pluginmanager.register(hanging)
    os.environ['ROS_DOMAIN_ID'] = str(ending.enter_context(claimed_domain()))
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'


@pytest.hookimpl(tryfirst=True, hookwrapper=True)
def pytest_collection_modifyitems(
        config: pytest.Config, items: list[pytest.Item]) -> Generator[None, None, None]:
    """
    Say which tests a single worker of pytest-xdist runs, where there are several.

    What starts nodes or installs is one group, and the first: two drives at once would share the
    cores. Of the rest each file is a group, as its tests may share what is slow to make.
    """
    for item in items:
        alone = ONE_AT_A_TIME & set(getattr(item, 'fixturenames', ()))
        item.add_marker(pytest.mark.xdist_group('processes' if alone else item.path.name))
    yield
    if hasattr(config, 'workerinput'):
        if items and config.getoption('loadgroup') and '@' not in items[0].nodeid:
            raise pytest.UsageError('this pytest-xdist does not keep groups of tests together '
                                    'with this pytest: install the versions that setup.py names')
        items.sort(key=lambda item: not ONE_AT_A_TIME & set(getattr(item, 'fixturenames', ())))


@pytest.fixture(scope='session')
def session_domain() -> int:
    """Return the ROS 2 domain of this session, which is in the environment already."""
    return int(os.environ['ROS_DOMAIN_ID'])


@pytest.fixture(scope='module')
def module_domain() -> Iterator[int]:
    """Return a ROS 2 domain for what one file of tests starts, which must be told it."""
    with claimed_domain() as domain:
        yield domain


@pytest.fixture
def node_domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Put one test, and the processes that it starts, into a domain apart from the others."""
    with claimed_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain


@pytest.fixture
def fresh_domain(node_domain: int) -> int:
    """Return the same for a test that starts a whole drive, beside which no other one runs."""
    return node_domain


@pytest.fixture(scope='session')
def colcon_installation(tmp_path_factory: pytest.TempPathFactory) -> Installation:
    """Return the package as `colcon build` installs it."""
    return install_with_colcon(tmp_path_factory.mktemp('colcon'))


@pytest.fixture(scope='session')
def pip_installation(tmp_path_factory: pytest.TempPathFactory) -> Installation:
    """Return the package as `pip install .` installs it, for the Python of the tests."""
    return install_with_pip(tmp_path_factory.mktemp('pip'))
