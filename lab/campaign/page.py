# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The page about a campaign: what was tried, what was found, and how to repeat it."""

from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any

from lab.campaign.summary import BAD, COUNTS
from lab.campaign.trials import PARTS
from simgap.report.render import render

LONGEST = 4000


def page(result: Mapping[str, Any]) -> str:
    """Return the page as HTML, from what `summary` returns."""
    names = dict.fromkeys((*COUNTS, *(name for name in BAD if result.get(name))))
    slope, (low, high) = (result['memory_slope_MB_per_h'],
                          result['memory_slope_interval_MB_per_h'])
    counts = [(name.replace('_', ' '), str(result[name]), name in BAD and result[name] > 0)
              for name in names]
    if slope is not None:
        counts.append(('memory slope', f'{slope:.3g} MB/h ({low:.3g} to {high:.3g})', False))
    lead = (f'{result["trials_done"]} of {result["trials"]} trials in '
            f'{result["wall_s"] / 60.0:.0f} min, {len(result["findings"])} findings')
    return render(
        'campaign.html', Path(__file__).parent, title='Fault campaign', lead=lead, counts=counts,
        parts=[(part, PARTS[part], own['trials'], own['findings'], own['wall_s'],
                ', '.join(f'{key.replace("_", " ")} {value}'
                          for key, value in own['counts'].items()))
               for part, own in result['parts'].items()],
        skipped=list(result['skipped'].items()),
        findings=[(finding['trial'], finding['what'], finding['repeat'],
                   json.dumps({key: value for key, value in finding.items() if key not in (
                       'trial', 'what', 'repeat')}, indent=1)[:LONGEST])
                  for finding in result['findings']],
        version=result['version'])
