# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Files of MATLAB, written by scipy and then damaged."""

from __future__ import annotations

from pathlib import Path
from struct import pack
from tempfile import TemporaryDirectory
from typing import Any
import zlib

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array
from simgap.errors import UserError
from simgap.logs.mat import read_mat
from simgap.logs.tables import open_table

VALUES = {'time': np.arange(5.0)[:, np.newaxis], 'count': np.array([[3]], dtype='u1'),
          'flags': np.array([[True, False]]), 'table': np.arange(12, dtype='i2').reshape(3, 4)}
# double as the type of stored numbers, in a whole element and in a small one (unsigned bytes)
WHOLE, SMALL = pack('<II', 9, 40), pack('<HH', 2, 1)


def opened(path: Path) -> list[str]:
    with open_table(path) as table:
        return list(table.names)


def damaged(path: Path, code: int, small: bool, packed: bool) -> None:
    """Write a file of one variable whose numbers have a type that is not theirs."""
    savemat(path, {'count': VALUES['count']} if small else {'time': VALUES['time']})
    data = path.read_bytes()
    old, new = (SMALL, pack('<HH', code, 1)) if small else (WHOLE, pack('<II', code, 40))
    at = data.rindex(old)
    body = data[128:at] + new + data[at + len(new):]
    if packed:
        body = zlib.compress(body)
        body = pack('<II', 15, len(body)) + body
    path.write_bytes(data[:128] + body)


@pytest.mark.parametrize('packed', [False, True])
def test_numbers_are_read_and_all_else_is_left_out(packed: bool, tmp_path: Path) -> None:
    other: dict[str, Any] = {
        'text': 'volts', 'cells': np.array([1.0, 'a'], dtype=object), 'turned': np.array([1j]),
        'rare': csc_array(np.eye(3)), 'set': {'inner': np.arange(3.0)}}
    savemat(tmp_path / 'a.mat', {**other, **VALUES}, do_compression=packed)
    found = read_mat(tmp_path / 'a.mat')
    assert sorted(found) == sorted(VALUES)
    for name, values in VALUES.items():
        np.testing.assert_array_equal(found[name], values)


def test_files_of_level_4_are_read(tmp_path: Path) -> None:
    savemat(tmp_path / 'a.mat', {'time': VALUES['time']}, format='4')
    np.testing.assert_array_equal(read_mat(tmp_path / 'a.mat')['time'], VALUES['time'])


@pytest.mark.parametrize('packed', [False, True])
@pytest.mark.parametrize('small', [False, True])
@pytest.mark.parametrize('code', [0, 8, 10, 11, 14, 15, 16, 18, 19, 20, 1000, 65535])
def test_a_type_that_the_format_does_not_have_is_refused(
        code: int, small: bool, packed: bool, tmp_path: Path) -> None:
    """Scipy 1.17 ends the process."""
    damaged(tmp_path / 'a.mat', code, small, packed)
    with pytest.raises(UserError, match=rf'a\.mat: .*type {code}\b'):
        opened(tmp_path / 'a.mat')


@pytest.mark.parametrize('code', [1, 2])
def test_types_that_the_format_has_are_read(code: int, tmp_path: Path) -> None:
    damaged(tmp_path / 'a.mat', code, True, False)
    assert read_mat(tmp_path / 'a.mat')['count'] == VALUES['count']


def test_of_two_variables_with_one_name_the_first_counts(tmp_path: Path) -> None:
    """Scipy reads the first; so it is the first that is looked at."""
    parts = []
    for values in ({'x': np.array(['a'], dtype=object)}, {'x': VALUES['time']}):
        savemat(tmp_path / 'part.mat', values)
        parts.append((tmp_path / 'part.mat').read_bytes())
    (tmp_path / 'a.mat').write_bytes(parts[0] + parts[1][128:])
    assert read_mat(tmp_path / 'a.mat') == {}


@given(st.data())
@settings(max_examples=200, deadline=None)
def test_a_damaged_file_is_a_table_or_a_line(data: st.DataObject) -> None:
    with TemporaryDirectory() as place:
        path = Path(place, 'a.mat')
        savemat(path, VALUES)
        content = bytearray(path.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(124, len(content) - 1))
            content[at] = data.draw(st.integers(0, 255))
        path.write_bytes(content)
        try:
            opened(path)
        except UserError as error:
            assert str(path) in str(error) and '\n' not in str(error)
