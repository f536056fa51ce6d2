# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make the pictures of the live page in docs/: python test/live_pictures.py docs/figures.

They show the saw-tooth test on the new circuit, in the browser of the tests. The twin is a
stand-in that tells the verdict of a sealed case (docs/twin.md, trial 2 of growing verdicts).
"""

from __future__ import annotations

import json
from pathlib import Path
import sys
import tempfile
from typing import Any

from antenna_drive.parameters.loading import load
from antenna_drive.twin.growing import GrowingVerdict, look_of
from chromium import Page
from lab.campaign.domains import claimed_domain
from later import Later
from live_command import LiveCommand
from stand_in_twin import StandInTwin

# Name, width and height of the window, dark, and the tab that is open.
PICTURES = (('live.png', 1400, 900, False, 'tune'), ('live_768.png', 768, 1024, False, 'tune'),
            ('live_390.png', 390, 844, True, 'tune'),
            ('live_twin.png', 1100, 620, False, 'twin'))
# How much of the test the charts show [s].
LENGTH_S = 31.0


TRIAL, CASE = 'lab/notebook/growing_verdict_2.jsonl', 'case_0002'
TEST_S = 30.0


def grown() -> dict[str, Any]:
    """Return what a twin says of a sealed case where the rule stops."""
    cases = map(json.loads, Path(__file__).resolve().parents[1].joinpath(
        TRIAL).read_text(encoding='utf-8').splitlines())
    case = next(item for item in cases if item['case'] == CASE)
    growing = GrowingVerdict(Later(), load())
    for look in case['looks']:
        if look['seconds'] <= case['stopped_s']:
            whole, rest = divmod(look['seconds'], TEST_S)
            growing.looks.append(look_of(
                {'confusable': [], **look['verdict']}, [TEST_S] * int(whole) + [rest]))
    return growing.message()


def main(folder: Path) -> None:
    """Write every picture into a folder."""
    with claimed_domain() as domain, tempfile.TemporaryDirectory() as scratch, \
            LiveCommand(Path(scratch), domain) as live, \
            Page(Path(scratch, 'profile')) as page:
        page.open(live.url)
        page.until(f'antennaDrive.samples.time > {LENGTH_S}', 600.0)
        page.tell('(() => { const s = document.getElementById("span"); s.value = 30;'
                  ' s.dispatchEvent(new Event("change")); })()')
        twin = StandInTwin(domain, 'twin')
        twin.say(grown())
        page.until('document.querySelectorAll("#twin polyline").length', 90.0)
        for name, width, height, dark, tab in PICTURES:
            page.look(width, height, dark)
            page.tell(f'document.getElementById("tab-{tab}").click()')
            arrived = page.tell('antennaDrive.samples.arrived')
            page.until(f'antennaDrive.samples.arrived > {arrived + 10} '
                       '&& !document.querySelector(".twin.stale, body.stale")')
            page.picture(folder / name)
        twin.close()


if __name__ == '__main__':
    main(Path(sys.argv[1]))
