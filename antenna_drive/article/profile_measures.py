# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""T5: figures of the static bias profile (Figs. 15, 16) and of the loaded axis (Figs. 2, 17)."""

from collections.abc import Callable
from functools import partial

from antenna_drive.article import static_profile
from antenna_drive.article.loaded_axis import bias_at_rest, fade_out, loaded, SHARES
from antenna_drive.article.measures import Measure, ModelFigure, NEW_CIRCUIT, OLD_CIRCUIT, Results
from antenna_drive.article.static_profile import (
    as_in_the_text, corners, NEW_GAIN, TEXT_FADE_OUT, TEXT_GAIN,
)
from antenna_drive.parameters import Drive
from antenna_drive.parameters.sets import changed, TorqueShare
import numpy as np

# The torque bias at which the fade-out of the circuits is compared, share of the greatest torque.
_COMPARED_AT = 0.2
CIRCUITS = {'old': OLD_CIRCUIT, 'new': NEW_CIRCUIT}


def _of_circuit(figure: Callable[[TorqueShare], float], drive: Drive) -> float:
    return figure(drive.torque_share.circuit)


def _dc_gain(share: TorqueShare) -> float:
    return share.k_2 / share.s_2


def _slope(share: TorqueShare, gain: float) -> float:
    """Return the slope between the corners of the profile at a DC gain g_2 [V/A]."""
    text = changed(as_in_the_text(share), {'k_2': gain * share.s_2})
    edges = corners(text)
    inner = np.linspace(edges.flat_A, edges.zero_A, 5)[1:-1]
    return float(np.polyfit(inner, static_profile.bias_voltage(text, inner), 1)[0])


def _height(share: TorqueShare, pot: float) -> float:
    text = changed(as_in_the_text(share), {'bias_pot': pot})
    return float(static_profile.bias_voltage(text, np.linspace(-5.0, 5.0, 101)).max())


def _flat(share: TorqueShare, gain: float = TEXT_GAIN, fade_out: float = TEXT_FADE_OUT) -> float:
    return corners(as_in_the_text(share, gain, fade_out)).flat_A


def _zero(share: TorqueShare, gain: float = TEXT_GAIN, fade_out: float = TEXT_FADE_OUT) -> float:
    return corners(as_in_the_text(share, gain, fade_out)).zero_A


def profile_measures() -> dict[str, Measure]:
    """Return the figures of the static profile with Eq. (14)'s own numbers, by name."""
    figures: list[tuple[str, str, Callable[[TorqueShare], float], str]] = [
        ('g_2', '1', _dc_gain, OLD_CIRCUIT),
        ('g_2_new', '1', _dc_gain, NEW_CIRCUIT),
        ('flat_new', 'article A', partial(_flat, gain=NEW_GAIN), NEW_CIRCUIT),
        ('zero_new', 'article A', partial(_zero, gain=NEW_GAIN), NEW_CIRCUIT),
    ]
    for fade in (-7.0, -9.0, -11.0):
        figures += [(f'flat_{-fade:g}', 'article A', partial(_flat, fade_out=fade), OLD_CIRCUIT),
                    (f'zero_{-fade:g}', 'article A', partial(_zero, fade_out=fade), OLD_CIRCUIT)]
    figures += [(f'height_{pot:g}', 'V', partial(_height, pot=pot), OLD_CIRCUIT)
                for pot in (0.3, 0.5, 0.7)]
    figures += [(f'slope_{-gain:g}', 'V/article A', partial(_slope, gain=gain), OLD_CIRCUIT)
                for gain in (-2.24, -3.2, -6.4)]
    figures += [(f'width_{gain:g}', 'article A', partial(_zero, gain=gain), OLD_CIRCUIT)
                for gain in (2.1, 2.6, 3.1)]
    return {f'T5.{name}': ModelFigure(f'T5.{name}', unit, partial(_of_circuit, figure), circuit)
            for name, unit, figure, circuit in figures}


def _bias_at_rest(circuit: str, share: float, drive: Drive) -> float:
    return bias_at_rest(loaded(drive, circuit, share))


class _FadeOutRatio(Measure):
    """How much wider the new circuit's fade-out is than the old one's, on the loaded axis."""

    def value(self, results: Results) -> float:
        """Return the ratio of the loads over which the bias fades out."""
        widths = []
        for circuit in (OLD_CIRCUIT, NEW_CIRCUIT):
            axis = loaded(results.drives[circuit], circuit, _COMPARED_AT)
            begin, end = fade_out(axis.drive, axis.bias)
            widths.append(end - begin)
        return widths[1] / widths[0]


def loaded_axis_measures() -> dict[str, Measure]:
    """Return the figures of the loaded axis, by name."""
    ratio = _FadeOutRatio('T5.fade_out_ratio', '1')
    figures: dict[str, Measure] = {ratio.name: ratio}
    for name, circuit in CIRCUITS.items():
        for share in SHARES:
            row = f'T5.{name}_{100.0 * share:.0f}'
            figures[row] = ModelFigure(row, 'percent', partial(_bias_at_rest, circuit, share),
                                       circuit)
    return figures
