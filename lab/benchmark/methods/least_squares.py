# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Enter what an engineer would write: `python -m lab.benchmark.methods.least_squares CASE`.

The base model with no effect, one or two is fitted by SciPy's robust least squares within the
tolerances; BIC (G. Schwarz, Annals of Statistics 6, 1978) weighs them, a sample being worth SHARE
of one, as noise is coloured. If the best leaves more than noise would, the answer is 'unknown'.
SHARE and LEVEL were chosen on ten practice cases.
"""

from collections.abc import Mapping
from dataclasses import dataclass
import math

from lab.benchmark.methods.case import CaseFolder, enter
from lab.joints.mechanism import FloatArray
import numpy as np
from scipy.optimize import least_squares
from simgap.machine.contract import Form, Parameter
from simgap.model import OwnMachine

SHARE = 0.05                # of a sample that counts
LEVEL, WIDTH = 1.7, 0.2     # rms over noise at which 'unknown' is as likely as not, and its width
PARTNERS, BASES = 4, 2      # effects that are tried beside each of the best
FIRST, LAST = 8, 20         # steps of a fit, and of the fits that lead
CLIP = 3.0                  # residuals beyond it count by their size, not its square


@dataclass(frozen=True)
class Hypothesis:
    """A hypothesis as fitted."""

    forms: Mapping[str, Form]       # by effect
    values: Mapping[str, float]     # by parameter
    cost: float
    size: int                       # parameters that are fitted


class AllTests:
    """All tests of a case, as one problem of least squares."""

    def __init__(self, case: CaseFolder) -> None:
        """Take the tests."""
        self.machine, self.tests = OwnMachine(case.model, case.logs), range(len(case.logs))
        self.count = sum(int(np.isfinite(item.measured).sum())
                         for item in self.machine.experiments)

    def left(self, values: Mapping[str, float], test: int) -> FloatArray:
        """Return what is left of a test, over noise and model error; 0 where a row is missing."""
        item = self.machine.experiments[test]
        left = self.machine.predict(values, test) - item.measured
        assert item.model_error is not None
        return np.asarray(np.nan_to_num(left / np.hypot(item.noise, item.model_error)).ravel())

    def fit(self, forms: Mapping[str, Form], start: Mapping[str, float], steps: int) -> Hypothesis:
        """Hypothesis the base model's numbers and those of some effects, from a start."""
        numbers: list[Parameter] = [*self.machine.nuisances,
                                    *(p for form in forms.values() for p in form.parameters)]
        low, high = (np.array([getattr(p, end) for p in numbers]) for end in ('low', 'high'))
        sigma, names = np.array([p.prior_sigma or np.inf for p in numbers]), [
            p.name for p in numbers]
        inside = 1e-6 * (high - low)
        first = np.clip([start.get(p.name, p.start) for p in numbers], low + inside,
                        high - inside)

        def parts(x: FloatArray, test: int | None) -> list[FloatArray]:
            values = dict(zip(names, map(float, x), strict=True))
            return [self.left(values, k) if test in (None, k) else np.zeros(0)
                    for k in self.tests] + [x / sigma]

        def slopes(x: FloatArray) -> FloatArray:
            here, columns = parts(x, None), []
            for j, p in enumerate(numbers):
                moved = x.copy()
                moved[j] += p.step if x[j] + p.step < high[j] else -p.step
                columns.append(np.concatenate([
                    (there - now if there.size else np.zeros_like(now)) / (moved[j] - x[j])
                    for there, now in zip(parts(moved, p.experiment), here, strict=True)]))
            return np.array(columns).T

        found = least_squares(
            lambda x: np.concatenate(parts(x, None)), first, slopes, bounds=(low, high),
            x_scale=high - low, loss='soft_l1', f_scale=CLIP, max_nfev=steps, ftol=1e-4)
        return Hypothesis(forms, dict(zip(names, map(float, found.x), strict=True)),
                          float(found.cost), len(numbers))

    def widened(self, base: Hypothesis, effect: str) -> Hypothesis:
        """Return a fit with one effect more, from the form and the size that promise most."""
        machine = self.machine
        left = [item.measured - machine.predict(base.values, k)
                for k, item in enumerate(machine.experiments)]
        starts: list[tuple[float, int, Form, Mapping[str, float]]] = []
        for form in machine.catalogue.forms(machine.catalogue[effect], machine.experiments, left):
            # of a wave, a small size of either part tells which order it has
            trials = form.trials or [{p.name: share * p.high} for p in form.sizes
                                     for share in (-0.05, 0.05)]
            for trial in trials:
                values = {**base.values, **form.start, **trial}
                cost = sum(float(np.sum(np.sqrt(1.0 + (self.left(values, k) / CLIP) ** 2)))
                           for k in self.tests)
                starts.append((cost, len(starts), form, values))
        _, _, best, start = min(starts)
        return self.fit({**base.forms, effect: best}, start, FIRST)

    def bic(self, fit: Hypothesis) -> float:
        """Return BIC over two, negative: the logarithm of the evidence."""
        worth, left = SHARE * self.count, math.log(2.0 * fit.cost / self.count)
        return -0.5 * (worth * left + fit.size * math.log(worth))


def main(case: CaseFolder) -> None:
    """Hypothesis all hypotheses, weigh them, and predict the kept test with the best."""
    problem = AllTests(case)
    none = problem.fit({}, {}, LAST)
    singles = sorted((problem.widened(none, effect) for effect in problem.machine.catalogue),
                     key=problem.bic, reverse=True)
    pairs = {frozenset((*one.forms, *other.forms)): problem.widened(one, *other.forms)
             for one in singles[:BASES] for other in singles[:PARTNERS + 1] if other is not one}
    fits = sorted([none, *singles, *pairs.values()], key=problem.bic, reverse=True)
    fits = [problem.fit(fit.forms, fit.values, LAST) if k < BASES or fit in singles[:BASES]
            else fit for k, fit in enumerate(fits)]
    best = max(fits, key=problem.bic)
    weights = np.exp([problem.bic(fit) - problem.bic(best) for fit in fits])
    level = math.sqrt(2.0 * best.cost / problem.count)
    unknown = 1.0 / (1.0 + math.exp(-(level - LEVEL) / WIDTH))
    shares = [*((1.0 - unknown) * weights / weights.sum()), unknown]
    names = [*(sorted(fit.forms) or ['none'] for fit in fits), ['unknown']]
    case.write([{'effects': effects, 'probability': float(share)} for share, effects in sorted(
        zip(shares, names, strict=True), reverse=True)])
    case.predict(problem.machine.numbers(best.values, 0))


if __name__ == '__main__':
    enter(main)
