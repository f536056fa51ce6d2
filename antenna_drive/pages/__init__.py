# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive's own pages: templates for `simgap.report.render`, and the files of the live page."""

from pathlib import Path

from simgap.report import render as shared

FOLDER = Path(__file__).parent


def render(template: str, **contents: object) -> str:
    """Return a page of the drive as HTML, see `simgap.report.render.render`."""
    return shared.render(template, FOLDER / 'templates', **contents)
