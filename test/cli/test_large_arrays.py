# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the C library keeps of large arrays that are gone."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

# A large array comes and goes, so that the C library keeps room for the next one; behind that one
# lies something small, so that its room cannot be given back when it goes.
PROGRAM = """
from pathlib import Path
from simgap.command.large_arrays import give_back_large_arrays
import numpy as np

def used_MB():
    return int(Path('/proc/self/statm').read_text().split()[1]) * 4096 / 1e6

{call}
before = used_MB()
first = np.ones(2_000_000)
del first
second = np.ones(2_000_000)
small = [bytes(100_000) for _ in range(20)]
del second
print(used_MB() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='the C library is not glibc')
@pytest.mark.parametrize('call, kept', [('give_back_large_arrays()', False), ('', True)])
def test_the_memory_of_large_arrays_is_given_back(call: str, kept: bool) -> None:
    done = subprocess.run([sys.executable, '-c', PROGRAM.format(call=call)], text=True,
                          capture_output=True, check=True, timeout=60.0)
    assert (float(done.stdout) > 10.0) is kept
