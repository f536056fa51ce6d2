# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Every threshold of the diagnosis: its unit, what it decides, and the trial that set it.

Trials are in lab/notebook/history.md. 'Practice cases' came before the first sealed trial;
'design' means without any. The first sketch of the search is in lab/notebook/one-search.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, Field, field, fields, is_dataclass, replace
from typing import Any

DESIGN = 'design'
PRACTICE = 'practice cases'
WILD = 'wild practice cases'
YARDSTICK = 'as in the first sketch of 180 lines'


def _at(default: Any, unit: str, decides: str, set_by: str = DESIGN) -> Any:
    return field(default=default, metadata={'unit': unit, 'decides': decides, 'set_by': set_by})


@dataclass(frozen=True)
class FitSettings:
    """Robust Levenberg-Marquardt fits."""

    outlier: float = _at(
        3.0, 'noise sigma', 'residual beyond which the loss grows with its logarithm', PRACTICE)
    damping: float = _at(1e-4, '1', 'damping with which a fit begins, and the least')
    damping_factor: float = _at(10.0, '1', 'by what it grows after a step that failed, and decays')
    local_step: float = _at(
        1.0, 'noise sigma', 'change of the prediction by the step of a fresh difference quotient',
        'trial 6')
    least_step: float = _at(1e-3, '1', 'the least such step, as a share of the usual one')
    least_gain: float = _at(
        0.3, 'half chi-square', 'gain that a step must promise')
    stale_weights: float = _at(
        0.02, '1', 'mean change of the weights after which the Hessian is made anew')
    broyden_error: float = _at(
        0.5, '1', "step's error, as a share of its prediction, up to which it corrects the "
        'Jacobian', PRACTICE)
    dead_column: float = _at(
        1e-6, 'noise sigma', 'greatest change by a step below which a derivative is rounding')
    runaway: float = _at(1e4, 'noise sigma', 'bound of every residual')
    batch: int = _at(16, '1', 'variants that are simulated at once')


@dataclass(frozen=True)
class SearchSettings:
    """The search for effects."""

    adds: int = _at(10, '1', 'forms that are fitted after the first screening', YARDSTICK)
    leading: int = _at(3, '1', 'hypotheses that are expanded first, at most', YARDSTICK)
    partners: int = _at(5, '1', 'effects that are added to each of them', YARDSTICK)
    rounds: int = _at(
        4, '1', 'greatest number of times that the best are expanded, and of effects')
    hope: float = _at(
        2.0, '1', 'multiple of the promised gain that has to beat the best: a derivative may err')
    strong: float = _at(
        1.5, 'noise sigma', 'residual level from which the misfit counts as noise', PRACTICE)
    lower: float = _at(
        0.7, '1', 'share of the noise scale below which the scale is lowered and fits go on',
        PRACTICE)
    iterations: int = _at(8, '1', 'iterations of a fit between two Jacobians')
    settled: float = _at(
        2e-3, '1', 'gain of a pass, as a share of the cost, below which a fit has ended')
    finalists: int = _at(6, '1', 'hypotheses that are fitted to the whole tests, at most')
    passes: int = _at(2, '1', 'fresh Jacobians of the fit that is judged')


@dataclass(frozen=True)
class EvidenceSettings:
    """What the evidence for a hypothesis holds beside its fit."""

    sought: float = _at(
        4.0, 'log evidence', 'price of an order that was sought in the residual: one of about 50')
    form_error: float = _at(
        0.1, '1', 'error of the form of an effect, and of a model, as a share of what they do')
    number: float = _at(
        4.0, 'half chi-square', 'gain below which data do not show a number', PRACTICE)
    shows: float = _at(
        34.0, 'half chi-square', 'gain below which data do not show an effect', PRACTICE)


@dataclass(frozen=True)
class VerdictSettings:
    """From evidence to a verdict."""

    confusable: float = _at(
        3.0, 'log evidence', 'distance up to which an effect counts as confusable')
    largest_group: int = _at(
        5, '1', 'effects of a confusable group, and answers that a further test is to tell apart')
    wide: float = _at(
        0.4, '1', 'half an interval, as a share of its value, from which it is said to be wide')
    left: float = _at(
        0.07, '1', 'share of the gap that an unknown input explains beside the best, net of what '
        'its freedom costs, from which unknown is likelier than not', WILD)
    left_width: float = _at(0.2, '1', 'how sharply, in the logarithm of the share', WILD)
    least_unknown: float = _at(0.03, 'probability', 'least probability of unknown', YARDSTICK)
    most_unknown: float = _at(0.85, 'probability', 'greatest probability of unknown', YARDSTICK)
    partly: float = _at(
        0.3, 'probability', "probability of unknown from which the verdict is 'partly explained'")
    least_probability: float = _at(
        0.01, '1', 'probability or share below which nothing is listed')


