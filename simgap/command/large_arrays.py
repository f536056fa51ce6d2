# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Memory of large arrays, given back to the system as soon as they are gone.

The C library of Linux (glibc) takes large arrays from the system one by one at first, and gives
them back. Once some have come and gone, it keeps their memory for later ones, for each thread
separately. A diagnosis makes and drops Jacobians of 15 MB by the hundred, and a third of its
memory was such leftovers.
"""

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
