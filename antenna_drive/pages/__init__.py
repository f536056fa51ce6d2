# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Builds every page: plain data go into a template, one file of HTML comes out.

A page needs no network and no program but a browser. Templates escape whatever they are given,
so no text from a recording can become a part of the page itself.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from antenna_drive.pages.curves import plotted
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

FOLDER = Path(__file__).parent


def render(template: str, **contents: object) -> str:
    """
    Return a page as HTML.

    Parameters
    ----------
    template
        name of a file in templates/, whose first lines list the contents that it needs
    contents
        plain data by name

    Raises
    ------
    jinja2.UndefinedError : the template needs something that was not given

    """
    return _environment().get_template(template).render(contents)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(FOLDER / 'templates'), undefined=StrictUndefined, autoescape=True,
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    environment.globals.update(file=_file, plotted=plotted)
    environment.policies['json.dumps_kwargs'] = {'allow_nan': False}
    return environment


def _file(name: str) -> Markup:
    """Return a file of this package as it is: a style or a script of our own or of a library."""
    return Markup((FOLDER / name).read_text(encoding='utf-8'))
