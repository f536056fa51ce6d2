# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Damage files of every kind that is read: a line that says what is wrong, or a result."""

from collections.abc import Iterator, Mapping
from itertools import islice
import os
from pathlib import Path
import random
import re
import resource
import signal
import tempfile
import time
import traceback
from types import FrameType
from typing import Any
import warnings

from lab.campaign.mutating import DEEP, mutations, tree_mutations
from lab.campaign.readers import Reader, reader
from lab.campaign.trials import Outcome
from lab.trials.verdict import VerdictError
from simgap.errors import UserError

# A reader may take this much more memory [B] and processor time [s] for a file of a few kilobytes.
MEMORY = 2**30
LONGEST_S = 10.0
LONGEST_MESSAGE = 1000
_KEPT_FINDINGS = 5
# Whose files a fault is looked for in.
_HOUSES = ('/simgap/', '/antenna_drive/', '/lab/')


class _TooLongError(BaseException):
    """A reader takes too long; no reader catches this."""


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Give damaged files to one reader."""
    outcome = Outcome()
    _limit_memory()
    signal.signal(signal.SIGPROF, _too_long)
    seen: dict[str, int] = {}
    longest_s = 0.0
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        try:
            own = reader(name.rpartition('_')[0], folder)
        except ImportError as error:
            outcome.skipped = f'{error.name} is not installed'
            return outcome
        path = folder / own.file
        path.write_bytes(own.content)
        own.read(folder)  # or nothing that follows would say anything
        for number, data in enumerate(_damaged(own, options['files'], rng.randrange(2**32))):
            path.write_bytes(data)
            outcome.count('mutated_files')
            began = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
            try:
                fault = _fault(own, folder, outcome)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
            longest_s = max(longest_s, time.process_time() - began)
            if fault is not None:
                counted, what, detail = fault
                seen[what] = seen.get(what, 0) + 1
                outcome.count(counted)
                if seen[what] == 1 and len(outcome.findings) < _KEPT_FINDINGS:
                    kept = data if len(data) < 3000 else data[:3000]
                    outcome.findings.append({'what': what, 'file': number, 'detail': detail,
                                             'content': kept.decode('latin-1')})
    outcome.figures.update(
        longest_s=round(longest_s, 3), faults_by_kind=seen,
        peak_MB=round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, 1))
    return outcome


def _damaged(own: Reader, count: int, seed: int) -> Iterator[bytes]:
    """Yield damaged files, every other one damaged as plain data where the reader reads such."""
    if own.tree is None or own.write is None:
        yield from mutations(own.content, count, seed)
        return
    yield DEEP
    halves = (mutations(own.content, count, seed),
              tree_mutations(own.tree, own.write, count, seed))
    for half in halves:
        yield from islice(half, count // 2)


def _fault(own: Reader, folder: Path, outcome: Outcome) -> tuple[str, str, str] | None:
    """Return which count a reader's answer belongs to, what it is and its detail; None if good."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            own.read(folder)
    except (UserError, VerdictError) as error:
        outcome.count('files_refused')
        text = str(error)
        if not text.isprintable() or len(text) > LONGEST_MESSAGE:
            return 'bad_messages', 'the message is no plain line', text[:2000]
        if own.file.rpartition('/')[2].partition('.')[0] not in text and str(folder) not in text:
            return 'bad_messages', 'the message does not name the file', text
        return None
    except _TooLongError:
        return 'hangs', f'takes longer than {LONGEST_S:g} s', traceback.format_exc()[-2000:]
    except MemoryError:
        return 'gigabytes', f'takes more than {MEMORY // 2**20} MB', traceback.format_exc()[-2000:]
    except Exception as error:  # noqa: B902 (this is what is looked for)
        frames = traceback.extract_tb(error.__traceback__)
        place = next((f'{Path(frame.filename).name}:{frame.lineno}' for frame in reversed(frames)
                      if re.search('/(antenna_drive|simgap|lab)/', frame.filename)), '')
        return ('tracebacks', f'{type(error).__name__} at {place}', traceback.format_exc()[-3000:])
    outcome.count('files_read')
    return None


def _too_long(number: int, frame: FrameType | None) -> None:
    raise _TooLongError


def _limit_memory() -> None:
    held = int(Path('/proc/self/statm').read_text().split()[0]) * os.sysconf('SC_PAGE_SIZE')
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, held + MEMORY))
