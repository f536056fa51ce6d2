# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""JSON that every reader takes, files that are whole or not there, a progress line."""

from __future__ import annotations

import io
import json
import math
import os
from pathlib import Path
import stat
import sys

from hypothesis import given, strategies as st
import numpy as np
import pytest
from simgap.command.output import Progress, replaced, write_json
from simgap.errors import UserError


def strict(text: str) -> object:
    """Read JSON as a reader does that knows nothing but the standard."""
    def refuse(word: str) -> None:
        raise AssertionError(f'{word} is not JSON')
    return json.loads(text, parse_constant=refuse)


RESULTS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20)


def without_nan(value: object) -> object:
    """Put None in the place of NaN."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and math.isnan(value) else value


@given(RESULTS)
def test_json_comes_back(tmp_path_factory: pytest.TempPathFactory, result: object) -> None:
    """Whatever is written is strict JSON and comes back to the last bit, NaN as null."""
    path = tmp_path_factory.getbasetemp() / 'result.json'
    write_json(result, path)
    assert strict(path.read_text(encoding='utf-8')) == without_nan(result)


def test_json_of_numpy(capsys: pytest.CaptureFixture[str]) -> None:
    """Numpy's numbers and arrays become plain ones; '-' is standard output."""
    write_json({'a': np.float64(0.1), 'b': np.array([1.0, np.nan]), 'c': np.int64(3),
                'd': Path('x/y'), 'e': np.bool_(True)}, '-')
    assert strict(capsys.readouterr().out) == {
        'a': 0.1, 'b': [1.0, None], 'c': 3, 'd': 'x/y', 'e': True}


@pytest.mark.parametrize('result', [math.inf, {'a': [np.float32('-inf')]}, {'a': object()}])
def test_json_refused_leaves_the_old(tmp_path: Path, result: object) -> None:
    """What JSON cannot say is refused, and the file of before is untouched."""
    path = tmp_path / 'result.json'
    path.write_text('old')
    with pytest.raises((ValueError, TypeError)):
        write_json(result, path)
    assert path.read_text() == 'old'
    assert os.listdir(tmp_path) == ['result.json']


def test_replaced_is_whole_or_not_at_all(tmp_path: Path) -> None:
    """A failure in the middle of writing leaves the old content and no litter."""
    path = tmp_path / 'file'
    path.write_bytes(b'old')
    with pytest.raises(ZeroDivisionError), replaced(path) as stream:
        stream.write(b'half')
        raise ZeroDivisionError
    assert path.read_bytes() == b'old'
    with replaced(path) as stream:
        stream.write(b'new')
        assert path.read_bytes() == b'old'
    assert path.read_bytes() == b'new'
    assert os.listdir(tmp_path) == ['file']


def test_replaced_has_the_usual_mode(tmp_path: Path) -> None:
    """A result may be read by whom any new file may be read by."""
    (tmp_path / 'usual').touch()
    write_json({}, tmp_path / 'result.json')
    modes = {stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ('usual', 'result.json')}
    assert len(modes) == 1


def test_nowhere_to_write(tmp_path: Path) -> None:
    """A folder that is not there is named."""
    path = tmp_path / 'missing' / 'result.json'
    with pytest.raises(UserError, match=f'{path}: cannot be written, No such file'):
        write_json({}, path)


class Terminal(io.StringIO):
    """Standard error as a person has it."""

    def isatty(self) -> bool:
        """Say that somebody watches."""
        return True


def test_progress_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """The line starts empty, ends full, and is left behind complete."""
    terminal = Terminal()
    monkeypatch.setattr(sys, 'stderr', terminal)
    with Progress('steps', 4) as progress:
        for done in range(5):
            progress.update(done)
    lines = terminal.getvalue().split('\r')[1:]
    assert '  0 %' in lines[0]
    assert f"[{'#' * 30}] 100 %" in lines[-1]
    assert terminal.getvalue().endswith('\n')


def test_progress_of_work_that_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work that fails does not look finished."""
    terminal = Terminal()
    monkeypatch.setattr(sys, 'stderr', terminal)
    with pytest.raises(ZeroDivisionError), Progress('steps', 4):
        raise ZeroDivisionError
    assert '100 %' not in terminal.getvalue()


@pytest.mark.parametrize('stream, quiet', [(Terminal(), True), (io.StringIO(), False)])
def test_progress_is_quiet(stream: io.StringIO, quiet: bool,
                           monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is shown when told so, and nothing of short work into a file or a pipe."""
    monkeypatch.setattr(sys, 'stderr', stream)
    with Progress('steps', 4, quiet=quiet) as progress:
        progress.update(2)
    assert stream.getvalue() == ''


def test_progress_in_a_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long work has a line now and then, which no other overwrites."""
    monkeypatch.setattr(Progress, 'LINE_S', 0.0)
    log = io.StringIO()
    monkeypatch.setattr(sys, 'stderr', log)
    with Progress('steps', 4) as progress:
        progress.update(2)
    assert [line.split()[0] for line in log.getvalue().splitlines()] == ['steps'] * 2
    assert ' 50 %' in log.getvalue()
    assert '\r' not in log.getvalue()


def test_progress_of_nothing() -> None:
    """A total of zero has no parts."""
    with pytest.raises(ValueError, match='total'):
        Progress('steps', 0)
