# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The types of data that the whole engine shares."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
# Values of parameters by name.
Point = Mapping[str, float]
# An input over time: from times [s] to values, shape (n,) each.
Course = Callable[[FloatArray], FloatArray]
