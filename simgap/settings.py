# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Every threshold of the diagnosis: its unit, what it decides, and the trial that set it.

Trials are in lab/notebook/history.md. 'Practice cases' came before the first sealed trial;
'design' means without any.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, Field, field, fields, is_dataclass, replace
from typing import Any

DESIGN = 'design'
PRACTICE = 'practice cases'
WILD = 'wild practice cases'


def _at(default: Any, unit: str, decides: str, set_by: str = DESIGN) -> Any:
    return field(default=default, metadata={'unit': unit, 'decides': decides, 'set_by': set_by})


@dataclass(frozen=True)
class FitSettings:
    """Robust Levenberg-Marquardt fits."""

    outlier: float = _at(
        3.0, 'noise sigma', 'residual beyond which the loss grows with its logarithm', PRACTICE)
    initial_damping: float = _at(1e-4, '1', 'damping with which a fit begins', 'trial 6')
    least_damping: float = _at(1e-8, '1', 'lower bound of the damping')
    greatest_damping: float = _at(1e4, '1', 'upper bound of the damping')
    damping_after_failure: float = _at(
        1e-3, '1', 'least damping after a step that failed, before it grows', 'trial 6')
    damping_growth: float = _at(8.0, '1', 'growth of the damping after a step that failed')
    damping_decay: float = _at(5.0, '1', 'decay of the damping after a good step')
    local_step: float = _at(
        1.0, 'noise sigma', 'change of the prediction by the step of a fresh difference quotient',
        'trial 6')
    least_step: float = _at(1e-3, '1', 'the least such step, as a share of the usual one')
    good_step: float = _at(0.5, '1', 'share of the expected gain from which a step counts as good')
    least_gain: float = _at(
        1.0, 'half chi-square', 'gain of an iteration below which a fit is idle')
    worth_a_step: float = _at(0.3, '1', 'share of least_gain that a step must promise')
    idle_iterations: int = _at(1, '1', 'idle iterations that a fit goes on through')
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

    singles: int = _at(12, '1', 'effects that are fitted after the screening', PRACTICE)
    finalists: int = _at(5, '1', 'single effects that are fitted further', PRACTICE)
    most_finalists: int = _at(
        7, '1', 'fits that go on at lower noise, and where the best of them leaves much',
        'trial 9')
    bases: int = _at(3, '1', 'single effects that are given partners', PRACTICE)
    partners: int = _at(5, '1', 'partners that are fitted for each of them', PRACTICE)
    partner_gain: float = _at(
        12.0, 'half chi-square', 'promised gain below which a partner is not fitted', PRACTICE)
    partner_gain_share: float = _at(
        1e-3, '1', 'the same as a share of the cost of the best single effect', PRACTICE)
    base_ratio: float = _at(
        3.0, '1', 'cost, as a multiple of the best, up to which an effect is given partners')
    second_form: float = _at(
        0.7, '1', "share of the best form's promised gain from which a second form is kept")
    full_singles: int = _at(5, '1', 'single effects that are fitted to the whole tests')
    full_pairs: int = _at(4, '1', 'pairs that are fitted to the whole tests')
    passes: int = _at(3, '1', 'greatest number of passes over the whole tests')
    reach: float = _at(
        250.0, 'half chi-square', 'excess over the best cost beyond which a fit is given up',
        PRACTICE)
    reach_share: float = _at(
        0.1, '1', 'the same as a share of that cost: fits stop early', 'trial 9')
    strong: float = _at(
        1.5, 'noise sigma', 'residual level from which the misfit counts as noise', PRACTICE)
    sharper: float = _at(
        0.7, '1', 'share of the noise scale below which the scale is lowered and fits go on',
        PRACTICE)
    scale_passes: int = _at(3, '1', 'times that the noise scale is lowered')
    first_passes: int = _at(5, '1', 'passes of the first fit of the nuisances')
    first_gain: float = _at(
        0.003, '1', 'gain, as a share of the cost, below which the first fit has ended, and below '
        'which a test that leads a fit led nowhere')
    wanting: float = _at(
        1.03, 'noise sigma', 'residual level above which sensitivities are taken anew for pairs, '
        'and fits are led by one test')
    continued_noise: float = _at(
        3.0, 'noise sigma', 'noise at which an answer of an earlier verdict is first fitted to '
        'more tests, if it leaves more')
    settled: float = _at(4.0, 'half chi-square', 'gain of a pass below which the fits have ended')
    settled_share: float = _at(1e-3, '1', 'the same as a share of the cost')
    final_passes: int = _at(5, '1', 'greatest number of fresh Jacobians of the fit that is judged')
    final_gain: float = _at(
        1e-3, '1', 'gain by such a Jacobian, as a share of the cost, below which it has ended',
        'trial 6')
    close: float = _at(
        30.0, 'half chi-square', 'excess over the best cost up to which another fit is taken to '
        'its end, too', 'trial 6')
    close_share: float = _at(0.05, '1', 'the same as a share of that cost', 'trial 9')
    rivals: int = _at(2, '1', 'greatest number of them', 'trial 6')
    scanned: int = _at(5, '1', 'effects that are fitted from a value found by a scan', PRACTICE)
    first_iterations: int = _at(5, '1', 'iterations of a first fit of an effect')
    iterations: int = _at(8, '1', 'iterations of a further fit')
    pair_iterations: int = _at(6, '1', "iterations of a pair's further fit")
    settling_passes: int = _at(
        2, '1', 'greatest number of fresh Jacobians of the best fits before they have partners',
        'trial 6')
    settling_iterations: int = _at(10, '1', 'iterations of a fit with fresh derivatives')
    full_iterations: int = _at(6, '1', 'iterations of a fit to the whole tests')
    most_effects: int = _at(4, '1', 'greatest number of effects of a hypothesis')
    stuck: float = _at(
        0.1, '1', 'share of what the best single effect gains, below which the rest of it is what '
        'a fit without the effect missed because it got stuck', 'trial 7')
    fresh_starts: int = _at(1, '1', 'greatest number of times that it begins anew then', 'trial 7')
    doubtful: float = _at(
        0.25, '1', 'gain, as a share of the cost, below which an effect is fitted without and '
        'judged anew', 'trial 2')


