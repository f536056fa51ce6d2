# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A worker of dask.distributed that starts another program where it would start Python."""

import os
import sys

from distributed.cli.dask_worker import main

if __name__ == '__main__':
    sys.executable = os.environ['STAND_IN']
    main()
