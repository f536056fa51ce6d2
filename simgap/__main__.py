# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Let `python -m simgap` be the simgap command."""

import sys

from simgap.cli import main

if __name__ == '__main__':
    sys.exit(main())
