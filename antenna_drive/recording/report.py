# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The page about a recording: curves to zoom into, figures, configuration."""

from collections.abc import Iterable, Mapping
from typing import Any

from antenna_drive import __version__
from antenna_drive.pages import render
from antenna_drive.recording.figures import MotorStatistics, Statistics, statistics
from antenna_drive.recording.panels import configured, Panel, panels_of, real_amperes
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import sheet_tree
from simgap.report.curves import Panel as PlottedPanel

# Unit, what, value (None if it was not recorded), and how it is defined.
Row = tuple[str, str, str | None, str]


def page(recording: Recording, title: str) -> str:
    """
    Return the page as HTML.

    recording : what the page is about
    title : its name, for people

    Raises RecordingError: there is no sample to draw.
    """
    kappa = real_amperes(recording)
    panels = [_plotted(recording, panel, kappa) for panel in panels_of(recording)]
    return render('recording.html', title=title, lead=_summary(recording), panels=panels,
                  figures=list(_figures(statistics(recording), recording, kappa)),
                  trees=_trees(recording), version=__version__)


def _plotted(recording: Recording, panel: Panel, kappa: float | None) -> PlottedPanel:
    unit = panel.unit
    if unit == 'article A' and kappa:
        unit += f' (1 = {kappa:g} real A)'
    channels = [(name, recording[name]) for name in panel.names]
    return '', panel.title, unit, [(name, channel.time_ns, panel.factor * channel.values)
                                   for name, channel in channels]


def _summary(recording: Recording) -> str:
    count, changes = sum(map(len, recording.channels.values())), len(recording.changes)
    return ' \u00b7 '.join((
        f'{recording.start_ns / 1e9:.12g} s to {recording.end_ns / 1e9:.12g} s',
        f'{len(recording.channels)} signals', f'{count} samples',
        f'{changes} live change{"s" * (changes != 1)}'))


def _number(value: float | None, unit: str = '', digits: int = 4) -> str | None:
    return None if value is None else f'{value:.{digits}g} {unit}'.rstrip()


def _share(value: float | None) -> str | None:
    return None if value is None else f'{100.0 * value:.1f} %'


def _figures(figures: Statistics, recording: Recording, kappa: float | None) -> Iterable[Row]:
    bias = figures.bias
    if bias:
        yield ('torque_share', 'bias voltage',
               f'{bias.minimum_V:.4g} to {bias.maximum_V:.4g} V', 'lowest to highest')
        yield ('torque_share', 'bias at zero', _share(bias.at_zero),
               f'share of time at or below {bias.zero_V:g} V')
    else:
        yield 'torque_share', 'bias voltage', None, ''
    for motor, own in figures.motors.items():
        yield from _motor_rows(motor, own, recording, kappa)
    yield ('plant', 'axis stands still', _share(figures.axis_stick),
           'share of time that the axis rate is zero')


def _motor_rows(motor: str, own: MotorStatistics, recording: Recording,
                kappa: float | None) -> Iterable[Row]:
    peak = own.current_peak_A
    real = f', {peak * kappa:.4g} real A' if peak is not None and kappa else ''
    limit = configured(recording, motor, 'motor.current_limit')
    limited = '' if limit is None else f'; limit {limit:g} article A'
    at = '' if own.current_peak_s is None else f'at {own.current_peak_s:g} s{real}{limited}'
    yield motor, 'current peak', _number(peak, 'article A'), at
    yield motor, 'current, root mean square', _number(own.current_rms_A, 'article A'), ''
    still = '' if own.still_rad_s is None else (
        f'share of time that the rate is {"zero" if not own.still_rad_s else "within"}'
        + (f' {own.still_rad_s:g} rad/s' if own.still_rad_s else ''))
    yield motor, 'rotor stands still', _share(own.stick), still
    yield (motor, 'backlash crossings', _number(own.backlash_crossings, digits=7),
           'changes of the flank that bears, by the sign of the gear torque')


def _trees(recording: Recording) -> list[tuple[str, bool, list[tuple[str, str]]]]:
    """Return what else is known: a title, whether it is shown at once, names and values."""
    # the number keeps apart several changes of one step
    changes = {f'{number}. step {change.step}': {change.unit: change.values}
               for number, change in enumerate(recording.changes, 1)}
    return [(title, shown, list(_rows(tree))) for title, shown, tree in (
        ('Live changes', True, changes),
        ('Test sheet', True, sheet_tree(recording.sheet)),
        ('Notes', False, recording.notes),
        ('Configuration in force at the start', False, recording.configuration))]


def _rows(tree: Mapping[str, Any], path: str = '') -> Iterable[tuple[str, str]]:
    for key, value in tree.items():
        name = f'{path}.{key}' if path else key
        if isinstance(value, Mapping):
            yield from _rows(value, name)
        else:
            yield name, (', '.join(map(str, value)) if isinstance(value, (tuple, list))
                         else str(value))
