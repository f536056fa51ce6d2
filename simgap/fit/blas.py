# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Linear algebra in one thread.

Fits go side by side. Matrices of a hundred columns gain nothing from threads of their own, which
spin while they wait: with two in each of two jobs, a design takes five times the processor time.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

try:
    from threadpoolctl import threadpool_limits
except ImportError:  # no ROS distribution names it: the results are the same, only slower
    threadpool_limits = None


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which BLAS uses one thread."""
    return threadpool_limits(1, 'blas') if threadpool_limits else nullcontext()
