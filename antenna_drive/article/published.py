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
"""
The article's claims: each figure, its tolerance, and its basis.

The basis says what a passing row proves:

- PUBLISHED: the article's own numbers in the article's own equation. It checks the transcription.
- DERIVED: a parameter or a command was computed from this figure, so the row holds by
  construction.
- FITTED: the shipped parameter sets were fitted to this figure, or it follows from one that they
  were fitted to. config/calibration/article.yaml lists the targets of the fit.
- PREDICTED: no parameter was set from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

NEAR, AT_LEAST, AT_MOST = 'near', 'at least', 'at most'
PUBLISHED, DERIVED, FITTED, PREDICTED = 'published', 'derived', 'fitted', 'predicted'

# Rates and currents [share of the number], voltages [V], overshoot [percent], settling [s],
# stability limit [1/s].
SHARE = 0.03
VOLTS = 0.2
OVERSHOOT = 5.0
SETTLING = 0.15
LIMIT = 3.0
# The greatest bias voltage of the circuit, of which the article gives percentages [V].
SATURATION = 13.0


@dataclass(frozen=True)
class Claim:
    """
    One published figure or trend.

    Attributes
    ----------
    measure : name of the figure that a parameter set gives for it
    says : the published figure in the measure's unit, or the article's words; a mapping with the
        keys field and analysis where the article gives both
    kind : NEAR, AT_LEAST or AT_MOST
    number : the figure to compare with: the analysis' where there are two
    tolerance : in the measure's unit; zero for a trend or a bound
    basis : PUBLISHED, DERIVED, FITTED or PREDICTED
    note : where it is in the article, and what was assumed

    """

    measure: str
    says: float | str | Mapping[str, float]
    kind: str
    number: float
    tolerance: float
    basis: str
    note: str

    def holds(self, obtained: float) -> bool:
        """Return whether a figure agrees with the claim; NaN does not."""
        if self.kind == AT_LEAST:
            return obtained >= self.number - self.tolerance
        if self.kind == AT_MOST:
            return obtained <= self.number + self.tolerance
        return abs(obtained - self.number) <= self.tolerance


def _near(measure: str, number: float, tolerance: float, basis: str, note: str,
          field: float | None = None) -> Claim:
    says = number if field is None else {'field': field, 'analysis': number}
    return Claim(measure, says, NEAR, number, tolerance, basis, note)


def _trend(measure: str, says: str, figure: str) -> Claim:
    # a trend holds strictly: its greatest step the wrong way is below zero, so at most -1e-9
    return Claim(measure, says, AT_MOST, -1e-9, 0.0, FITTED,
                 f'Section VI, {figure}; obtained is the greatest step the wrong way')


# How much calmer 'less chaotic' must be, and which share of the time is 'significant' [percent].
TACH_CALMER, ENCODER_CALMER = 20.0, 30.0
SIGNIFICANT_TIME = 10.0
_CALM = 'less chaotic than without bias'

CLAIMS = (
    _near('T1.tach_rate', 193.0, SHARE * 193.0, DERIVED, 'Section IV; mean of both tachometers '
          'over 1.5 to 3.0 s after each reversal, first period left out; the gear ratio is '
          '193/0.013'),
    *(_near(f'T1.current_{m}', 1.0, SHARE, FITTED, 'Section IV, Fig. 9; window as for the rate')
      for m in (1, 2)),
    *(Claim(f'T2a.current_{m}', 'nonzero, opposite signs', kind, number, 0.0, DERIVED,
            'Section IV, Fig. 12; nonzero means 0.1 A or more; half of the commanded bias')
      for m, kind, number in ((1, AT_MOST, -0.1), (2, AT_LEAST, 0.1))),
    _near('T2a.bias', 15.0, SHARE * 15.0, DERIVED, 'Section IV: a torque bias of 15 percent of '
          'the greatest torque, 46 kGm of 308; the command is computed from it'),
    Claim('T2b.tach', _CALM, AT_MOST, -TACH_CALMER, 0.0, FITTED,
          'Section IV, Figs. 8 and 11; rms of the mean tachometer about N r, 0.25 to 2 s after '
          'each reversal, against T1; at least 20 percent less'),
    Claim('T2b.encoder', _CALM, AT_MOST, -ENCODER_CALMER, 0.0, FITTED,
          'Section IV, Figs. 10 and 13; rms of the axis rate about r, window as for the '
          'tachometer; at least 30 percent less'),
    _near('T3a.high', 10.4, VOLTS, DERIVED, 'Section V, Fig. 19; bias pot 0.8 of Eq. (9) times '
          '13 V', 11.2),
    _near('T3a.high_share', 80.0, 100.0 * VOLTS / SATURATION, DERIVED,
          'Section V: percent of the maximal bias, 13 V', 86.0),
    Claim('T3a.low', 'remains at zero', AT_MOST, 0.0, 0.0, FITTED, 'Section V, Fig. 19'),
    Claim('T3a.time_at_zero', 'for significant periods', AT_LEAST, SIGNIFICANT_TIME, 0.0, FITTED,
          'Section V, Fig. 19; after the first period; significant means a tenth of the time'),
    _near('T3b.low', 7.2, VOLTS, FITTED, 'Section V, Fig. 20', 8.0),
    _near('T3b.high', 11.6, VOLTS, DERIVED, 'Section V, Fig. 20; the bias pot is 11.6/13, see '
          'the contradictions', 11.4),
    _near('T3b.low_share', 56.0, 100.0 * VOLTS / SATURATION, FITTED,
          'Section V: percent of the maximal bias, 13 V', 62.0),
    _near('T3b.high_share', 88.0, 100.0 * VOLTS / SATURATION, DERIVED,
          'Section V: percent of the maximal bias, 13 V; 11.6 of 13 V are 89 percent', 87.0),
    Claim('T3b.time_at_zero', 'nonzero', AT_MOST, 0.0, 0.0, FITTED,
          'Section V, Fig. 20; follows from T3b.low'),
    _near('T4a.final', 22.0, SHARE * 22.0, DERIVED, 'Section VI, Fig. 21(a); the difference gain '
          'is computed from it'),
    _near('T4a.overshoot', 80.0, OVERSHOOT, FITTED, 'Sections VI and VII, Fig. 21(a)'),
    _near('T4a.settling', 2.4, SETTLING, FITTED, 'Section VII; to stay within 5 percent'),
    _trend('T4b.overshoot_trend', 'overshoot falls with gain', 'Fig. 21'),
    _trend('T4b.settling_trend', 'settling time falls with gain', 'Fig. 21'),
    _near('T4c.limit', 146.0, LIMIT, FITTED, "Section VI: unstable above, read as k' of Table 1; "
          'linear, static friction holds the rotors'),
    _near('T4c.simulated', 146.0, LIMIT, FITTED, 'the same limit from simulation: the sign of the '
          'growth of a small disturbance'),
    _trend('T4d.overshoot_trend', 'overshoot falls with tau_6', 'Fig. 22'),
    _trend('T4d.settling_trend', 'settling time falls, then rises', 'Fig. 22'),
    _near('T4e.overshoot', 0.0, OVERSHOOT, FITTED, 'Sections VI and VII, Fig. 23'),
    _near('T4e.settling', 0.8, SETTLING, FITTED, 'Sections VI and VII, Fig. 23; to stay within 5 '
          'percent'),
    _near('T5.g_2', -3.20, SHARE * 3.20, PUBLISHED, 'Eq. (13b); k_2 / s_2 of Table 1, old'),
    _near('T5.g_2_new', -2.38, SHARE * 2.38, PUBLISHED, 'Fig. 16; k_2 / s_2 of Table 1, new'),
    *(_near(f'T5.flat_{-fade:g}', flat, SHARE * flat, PUBLISHED, 'Eq. (14), Fig. 15(a): f_o '
            f'{fade:g} V, greatest |i| of the constant part, calculated by hand')
      for fade, flat in ((-7.0, 1.130), (-9.0, 1.899), (-11.0, 2.668))),
    *(_near(f'T5.zero_{-fade:g}', zero, SHARE * zero, PUBLISHED, 'Eq. (14), Fig. 15(a): f_o '
            f'{fade:g} V, |i| at which the bias reaches zero, f_o / k_2')
      for fade, zero in ((-7.0, 2.692), (-9.0, 3.462), (-11.0, 4.231))),
    *(_near(f'T5.height_{pot:g}', SATURATION * pot, VOLTS, PUBLISHED, 'Eq. (14), Fig. 15(b): bias '
            f'pot {pot:g}, greatest bias') for pot in (0.3, 0.5, 0.7)),
    *(_near(f'T5.slope_{-gain:g}', slope, SHARE * abs(slope), PUBLISHED, 'Eq. (14), Fig. 15(c): '
            f'g_2 {gain:g}, k_p g_2 k_2')
      for gain, slope in ((-2.24, -4.077), (-3.2, -5.824), (-6.4, -11.648))),
    *(_near(f'T5.width_{gain:g}', width, SHARE * width, PUBLISHED, 'Eq. (14), Fig. 15(d): k_2 '
            f'{gain:g}, |i| at which the bias reaches zero')
      for gain, width in ((2.1, 4.286), (2.6, 3.462), (3.1, 2.903))),
    _near('T5.flat_new', 2.187, SHARE * 2.187, PUBLISHED, 'Eq. (14), Fig. 16: greatest |i| of the '
          'constant part, calculated by hand'),
    _near('T5.zero_new', 5.566, SHARE * 5.566, PUBLISHED, 'Eq. (14), Fig. 16: |i| at which the '
          'bias reaches zero, f_o / k_2'),
    *(_near(f'T5.{circuit}_{percent}', float(percent), SHARE * percent, DERIVED,
            f'Fig. {figure}, simulated with a loaded axis: bias where the motors carry no load; '
            'the bias pot is computed from it')
      for figure, circuit in (('2', 'old'), ('17', 'new')) for percent in (10, 20, 30)),
    Claim('T5.fade_out_ratio', 'mild slopes against a sharp decline', AT_LEAST, 1.5, 0.0,
          PREDICTED, 'Section V, Figs. 2 and 17, simulated with a loaded axis at 20 percent: the '
          'range of loads over which the bias fades, new over old; mild means 1.5 or more'),
)