@dataclass(frozen=True)
class PenaltySettings:
    """What a hypothesis pays for its complexity."""

    effect: float = _at(30.0, 'half chi-square', 'price of an effect', PRACTICE)
    parameter: float = _at(4.0, 'half chi-square', 'price of a parameter', PRACTICE)
    prior_parameter: float = _at(
        8.0, 'half chi-square', 'price of a parameter with a prior: one of a course over time, '
        'which imitates anything slow', PRACTICE)
    scanned: float = _at(
        10.0, 'half chi-square', 'price of a form that a scan has chosen', PRACTICE)
    tolerated: float = _at(
        24.0, 'half chi-square', 'price of an effect as small as its tolerance', 'trial 0')


@dataclass(frozen=True)
class VerdictSettings:
    """From costs to probabilities."""

    temperature: float = _at(
        8.0, 'half chi-square', 'cost that makes a hypothesis e times less probable', PRACTICE)
    second_effect: float = _at(60.0, 'half chi-square', 'price of a second effect', PRACTICE)
    second_share: float = _at(
        0.015, '1', 'the same as a share of what the first effect gains', 'trial 0')
    twin_share: float = _at(
        0.005, '1', 'the same where both are one effect in two places', PRACTICE)
    confusable: float = _at(
        14.0, 'half chi-square', 'excess cost up to which an effect counts as confusable',
        PRACTICE)
    largest_group: int = _at(5, '1', 'effects of a confusable group')
    slow: float = _at(
        1.0, '1', 'slow excess of the residual that tips the scales to unknown', PRACTICE)
    slow_slope: float = _at(1.6, '1', 'how sharply', PRACTICE)
    left: float = _at(0.06, '1', 'share of the gap left that tips the scales to unknown', PRACTICE)
    left_slope: float = _at(1.6, '1', 'how sharply', PRACTICE)
    fast: float = _at(
        5.0, 'noise variance', 'fast residual that tips the scales to unknown', PRACTICE)
    fast_slope: float = _at(4.0, '1', 'how sharply', PRACTICE)
    fast_left: float = _at(
        0.3, '1', 'share of that residual left that tips the scales to unknown', 'trial 0')
    fast_left_slope: float = _at(3.0, '1', 'how sharply', 'trial 0')
    regular: float = _at(
        0.73, '1', 'autocorrelation of a residual that tips the scales to unknown', 'trial 11')
    regular_slope: float = _at(25.0, '1', 'how sharply', 'trial 11')
    implausible_slope: float = _at(
        6.0, '1', 'how sharply implausible values of an effect speak for unknown', PRACTICE)
    held_out: float = _at(
        0.4, '1', 'explained share of withheld data below which an effect has failed', PRACTICE)
    held_out_slope: float = _at(12.0, '1', 'how sharply', PRACTICE)
    noise_only: float = _at(
        0.3, '1', 'slow excess below which an effect cannot have failed', PRACTICE)
    noise_only_slope: float = _at(4.0, '1', 'how sharply', PRACTICE)
    least_unknown: float = _at(0.05, 'probability', 'least probability of unknown', 'trial 0')
    most_unknown: float = _at(
        0.8, 'probability', 'greatest probability of unknown', 'trials 9 to 12')
    partly: float = _at(
        0.3, 'probability', "probability of unknown from which the verdict is 'partly explained'")
    entries: int = _at(12, '1', "greatest number of answers beside 'none' and 'unknown'")
    least_probability: float = _at(
        1e-4, 'probability', 'probability below which an answer is left out')


