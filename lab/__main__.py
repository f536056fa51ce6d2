# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Let `python -m lab` be the lab command."""

import sys

from antenna_drive.programs import end_with_starter
from lab.cli import main

if __name__ == '__main__':
    end_with_starter()
    sys.exit(main())
