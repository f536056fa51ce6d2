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
Memory of large arrays, given back to the system as soon as they are gone.

The C library of Linux (glibc) takes large arrays from the system one by one at first, and gives
them back. Once some have come and gone, it keeps their memory for later ones, for each thread
separately. A diagnosis makes and drops Jacobians of 15 MB by the hundred, and a third of its
memory was such leftovers.
"""

from __future__ import annotations

import ctypes
import sys

_MMAP_THRESHOLD = -3    # M_MMAP_THRESHOLD of malloc.h
_LARGE = 1 << 20        # [B]


def give_back_large_arrays() -> None:
    """Have this process give back what is larger than a megabyte; nothing but on glibc."""
    if not sys.platform.startswith('linux'):
        return
    library = ctypes.CDLL(None)
    if hasattr(library, 'gnu_get_libc_version'):
        library.mallopt(_MMAP_THRESHOLD, _LARGE)
