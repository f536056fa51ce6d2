# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever is written in a recording is shown as text, and never becomes part of the page."""

from __future__ import annotations

from html.parser import HTMLParser
import json

from antenna_drive.pages import render
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.report import page
from hypothesis import example, given, strategies as st
from jinja2 import UndefinedError
import numpy as np
import pytest
from simgap.logs.channel import Channel


class Parsed(HTMLParser):
    """The tags of a page with the names of their attributes, and its text and data."""

    def __init__(self, html: str) -> None:
        """Parse a page."""
        super().__init__()
        self.tags: list[tuple[str, tuple[str, ...]]] = []
        self.texts: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep a tag."""
        self.tags.append((tag, tuple(name for name, _ in attrs)))

    def handle_comment(self, data: str) -> None:
        """Keep a comment as a tag."""
        self.tags.append(('!', ()))

    def handle_data(self, data: str) -> None:
        """Keep a text."""
        self.texts.append(data)


def parsed(text: str) -> Parsed:
    """Return the page about a recording in which a text stands wherever one can."""
    recording = Recording(
        {'a/b': Channel(text, np.array([0, 1]), np.array([1.0, 2.0]))},
        configuration={text: {text: text}}, notes={text: text, 'who': [text]})
    return Parsed(page(recording, text))


@given(st.text(st.characters(codec='utf-8', exclude_categories=['Cc']), min_size=1))
@example('</script><script>boom()</script>')
@example('<!--')
@example('"><img src=x onerror=boom()>')
@example('{{ 7 * 7 }}{% raw %}{#')
@example("' onload='boom()")
def test_a_text_stays_a_text(text: str) -> None:
    found = parsed(text)
    assert found.tags == parsed('plain').tags
    assert found.texts.count(text) >= 4         # title, heading, two values
    data = next(t for t in found.texts if t.startswith('{"panels"'))
    assert json.loads(data)['panels'][0]['unit'] == text


def test_what_a_template_needs_and_is_not_given_is_an_error() -> None:
    with pytest.raises(UndefinedError, match='lead'):
        render('figures.html', title='no lead', figures=[])
