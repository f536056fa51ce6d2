# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""The fits that a verdict was made from, as plain data, so that it can be decided anew."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from antenna_drive.diagnosis import verdict
from antenna_drive.diagnosis.hypothesis import Hypothesis
from antenna_drive.diagnosis.least_squares import FitState
from antenna_drive.diagnosis.machine import Form, Parameter
from antenna_drive.diagnosis.settings import Settings
from antenna_drive.diagnosis.verdict import Decision, LackOfFit
import numpy as np


@dataclass(frozen=True)
class Evidence:
    """
    What a verdict is decided on.

    Attributes
    ----------
    hypotheses : everything that was fitted, the nuisances alone among them
    lacks : what each of them leaves
    inflation : of the cost's differences, see `intervals.inflation`

    """

    hypotheses: Sequence[Hypothesis]
    lacks: Sequence[LackOfFit]
    inflation: float = 1.0

    def decide(self, settings: Settings) -> Decision:
        """Decide with these thresholds, on what the best hypothesis leaves under them."""
        best = verdict.best(self.hypotheses, settings, self.inflation)
        lack = next(lack for h, lack in zip(self.hypotheses, self.lacks, strict=True)
                    if h is best)
        return verdict.decide(self.hypotheses, lack, settings, self.inflation)

    def as_data(self) -> list[dict[str, Any]]:
        """Return the evidence as plain data, for the JSON."""
        return [{'effects': list(h.effects), 'doubts': h.doubts, 'cost': h.cost,
                 'inflation': self.inflation,
                 'forms': [_form_data(form, h.state.point()) for form in h.forms],
                 'lack_of_fit': asdict(lack)}
                for h, lack in zip(self.hypotheses, self.lacks, strict=True)]

    @classmethod
    def of_data(cls, data: Sequence[Mapping[str, Any]]) -> Evidence:
        """
        Take evidence from plain data.

        Raises
        ------
        KeyError, TypeError : it is none

        """
        return cls([_hypothesis(item) for item in data],
                   [LackOfFit(**item['lack_of_fit']) for item in data],
                   data[0].get('inflation', 1.0) if data else 1.0)


def _form_data(form: Form, point: Mapping[str, float]) -> dict[str, Any]:
    return {'name': form.name, 'scanned': form.scanned, 'parameters': [
        {'name': p.name, 'unit': p.unit, 'value': point[p.name], 'low': p.low, 'high': p.high,
         'prior_sigma': p.prior_sigma, 'tolerance': p.tolerance, 'is_shape': p.is_shape}
        for p in form.parameters]}


def _hypothesis(data: Mapping[str, Any]) -> Hypothesis:
    forms = tuple(Form(form['name'], tuple(
        Parameter(p['name'], p['unit'], p['low'], p['high'], 1.0, p['prior_sigma'],
                  tolerance=p['tolerance'], is_shape=p.get('is_shape', False))
        for p in form['parameters']),
        scanned=form['scanned']) for form in data['forms'])
    values = [p['value'] for form in data['forms'] for p in form['parameters']]
    none = np.zeros(0)
    return Hypothesis(tuple(data['effects']), forms, FitState(
        tuple(p for form in forms for p in form.parameters), np.array(values), none,
        np.zeros((0, len(values)), np.float32), none, data['cost']),
        data['doubts'])