@dataclass(frozen=True)
class LackOfFitSettings:
    """Tests of the residual that a hypothesis leaves."""

    clip: float = _at(
        6.0, 'noise sigma', 'residual beyond which a sample says no more about slow excess')
    clip_fast: float = _at(10.0, 'noise sigma', 'the same for every other statistic')
    least_samples: int = _at(50, '1', 'samples up to which a channel is not tested')
    block: int = _at(10, 'samples', 'length of the blocks whose means are the slow part')
    least_blocks: int = _at(4, '1', 'blocks below which a channel is not tested')
    lags: int = _at(20, 'samples', 'greatest lag of the autocorrelation')
    least_excess: float = _at(-0.5, '1', 'lower bound of the slow excess')
    greatest_energy: float = _at(
        1e6, 'noise variance', 'upper bound of the mean square of a channel')
    least_gap: float = _at(0.05, '1', 'gap, as a share of the noise, that counts as one')
    bins: int = _at(12, '1', 'bins of a covariate')
    least_dependence: float = _at(
        0.02, '1', 'share of the variance from which a dependence is listed')
    dependences: int = _at(8, '1', 'dependences that are listed')


@dataclass(frozen=True)
class NoiseSettings:
    """The noise that a recording shows, and the error that every model has."""

    model_error: float = _at(
        3e-3, '1', "slow error of a model, as a share of a signal's standard deviation", WILD)
    least_level: float = _at(1.0 / 3.0, 'stated noise', 'lower bound of the level of white noise')
    model_error_hz: float = _at(0.3, 'Hz', "corner of a model's error in planned tests")
    greatest_level: float = _at(
        3.0, 'stated noise', 'upper bound of the levels of white and of slow noise')
    same_level: float = _at(0.05, '1', 'change of a level up to which it is the same')
    worth_a_colour: float = _at(8.0, 'log evidence', 'evidence below which noise is white')
    clip: float = _at(5.0, 'residual level', 'residual beyond which a sample is an outlier')
    least_samples: int = _at(50, '1', 'samples below which an experiment tells no noise')


@dataclass(frozen=True)
class IntervalSettings:
    """Intervals of fitted values."""

    derivative_error: float = _at(0.1, '1', 'share of a derivative that may be wrong', WILD)
    model_error: float = _at(
        3e-3, '1', 'standard deviation that every value has, as a share of itself', WILD)
    sure: float = _at(
        1.645, 'standard deviations', 'excess of an effect over its tolerance at which it is as '
        'probably within it: 95 percent, one-sided', 'trials 9 to 11')
    sure_of_all: float = _at(
        2.33, 'standard deviations', 'the same where no test alone shows a gap: 99 percent',
        'trials 9 to 11')
    sure_of_partner: float = _at(
        3.5, 'standard deviations', 'the same for a weaker effect beside the strongest',
        'trials 9 to 12')
    sure_by_gain: float = _at(
        400.0, 'half chi-square', 'gain from which the strongest effect is named anyway',
        'trial 12')
    partner_sure_by_gain: float = _at(
        2000.0, 'half chi-square', 'the same for a weaker effect, of its gain beside the rest',
        'trials 12 and 13')
    sure_slope: float = _at(
        3.0, '1', 'how sharply the doubt of an effect falls at these limits', 'trials 9 to 12')
    least_doubt: float = _at(
        0.02, 'probability', 'doubt from which it is found out what the effect gains beside the '
        'others')


@dataclass(frozen=True)
class LocalisationSettings:
    """Where the gap lies, and where an unknown input acts."""

    downweighted: float = _at(6.0, 'residual level', 'residual beyond which a sample loses weight')
    caution: float = _at(
        0.02, '1', 'share of the log evidence that counts, because residuals are not white',
        'trial 0')
    least_evidence: float = _at(
        20.0, 'log evidence', 'evidence below which no place is named', 'trial 0')
    entries: int = _at(12, '1', 'greatest number of entries')
    least_share: float = _at(0.01, '1', 'share below which an entry is left out')


@dataclass(frozen=True)
class HeldOutSettings:
    """The judgement on withheld data."""

    iterations: int = _at(
        8, '1', 'iterations of a fit to the training data, or to the withheld test, between two '
        'Jacobians')
    passes: int = _at(1, '1', 'greatest number of fresh Jacobians of a fit to the training data')
    further_passes: int = _at(
        4, '1', 'the same where the values of the fit to all tests fit the training data better',
        'trial 15')
    no_gap: float = _at(
        1e-3, '1', 'gap, as a share of the energy before, below which nothing is to be explained')
    no_harm: float = _at(
        0.2, 'noise variance', 'residual beyond noise that effects may leave where there is none '
        'without them; what leaves more is refuted', 'trial 11')
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

    rivals: int = _at(5, '1', 'greatest number of rivals')
    least_probability: float = _at(0.005, '1', 'probability of an answer from which it is a rival')
    passes: int = _at(1, '1', "fresh derivatives of a rival's fit to another's readings")
    least_information: float = _at(
        0.02, 'nat', 'expected information from which a test helps; of standard deviations, the '
        'share by which one shrinks')
    caution: float = _at(3.0, '1', 'by what promised evidence is divided where tests are compared')
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
    penalty: PenaltySettings = PenaltySettings()
    verdict: VerdictSettings = VerdictSettings()
    noise: NoiseSettings = NoiseSettings()
    lack_of_fit: LackOfFitSettings = LackOfFitSettings()
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
