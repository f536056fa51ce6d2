# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is not of now looks so: a node that was killed, a server that has gone."""

from __future__ import annotations

from pathlib import Path

from chromium import Page
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: no drive to look at')
pytest.importorskip('tornado', reason='tornado is not installed: no page')

from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402, I100
from live_command import LiveCommand  # noqa: E402

STATE = 'document.getElementById("state").textContent'
TROUBLE = 'document.getElementById("trouble").textContent'
LOOKS_STALE = 'getComputedStyle(document.getElementById("seen")).filter === "grayscale(1)"'
ROWS = ('[...document.querySelectorAll("#nodes table:first-of-type tr")]'
        '.map(row => row.textContent)')


@pytest.mark.slow
def test_a_killed_node_and_a_server_that_has_gone_look_stale(
        module_domain: int, tmp_path: Path, browser: Page) -> None:
    with DriveProcesses(config=['old_circuit'], namespace='/east',
                        environment={'ROS_DOMAIN_ID': str(module_domain)}) as drive, \
            LiveCommand(tmp_path, module_domain, '--join', '--namespace', 'east') as live:
        browser.open(live.url)
        browser.until(f'{STATE} === "playing" && antennaDrive.samples.time > 0.5')
        browser.until(f'{ROWS}.every(row => /stepping|late/.test(row))')
        assert not browser.tell(LOOKS_STALE)
        assert browser.tell('document.getElementById("trouble").hidden')
        browser.until('document.getElementById("about").textContent === '
                      '"namespace /eastconfiguration old_circuitexperiment none of the article’s"')
        browser.until('document.querySelector(\'[data-name="bias_pot"] input\')')
        drive.kill('motor_2')
        browser.until(f'/motor_2: no report for [0-9]+ s/.test({TROUBLE})')
        browser.until(f'{STATE} === "stale" && {LOOKS_STALE}')
        last = browser.tell('antennaDrive.samples.time.toFixed(3)')
        assert f'what is shown is of {last} s' in browser.tell(TROUBLE)
        row, = browser.until(f'(rows => rows.length && rows)({ROWS}.filter('
                             'row => row.startsWith("motor_2no report for")))')
        assert 'the last was:' in row
        live.end()
        browser.until(f'{STATE} === "no connection" && {TROUBLE}.startsWith("no connection") '
                      f'&& {LOOKS_STALE}')
        browser.tell('document.querySelector(\'[data-name="bias_pot"] .number\').focus()')
        old = browser.tell('document.activeElement.value')
        browser.tell('document.activeElement.value = "0.3"; '
                     'document.activeElement.dispatchEvent(new Event("change"))')
        browser.until('document.querySelector(\'[data-name="bias_pot"] .refused\').textContent '
                      '=== "not connected"')
        assert browser.tell('document.activeElement.value') == old
