# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings beside the live curves."""

from pathlib import Path
from typing import Any

from antenna_drive.recording.panels import PANELS
from antenna_drive.recording.recording import Recording
from simgap.logs.channel import NANOSECONDS
from simgap.report.curves import kept

# Samples of a curve that are sent to the page.
MOST_SAMPLES = 20_000
_MOST_LISTED = 100


def thinned(recording: Recording, path: Path) -> dict[str, Any]:
    """Return the signals that the charts show; times in seconds from the recording's start."""
    names = [name for panel in PANELS for name in panel.names if name in recording]
    curves = {}
    for name in names:
        channel = recording[name]
        if len(channel):
            chosen, _ = kept(channel.values, MOST_SAMPLES)
            time = (channel.time_ns[chosen] - recording.start_ns) / NANOSECONDS
            curves[name] = {'t': [round(float(t), 6) for t in time],
                            'y': [float(f'{y:.7g}') for y in channel.values[chosen]]}
    return {'name': path.name, 'path': str(path), 'duration': recording.duration_s,
            'curves': curves}


def recordings_in(folder: Path) -> list[str]:
    """Return the bags and CSV files of a folder, the newest first."""
    if not folder.is_dir():
        return []
    found = [item for item in folder.iterdir()
             if item.suffix in ('.csv', '.mcap') or (item / 'metadata.yaml').exists()]
    return [str(item) for item in sorted(
        found, key=lambda item: item.stat().st_mtime, reverse=True)[:_MOST_LISTED]]
