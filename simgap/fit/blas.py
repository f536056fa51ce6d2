# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Linear algebra in one thread."""

from contextlib import AbstractContextManager, nullcontext

try:
    from threadpoolctl import threadpool_limits
except ImportError:  # no ROS distribution names it: the results are the same, only slower
    threadpool_limits = None


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which BLAS uses one thread."""
    return threadpool_limits(1, 'blas') if threadpool_limits else nullcontext()
