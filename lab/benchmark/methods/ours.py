# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Enter simgap: `python -m lab.benchmark.methods.ours CASE`."""

from dataclasses import replace

from lab.benchmark.methods.case import CaseFolder, enter
from simgap.model import diagnose_logs, OwnMachine

# The task says how large a wind may be [N m, N]; it is drawn evenly up to that.
WIND = {'load': 1.5e-3, 'carriage': 1.0}


def main(case: CaseFolder) -> None:
    """Diagnose a case with a user's model, and predict its kept test."""
    model = replace(case.model, push={
        name: replace(place, everyday=WIND.get(name, 0.0) / 3.0 ** 0.5)
        for name, place in case.model.push.items()})
    verdict = diagnose_logs(model, case.logs, threads=1)
    data = verdict.as_data()
    case.write(data['which'], **{key: data[key] for key in ('verdict', 'confusable', 'how_far')})
    # numbers of a test that are its own are those of the first
    machine = OwnMachine(case.model, case.logs)
    case.predict(machine.numbers(verdict.best.state.point(), 0))


if __name__ == '__main__':
    enter(main)
