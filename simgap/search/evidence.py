# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The fits that a verdict was made from, and the same as plain data."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from simgap.machine.contract import Form
from simgap.search.hypothesis import Hypothesis
from simgap.settings import Settings
from simgap.verdict import verdict
from simgap.verdict.verdict import Decision, LackOfFit


@dataclass(frozen=True)
class Evidence:
    """What a verdict is decided on."""

    hypotheses: Sequence[Hypothesis]  # everything that was fitted, the nuisances alone among them
    lacks: Sequence[LackOfFit]  # what each of them leaves
    inflation: float = 1.0  # of the cost's differences, see `intervals.inflation`

    def decide(self, settings: Settings) -> Decision:
        """Decide with these thresholds, on what the best hypothesis leaves under them."""
        best = verdict.best(self.hypotheses, settings, self.inflation)
        lack = next(lack for h, lack in zip(self.hypotheses, self.lacks, strict=True) if h is best)
        return verdict.decide(self.hypotheses, lack, settings, self.inflation)

    def as_data(self) -> list[dict[str, Any]]:
        """Return the evidence as plain data, for the JSON."""
        return [{'effects': list(h.effects), 'doubts': h.doubts, 'cost': h.cost,
                 'inflation': self.inflation,
                 'forms': [_form_data(form, h.state.point()) for form in h.forms],
                 'lack_of_fit': asdict(lack)}
                for h, lack in zip(self.hypotheses, self.lacks, strict=True)]


def _form_data(form: Form, point: Mapping[str, float]) -> dict[str, Any]:
    return {'name': form.name, 'scanned': form.scanned, 'parameters': [
        {'name': p.name, 'unit': p.unit, 'value': point[p.name], 'low': p.low, 'high': p.high,
         'prior_sigma': p.prior_sigma, 'tolerance': p.tolerance, 'is_shape': p.is_shape}
        for p in form.parameters]}
