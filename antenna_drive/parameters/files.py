# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Where the shipped parameter files are, however the package was installed."""

from collections.abc import Iterator
import os
from pathlib import Path
import sys

from simgap.errors import UserError

PACKAGE = 'antenna_drive'


def config_dir() -> Path:
    """
    Return the folder of the shipped parameter files.

    That of the source tree if the package runs from one (a checkout, `pip install -e`,
    `colcon build --symlink-install`: an edit counts at once), else the one that pip or
    colcon installed as share/antenna_drive/config.

    Raises UserError: there is none; the message says where it was looked for.
    """
    places = list(dict.fromkeys(_candidates()))
    for place in places:
        if place.is_dir():
            return place
    looked = ', '.join(str(place) for place in places)
    raise UserError(f'the shipped parameter files are missing, install {PACKAGE} anew '
                    f'(looked in {looked})')


def _candidates() -> Iterator[Path]:
    package = Path(__file__).resolve().parents[1]
    if (package.parent / 'package.xml').is_file():
        yield package.parent / 'config'
    # colcon, --user and --target install elsewhere than where the interpreter is, but the
    # prefix is never further up than PREFIX/local/lib/python3.x/site-packages/PACKAGE.
    prefixes = [*package.parents[:5], Path(sys.prefix)]
    prefixes += map(Path, filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)))
    for prefix in prefixes:
        yield prefix / 'share' / PACKAGE / 'config'
