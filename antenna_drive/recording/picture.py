# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A picture of a recording, with matplotlib."""

from collections.abc import Sequence
from pathlib import Path
from typing import IO

from antenna_drive.recording.panels import panels_of, real_amperes
from antenna_drive.recording.recording import Recording
from simgap.logs.channel import RecordingError
from simgap.report.curves import COLOURS

FORMATS = ('png', 'pdf', 'svg')


def draw(recording: Recording, stream: IO[bytes], form: str, *,
         patterns: Sequence[str] | None = None, title: str = '') -> None:
    """
    Draw the signals over time, one panel for those that belong together.

    recording : what to draw
    stream : where to write the picture
    form : of the picture, from `picture_format`
    patterns : the signals, such as 'motor_*/current'; all that have samples if not given
    title : above the picture

    Raises RecordingError: there is no such signal, or there is no sample.
    """
    # a figure of its own: pyplot would want a screen and keep every figure
    from matplotlib.figure import Figure
    panels = panels_of(recording, patterns)
    figure = Figure(figsize=(9.0, 0.8 + 1.7 * len(panels)), layout='constrained')
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    kappa = real_amperes(recording)
    for axis, panel in zip(axes, panels, strict=True):
        for name, colour in zip(panel.names, COLOURS * 3):
            channel = recording[name]
            axis.plot(channel.time_s, panel.factor * channel.values, color=colour, linewidth=1.0,
                      label=name, marker='.' if len(channel) == 1 else '')
        axis.set_title(panel.title, loc='left', fontsize='medium', fontweight='bold')
        axis.set_ylabel(panel.unit)
        axis.grid(alpha=0.3)
        axis.margins(x=0)
        if panel.unit == 'article A' and kappa:
            # article amperes are no real ones: these stand on the other side
            other = axis.secondary_yaxis('right', functions=(
                lambda a, k=kappa: k * a, lambda a, k=kappa: a / k))
            other.set_ylabel('real A')
        if panel.names == (panel.title,):
            continue  # the title names the one curve
        # above the panel, where it hides nothing
        axis.legend(loc='lower right', bbox_to_anchor=(1.0, 1.0), ncols=len(panel.names),
                    fontsize='small', frameon=False, borderaxespad=0.1)
    axes[-1].set_xlabel('time [s]')
    if title:
        figure.suptitle(title.encode(errors='backslashreplace').decode())
    figure.savefig(stream, format=form, dpi=120)


def picture_format(path: Path) -> str:
    """Return which of FORMATS a file's name asks for; RecordingError if none."""
    form = path.suffix.lstrip('.').lower()
    if form not in FORMATS:
        raise RecordingError(f'{path}: the name has to end in one of '
                             + ', '.join(f'.{known}' for known in FORMATS))
    return form
