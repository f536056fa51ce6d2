# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The diagnosis of recordings of the antenna drive.

Examples
--------
>>> from antenna_drive.diagnosis.diagnose import diagnose_recordings  # doctest: +SKIP
>>> from antenna_drive.parameters import load                                # doctest: +SKIP
>>> from antenna_drive.recording.files import read_recording                 # doctest: +SKIP
>>> recording = read_recording('field.csv')                                  # doctest: +SKIP
>>> print(diagnose_recordings({'field': recording}, load()).summary())       # doctest: +SKIP

"""

from collections.abc import Mapping, Sequence

from antenna_drive.diagnosis.corrected import correct, Corrected
from antenna_drive.diagnosis.machine import AntennaMachine
from antenna_drive.parameters.sets import Drive
from antenna_drive.readings import RATE_COMMAND
from antenna_drive.recording.recording import Recording
from simgap.errors import UserError
from simgap.machine import check
from simgap.machine.by_label import without_labels
from simgap.search.rival import Rival
from simgap.settings import DEFAULT, Settings
from simgap.verdict.diagnosis import diagnose, Progress
from simgap.verdict.record import Verdict


def diagnose_recordings(recordings: Mapping[str, Recording], drive: Drive,
                        progress: Progress = lambda share, doing: None, threads: int = 2,
                        settings: Settings = DEFAULT, without: Sequence[str] = (),
                        limits: Mapping[str, float] | None = None,
                        earlier: Sequence[Rival] = ()) -> Verdict:
    """
    Say where a real drive and its model part, which effect is behind it, and how far it goes.

    recordings : of one machine, by name, with their test sheets
    threads : how many simulations at once
    without : effects that the catalogue shall lack
    progress, settings, limits, earlier : see `simgap.verdict.diagnosis.diagnose`

    Raises UserError: a recording cannot be used; the message says which and why.
    """
    machine = AntennaMachine(recordings, drive, threads)
    check.check_tests(machine)
    # the bias builds up for two such times; what moves later, such as in wind, tells something
    built_up = 2.0 * machine.time_scales.start_s
    if not any(recording[RATE_COMMAND].values.any() for recording in recordings.values()) and (
            not any(check.moves(test, test.measured, since_s=built_up)
                    for test in machine.experiments)):
        raise UserError(', '.join(recordings) + check.AT_REST)
    return diagnose(check.without(machine, without, limits or ()), progress, threads, settings,
                    limits, earlier)


def corrected(drive: Drive, verdict: Verdict) -> Corrected:
    """Return the configuration of a diagnosis of recordings, with what was found in it."""
    machine, lawful = without_labels(verdict.machine), verdict.lawful
    assert isinstance(machine, AntennaMachine)
    return correct(drive, machine.records, lawful.hypothesis if lawful else verdict.best)
