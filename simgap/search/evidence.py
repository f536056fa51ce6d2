# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The evidence for a hypothesis, by which the search ranks and the verdict decides.

It is the marginal likelihood of Laplace's approximation (D. J. C. MacKay, Information Theory,
Inference, and Learning Algorithms, 2003, chapter 27), with the cost E of the residuals, their
Gauss-Newton Hessian H, the precision P of the priors and the values x at the end of the fit:

    log p(data | h) = -(E + x P x / 2) / T - log det(1 + P^-1/2 H P^-1/2 / T) / 2

less the same determinant of the nuisances alone, which all hypotheses have and whose derivatives
differ by their errors.

A size without a prior has one as wide as a single mean sample would tell (R. E. Kass,
L. Wasserman, Journal of the American Statistical Association 90, 928, 1995), so that its price
does not turn with its bounds; a shape has an even one within them. T is by how much less than one
a sample counts, because residuals are loud or correlated. Each effect has to gain, for itself,
what shows an effect beside all that a model leaves out.

No form of an effect is exact, and no model. What is gained in a signal below the share that an
error of form leaves there hardly counts: the form of another effect may lack it. So an effect may
be small in signals that another one does not move. Each effect also has to gain the share of the
noise that an error of the model may be.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from simgap.fit.least_squares import LeastSquares
from simgap.fit.state import FitState, proper_precision
from simgap.machine.contract import FloatArray, Form
from simgap.search.hypothesis import Hypothesis
from simgap.settings import EvidenceSettings


@dataclass(frozen=True)
class Evidence:
    """The evidence for hypotheses that were fitted at one and the same noise."""

    settings: EvidenceSettings
    samples: int  # that were fitted
    temperature: float  # by how much less than one a sample counts
    gain: float  # of the best over none [half chi-square]
    scale: float = 1.0  # of the noise, where the misfit counts as such
    # cost of a residual by signal, and the least that an error of form leaves, shape (c,)
    by_signal: Callable[[FloatArray], FloatArray] = lambda residual: np.zeros(1)
    least: FloatArray = field(default_factory=lambda: np.zeros(1))

    @classmethod
    def among(cls, problem: LeastSquares, hypotheses: Sequence[Hypothesis]) -> Evidence:
        """Return the evidence by what the best of some hypotheses leaves."""
        best = min(hypotheses, key=lambda h: h.cost)
        none = min((h for h in hypotheses if not h.effects), key=lambda h: h.cost, default=best)
        options, begins = problem.settings.evidence, problem.losses(none.state.residual)
        ends = np.min([problem.losses(h.state.residual) for h in hypotheses], axis=0)
        return cls(options, problem.samples, temperature(problem, best.state),
                   none.cost - best.cost, problem.scale, problem.losses,
                   ends + options.form_error ** 2 * np.maximum(begins - ends, 0.0))

    def __call__(self, hypothesis: Hypothesis) -> float:
        """Return the logarithm of the evidence times the prior, with the prices."""
        state = hypothesis.state
        free = np.array([p.high > p.low for p in state.parameters], bool)
        hessian = state.hessian[np.ix_(free, free)] / self.temperature
        unit = self._precision(state)[free] ** -0.5
        scaled = np.eye(unit.size) + hessian * np.outer(unit, unit)
        own = {p.name for form in hypothesis.forms for p in form.parameters}
        shared = np.array([p.name not in own for p in state.parameters], bool)[free]
        # what the nuisances have is that of all hypotheses, and their derivatives err
        occam = 0.5 * float(np.linalg.slogdet(scaled)[1]
                            - np.linalg.slogdet(scaled[np.ix_(shared, shared)])[1])
        # what an error of form may be hardly counts, but still tells two places apart
        below = float(np.maximum(self.least - self.by_signal(state.residual), 0.0).sum())
        cost = state.cost + (1.0 - self.settings.form_error ** 2) * below
        return float(-self.price(hypothesis.forms) - cost / self.temperature - occam)

    def _precision(self, state: FitState) -> FloatArray:
        """Return the precision of the priors; a size without one has that of a single sample."""
        one = np.diag(state.hessian) / max(self.samples, 1)
        sizes = np.array([not p.prior_sigma and not p.is_shape for p in state.parameters], bool)
        return np.where(sizes & (one > 0.0), one, proper_precision(state.parameters))

    @property
    def reach(self) -> float:
        """Return how far behind the best a hypothesis may be and still overtake it."""
        return self.settings.shows + self.settings.form_error * self.gain / self.temperature

    def price(self, forms: Sequence[Form]) -> float:
        """Return what a hypothesis has to pay for effects of these forms."""
        sought = self.settings.sought * sum(form.scanned for form in forms)
        shows = self.settings.shows + 0.5 * self.settings.form_error ** 2 * self.samples
        return len(forms) * shows / self.scale ** 2 + sought

    @property
    def whole(self) -> float:
        """Return the whole gap: what the best gains and what it leaves [half chi-square]."""
        return self.gain / self.temperature + 0.5 * self.samples / self.scale ** 2

    def ranked(self, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses, the best first."""
        return sorted(hypotheses, key=self, reverse=True)


def temperature(problem: LeastSquares, state: FitState) -> float:
    """Return how much less than one a sample counts, by the level and colour of a residual."""
    # the effective number of samples of a first-order process: n (1 - f) / (1 + f)
    counts, factors = [], []
    for k in range(len(problem.experiments)):
        for z in problem.of_test(state.residual, k).T:
            pairs = np.isfinite(z[1:]) & np.isfinite(z[:-1])
            if pairs.sum() < problem.settings.noise.least_samples:
                continue
            clip = problem.settings.noise.clip
            one, next_one = np.clip(z[:-1][pairs], -clip, clip), np.clip(z[1:][pairs], -clip, clip)
            power = float(np.mean(one ** 2))
            same = float(np.clip(np.mean(one * next_one) / max(power, 1e-9), 0.0, 0.95))
            counts.append(int(pairs.sum()))
            factors.append(max(power, 0.2) * (1.0 + same) / (1.0 - same))
    return max(1.0, float(np.average(factors, weights=counts))) if counts else 1.0
