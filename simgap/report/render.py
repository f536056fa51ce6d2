# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Builds every page: plain data go into a template, one file of HTML comes out.

A page needs no network and no program but a browser. Templates escape whatever they are given,
so no text from a recording can become a part of the page itself.
"""

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from simgap.report.curves import plotted
from simgap.verdict.spoken import size

FOLDER = Path(__file__).parent
TEMPLATES = FOLDER / 'templates'


def render(template: str, folder: Path = TEMPLATES, **contents: object) -> str:
    """
    Return a page as HTML.

    `template` is the name of a file in `folder` whose first lines list the contents that it needs;
    what it extends or includes may lie in this room's templates/. `contents` are plain data by
    name. Raises jinja2.UndefinedError if the template needs something that was not given.
    """
    page = _environment(folder).get_template(template).render(contents)
    return page.encode(errors='backslashreplace').decode()  # a file's name need not be UTF-8


@cache
def _environment(folder: Path) -> Environment:
    environment = Environment(
        loader=FileSystemLoader([folder, TEMPLATES]), undefined=StrictUndefined, autoescape=True,
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    # `file` gives a file of this room as it is: a style or a script of our own or of a library
    environment.globals.update(plotted=plotted, size=size, file=lambda name: Markup(
        (FOLDER / name).read_text(encoding='utf-8')))
    environment.policies['json.dumps_kwargs'] = {'allow_nan': False}
    return environment