@dataclass(frozen=True)
class NoiseSettings:
    """The noise that a recording shows, and the error that every model has."""

    model_error: float = _at(
        3e-3, '1', "slow error of a model, as a share of a signal's standard deviation", WILD)
    model_error_hz: float = _at(0.3, 'Hz', "corner of a model's error in planned tests")
    greatest_level: float = _at(
        3.0, 'stated noise', 'upper bound of the levels of white and of slow noise')
    worth_a_colour: float = _at(8.0, 'log evidence', 'evidence below which noise is white')
    clip: float = _at(5.0, 'residual level', 'residual beyond which a sample is an outlier')
    least_samples: int = _at(50, '1', 'samples below which an experiment tells no noise')


@dataclass(frozen=True)
class IntervalSettings:
    """Intervals of fitted values."""

    derivative_error: float = _at(0.1, '1', 'share of a derivative that may be wrong', WILD)


@dataclass(frozen=True)
class LocalisationSettings:
    """Where the gap lies, and where an unknown input acts."""

    caution: float = _at(
        0.02, '1', 'share of the log evidence that counts, because residuals are not white',
        'trial 0')
    louder: float = _at(
        9.0, '1', 'variance in a span over that outside from which the unknown acts there')
    least_span: float = _at(0.1, '1', 'share of a test that it acts in, and leaves, at least')


@dataclass(frozen=True)
class HeldOutSettings:
    """The judgement on withheld data."""

    no_harm: float = _at(
        0.2, 'noise variance', 'residual beyond noise up to which there is no gap', 'trial 11')
    resamples: int = _at(400, '1', 'resamples of the block bootstrap')
    draws: int = _at(25, '1', "draws of an effect's numbers that are simulated in a withheld test")


@dataclass(frozen=True)
class ConfusabilitySettings:
    """Which effects a planned test can tell apart, from derivatives alone."""

    alike: float = _at(
        0.95, '1', 'share of what an effect does that another must imitate to pass for it')


@dataclass(frozen=True)
class PlanningSettings:
    """Which answers of a verdict a further test is to tell apart."""

    least_information: float = _at(
        0.02, 'nat', 'expected information from which a test helps; of standard deviations, the '
        'share by which one shrinks')
    unlisted: float = _at(
        0.25, 'probability', 'least probability that no answer of an open verdict is true: weight '
        'of how well a test shows other effects')
    alike: float = _at(
        1.0, 'temperature', 'lack of fit up to which a test does not tell two rivals apart')
    sure: float = _at(0.9, 'probability', 'probability from which an answer is sure')


@dataclass(frozen=True)
class Settings:
    """All thresholds of a diagnosis."""

    fit: FitSettings = FitSettings()
    search: SearchSettings = SearchSettings()
    evidence: EvidenceSettings = EvidenceSettings()
    verdict: VerdictSettings = VerdictSettings()
    noise: NoiseSettings = NoiseSettings()
    interval: IntervalSettings = IntervalSettings()
    localisation: LocalisationSettings = LocalisationSettings()
    held_out: HeldOutSettings = HeldOutSettings()
    confusability: ConfusabilitySettings = ConfusabilitySettings()
    planning: PlanningSettings = PlanningSettings()

    def entries(self) -> Iterator[tuple[str, Field[Any], Any]]:
        """Yield each threshold: 'group.name', its field (see `metadata`), its value."""
        for group in fields(self):
            values = getattr(self, group.name)
            assert is_dataclass(values)
            for item in fields(values):
                yield f'{group.name}.{item.name}', item, getattr(values, item.name)

    def changed(self, name: str, value: Any) -> Settings:
        """Return the settings with one threshold changed; KeyError if there is none."""
        if name not in {known for known, _, _ in self.entries()}:
            raise KeyError(name)
        group, _, key = name.partition('.')
        return replace(self, **{group: replace(getattr(self, group), **{key: value})})


DEFAULT = Settings()
