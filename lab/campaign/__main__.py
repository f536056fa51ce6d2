# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Do one trial in this process: PART NAME SEED OPTIONS (JSON), the outcome goes to a file.

Each trial has a process of its own, so that one that hangs, leaks or dies spoils no other.
"""

from dataclasses import asdict
import json
from pathlib import Path
import sys
import traceback

from antenna_drive.programs import end_with_parent
from lab.campaign.trials import Outcome, run_trial


def main(arguments: list[str]) -> int:
    """Do the trial; what it cannot handle becomes a finding."""
    end_with_parent()
    part, name, seed, options, target = arguments
    try:
        outcome = run_trial(part, name, json.loads(options), int(seed))
    except Exception as error:  # noqa: B902 (a fault of a trial must not end the campaign)
        outcome = Outcome()
        outcome.find(f'the trial failed: {type(error).__name__}: {error}',
                     traceback=traceback.format_exc())
    Path(target).write_text(json.dumps(asdict(outcome)), encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
