# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Whether the shared memory through which others reach this process is still theirs.

A process that opens a port of Fast DDS waits a second for whoever listens there, and removes the
port if it does not answer: it takes a process that was stopped, or starved of the processor, for a
dead one. That process then listens to memory that nobody writes to any more. It can send, but it
hears nobody, and does not notice.

A process has two ports. Frames come to the one of its domain. The other, of a lower number, has
news of the graph alone, and processes of all domains look at it: what befalls it keeps no frame
away.
"""

from pathlib import Path
import re

# Whoever listens at a port holds a lock on a file beside it. Others map the port only.
_LOCK = re.compile(r'/(\w*_port(\d+))_el$')
# The first port of domain 0 (DDSI-RTPS 2.2, section 9.6.1, port base).
_DOMAINS_FROM = 7400
_REMOVED = re.compile(r'/(\w*_port\d+) \(deleted\)$', re.MULTILINE)


def is_cut_off(process: Path = Path('/proc/self')) -> bool:
    """
    Return whether a port at which the process listens for frames has been removed.

    process : its folder in /proc; where there is none, nothing is known, and the answer is False
    """
    try:
        removed = set(_REMOVED.findall((process / 'maps').read_text(encoding='utf-8')))
        return bool(removed) and any(
            (lock := _LOCK.search(target)) and lock[1] in removed
            and int(lock[2]) >= _DOMAINS_FROM
            for target in map(_target, (process / 'fd').iterdir()))
    except OSError:
        return False


def _target(descriptor: Path) -> str:
    try:
        # the lock's file may be gone too
        return str(descriptor.readlink()).removesuffix(' (deleted)')
    except OSError:
        return ''  # closed since
