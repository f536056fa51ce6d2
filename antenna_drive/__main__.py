# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Let `python -m antenna_drive` be the antenna-drive command."""

import sys

from antenna_drive.cli import main
from antenna_drive.programs import end_with_starter

if __name__ == '__main__':
    end_with_starter()
    sys.exit(main())
