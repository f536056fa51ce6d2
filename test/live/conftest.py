# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The page in a browser beside a drive of its own, for each file of tests that asks for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from chromium import EXECUTABLE, Page
import pytest

if TYPE_CHECKING:
    from live_command import LiveCommand


@pytest.fixture(scope='module')
def live(module_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCommand]:
    """Return the command with a drive of its own, which all tests of a file share."""
    pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to look at')
    pytest.importorskip('tornado', reason='tornado is not installed: no page')
    from live_command import LiveCommand
    with LiveCommand(tmp_path_factory.mktemp('live'), module_domain) as command:
        yield command


@pytest.fixture(scope='module')
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Return a browser."""
    if EXECUTABLE is None:
        pytest.skip('there is no Chromium (apt-get install chromium)')
    with Page(tmp_path_factory.mktemp('profile')) as found:
        yield found


@pytest.fixture(scope='module')
def opened(live: LiveCommand, browser: Page) -> Page:
    """Return the page with its first curves."""
    browser.open(live.url)
    browser.until('antennaDrive.samples.time > 0.2 && '
                  'document.getElementById("state").textContent === "playing"')
    browser.until('document.querySelector(\'[data-name="bias_pot"] input[type="range"]\')')
    return browser


@pytest.fixture
def page(opened: Page, live: LiveCommand) -> Iterator[Page]:
    """Return the page, wide and on its first tab; in the end nobody has complained."""
    opened.look(1400, 900)
    opened.click('#tab-tune')
    opened.tell('document.activeElement.blur()')
    yield opened
    assert opened.complaints == []
    assert all(url.startswith((live.url, 'data:')) for url in opened.requests)
