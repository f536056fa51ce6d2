# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The article's figures, drawn from new runs with the article's axes and units.

Figures 4 to 7 and 14 are block diagrams and are left out. Of Figs. 8 to 13 the simulated side is
drawn. The drawings follow the article's text and captions; its pictures are not copied.
"""

from base64 import b64encode
from collections.abc import Callable, Sequence
from functools import partial
import io
import math
from pathlib import Path
from typing import Any

from antenna_drive.article import loaded_axis, static_profile
from antenna_drive.article.experiments import GAINS, LAGS, SAW_TOOTH
from antenna_drive.article.measures import NEW_CIRCUIT, OLD_CIRCUIT, Results
from antenna_drive.article.static_profile import as_in_the_text, bias_voltage, NEW_GAIN
from antenna_drive.pages import render
from antenna_drive.parameters.sets import changed, TorqueShare
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
import numpy as np
from simgap.inputs.plain_yaml import read_yaml
from simgap.laws.backlash import dead_zone
from simgap.laws.friction import friction_torque

# Width of two columns on A4 [inch].
_WIDTH = 6.6
_STYLE: dict[str, Any] = {
    'font.size': 9.0, 'axes.grid': True, 'grid.linewidth': 0.4, 'grid.color': '0.85',
    'lines.linewidth': 1.1, 'axes.linewidth': 0.7, 'legend.frameon': False,
    'legend.fontsize': 8.0, 'axes.titlesize': 9.0, 'axes.titlelocation': 'left',
    'svg.hashsalt': 'antenna_drive', 'svg.fonttype': 'path',
}
_DASHED, _DASH_DOT, _DOTTED = '--', '-.', ':'
_BLACK, _BLUE, _RED, _GREY = '0.1', '#1f5fa8', '#c0392b', '0.6'
_DEGREES = 180.0 / math.pi


def _new(rows: int = 1, height: float = 2.6, columns: int = 1, **shared: Any) -> Any:
    figure = Figure(figsize=(_WIDTH, height), layout='constrained')
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **shared)


def _one() -> Any:
    figure, axes = _new()
    return figure, axes[0, 0]


def backlash(results: Results) -> Figure:
    """Fig. 1: Eq. (1) for b = 1 deg and k = 20 N m/deg."""
    figure, axes = _one()
    twist = np.linspace(-3.0, 3.0, 601)
    axes.plot(twist, [20.0 * dead_zone(x, 1.0) for x in twist], color=_BLACK)
    axes.set(xlabel='Angle difference Δβ, deg', ylabel='Torque, N m', xlim=(-3, 3))
    return figure


def friction(results: Results) -> Figure:
    """Fig. 3: Eq. (2), with the stiction torque that bounds it at rest."""
    figure, axes = _one()
    motor = results.drives[OLD_CIRCUIT].motor_1.motor
    coulomb, stiction = 1.0, motor.stiction_ratio
    for side in (-1.0, 1.0):
        rate = side * np.linspace(1e-3, 1.0, 200)
        axes.plot(rate, [friction_torque(v, 0.0, coulomb, stiction, 0.0) for v in rate],
                  color=_BLACK)
    axes.plot([0.0, 0.0], [-stiction, stiction], color=_BLACK)
    axes.annotate('$T_s$', (0.0, stiction), xytext=(6, -4), textcoords='offset points')
    axes.annotate('$-T_s$', (0.0, -stiction), xytext=(6, -2), textcoords='offset points')
    axes.annotate('$-T_c$', (0.5, -coulomb), xytext=(0, 5), textcoords='offset points')
    axes.annotate('$T_c$', (-0.5, coulomb), xytext=(0, 5), textcoords='offset points')
    axes.set(xlabel='Relative velocity, share of the range shown',
             ylabel='Friction torque / $T_c$', xlim=(-1, 1), ylim=(-1.6, 1.6))
    return figure


def _loaded(results: Results, circuit: str) -> Figure:
    """Draw motor torque against axial torque: the dynamic model and Eq. (14) alone."""
    figure, axes = _new(3, 7.2, sharex=True)
    drive = results.drives[circuit]
    load = np.linspace(-100.0, 100.0, 801)
    for axis, share in zip(axes[:, 0], loaded_axis.SHARES):
        loop = loaded_axis.loaded(drive, circuit, share)
        for motor, colour in ((0, _BLUE), (1, _RED)):
            for rising, style in ((True, '-'), (False, _DASHED)):
                axis.plot(np.where(loop.rising == rising, loop.load, np.nan),
                          loop.torques[:, motor], style, color=colour, linewidth=0.8,
                          label=f'motor {motor + 1}, load {"rising" if rising else "falling"}')
        static = loaded_axis.by_equation_14(drive, share, load)
        axis.plot(load, static[:, 0], color=_BLACK, linewidth=1.0, label='Eq. (14) alone')
        axis.plot(load, static[:, 1], color=_BLACK, linewidth=1.0)
        axis.set(ylabel='Motor torque, percent', ylim=(-100, 100), xlim=(-100, 100),
                 title=f'bias {100.0 * share:.0f} percent')
    axes[0, 0].legend(ncols=2, loc='upper left')
    axes[-1, 0].set_xlabel('Axial torque, percent')
    return figure


def _square_wave(results: Results, name: str, signals: Sequence[tuple[str, str, str]],
                 scale: float, label: str) -> Figure:
    figure, axes = _one()
    run = results.run(name)
    for signal, text, style in signals:
        axes.plot(run.time, scale * run[signal], style,
                  color=_BLUE if 'motor_1' in signal else _RED if 'motor_2' in signal else _BLACK,
                  label=text)
    axes.set(xlabel='Time, s', ylabel=label, xlim=(0, run.time[-1]))
    if len(signals) > 1:
        axes.legend(ncols=2, loc='upper right')
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.18 * (high - low))
    return figure


_tachs, _currents = (
    partial(_square_wave, scale=scale, label=label, signals=[
        (f'motor_1/{signal}', 'motor 1', '-'), (f'motor_2/{signal}', 'motor 2', _DASHED)])
    for signal, scale, label in (('tach_rate', _DEGREES, 'Tachometer rate, deg/s'),
                                 ('current', 1.0, "Motor current, A (the article's)")))
_encoder = partial(_square_wave, signals=[('plant/encoder', 'encoder', '-')], scale=_DEGREES,
                   label='Encoder, deg')


def bias_fade_out(results: Results) -> Figure:
    """Fig. 15: Eq. (14) for its four parameters in turn."""
    figure, axes = _new(2, 5.0, 2, sharey=True)
    text = as_in_the_text(results.drives[OLD_CIRCUIT].torque_share.circuit)
    dc_gain = text.k_2 / text.s_2
    panels = (
        ('(a) fade-out voltage', [
            (f'{volts:g} V', style, {'fade_out_voltage': volts})
            for volts, style in ((-7.0, _DASHED), (-9.0, '-'), (-11.0, _DASH_DOT))]),
        ('(b) bias pot', [(f'{pot:g}', style, {'bias_pot': pot})
                          for pot, style in ((0.3, _DASH_DOT), (0.5, _DASHED), (0.7, '-'))]),
        ('(c) gain $g_2$', [
            (f'{gain:.2f}', style, {'k_2': gain / -3.2 * -abs(dc_gain) * text.s_2})
            for gain, style in ((-3.2, '-'), (-6.4, _DASHED), (-2.24, _DASH_DOT))]),
        ('(d) gain $k_2$', [(f'{gain:g}', style, {'g_4': gain})
                            for gain, style in ((2.1, _DASHED), (2.6, '-'), (3.1, _DASH_DOT))]),
    )
    for axis, (title, curves) in zip(axes.flat, panels):
        for label, style, settings in curves:
            _profile(axis, changed(text, settings), style, label)
        axis.set_title(title)
        axis.legend(loc='upper right')
    for axis in axes[1]:
        axis.set_xlabel("Current $i_1 + i_2$, A (the article's)")
    for axis in axes[:, 0]:
        axis.set_ylabel('Bias voltage, V')
    return figure


def _profile(axis: Any, share: TorqueShare, style: str, label: str, colour: str = _BLACK) -> None:
    current = np.linspace(-8.0, 8.0, 801)
    axis.plot(current, bias_voltage(share, current), style, color=colour, label=label)
    axis.set(xlim=(-8, 8), ylim=(-0.3, 11.5))


def bias_slopes(results: Results) -> Figure:
    """Fig. 16: Eq. (14) with the modified and the existing gains."""
    figure, axes = _one()
    for circuit, gain, style, label in (
            (NEW_CIRCUIT, NEW_GAIN, '-', '$g_2$ = -2.38, $k_2$ = 1.617'),
            (OLD_CIRCUIT, static_profile.TEXT_GAIN, _DASHED, '$g_2$ = -3.20, $k_2$ = 2.6')):
        share = results.drives[circuit].torque_share.circuit
        _profile(axes, as_in_the_text(share, gain), style, label)
    axes.set(xlabel="Current $i_1 + i_2$, A (the article's)", ylabel='Bias voltage, V')
    axes.legend(loc='upper right')
    return figure


def saw_tooth(results: Results) -> Figure:
    """Fig. 18: the rate command of the saw-tooth test."""
    figure, axes = _one()
    run = results.run('T3a')
    axes.plot(run.time, _DEGREES * run['test_signal/rate_command'], color=_BLACK)
    axes.set(xlabel='Time, s', ylabel='Rate command, deg/s', xlim=(0, run.time[-1]))
    return figure


def _bias(results: Results, name: str, low: float | None, high: float) -> Figure:
    figure, axes = _one()
    run = results.run(name)
    axes.plot(run.time, run['torque_share/bias_voltage'], _DASHED, color=_BLACK,
              label='simulated')
    for volts, text in ((high, "the article's analysis"), (low, None)):
        if volts is not None:
            axes.axhline(volts, color=_GREY, linewidth=0.8, linestyle=_DOTTED, label=text)
    axes.axvspan(0.0, SAW_TOOTH['period'], color='0.95')
    axes.set(xlabel='Time, s', ylabel='Bias voltage, V', xlim=(0, run.time[-1]), ylim=(-0.3, 13.9))
    axes.legend(loc='upper right', ncols=2)
    return figure


def _responses(results: Results, names: Sequence[tuple[str, str]], end: float) -> Figure:
    figure, axes = _new(len(names), 1.35 * len(names) + 0.5 if len(names) > 1 else 2.6,
                        sharex=True)
    for axis, (name, title) in zip(axes[:, 0], names):
        run = results.run(name)
        most = results.drives[OLD_CIRCUIT].motor_1.motor.current_limit
        axis.plot(run.time, 100.0 * (run['motor_2/current'] - run['motor_1/current']) / most,
                  color=_BLACK)
        axis.axhline(22.0, color=_GREY, linewidth=0.8, linestyle=_DOTTED)
        axis.set(xlim=(0, end), ylim=(0, 42), title=title)
    axes[len(names) // 2, 0].set_ylabel('Torque bias Δi / $i_{max}$, percent')
    axes[-1, 0].set_xlabel('Time, s')
    return figure


def gains(results: Results) -> Figure:
    """Fig. 21: torque bias for five gains of Filter 1."""
    return _responses(results, [(f'T4b {gain:g}', f'({letter}) $k_{{ctfr}}$ = {gain:.2f}')
                                for letter, gain in zip('abcde', GAINS)], 4.0)


def lags(results: Results) -> Figure:
    """Fig. 22: torque bias for five time constants of Filter 1."""
    return _responses(results, [(f'T4d {lag:g}', rf'({letter}) $\tau_6$ = {lag:g} s')
                                for letter, lag in zip('abcde', LAGS)], 4.0)


# Drawing functions by number of the figure.
FIGURES: dict[int, Callable[[Results], Figure]] = {
    1: backlash,
    2: partial(_loaded, circuit=OLD_CIRCUIT),
    3: friction,
    8: partial(_tachs, name='T1'),
    9: partial(_currents, name='T1'),
    10: partial(_encoder, name='T1'),
    11: partial(_tachs, name='T2'),
    12: partial(_currents, name='T2'),
    13: partial(_encoder, name='T2'),
    15: bias_fade_out,
    16: bias_slopes,
    17: partial(_loaded, circuit=NEW_CIRCUIT),
    18: saw_tooth,
    19: partial(_bias, name='T3a', low=None, high=10.4),
    20: partial(_bias, name='T3b', low=7.2, high=11.6),
    21: gains,
    22: lags,
    23: partial(_responses, names=[('T4e', '')], end=4.0),
}


def draw_all(results: Results, progress: Callable[[int, int], None] | None = None,
             ) -> dict[str, bytes]:
    """
    Draw every figure.

    results : of the parameter set
    progress : called with the number of figures done and their total

    Returns the files by name: fig_01.svg and so on, and figures.html with all of them.
    """
    files, parts = {}, []
    captions = read_yaml(Path(__file__).with_suffix('.yaml'))
    with rc_context(_STYLE):
        for done, (number, draw) in enumerate(FIGURES.items()):
            if progress:
                progress(done, len(FIGURES))
            drawing = io.BytesIO()
            draw(results).savefig(drawing, format='svg', metadata={'Date': None})
            files[f'fig_{number:02d}.svg'] = drawing.getvalue()
            parts.append((number, captions[number], b64encode(drawing.getvalue()).decode()))
    files['figures.html'] = render(
        'figures.html', title="The article's figures, redrawn",
        lead='Each figure is also a file of its own.', figures=parts).encode()
    return files
