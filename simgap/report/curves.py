# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Curves as the plotter of the pages reads them: thinned, and packed to four bytes a sample."""

import base64
from collections.abc import Mapping, Sequence
import math
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Colours that stay apart for colour-blind readers and in print (Okabe and Ito).
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9')
# A curve of more samples is thinned to the lowest and the highest of as many runs as needed. Where
# one chooses among signals, all panels share so many, but each has the least at least.
MOST_SAMPLES, _LEAST_SAMPLES = 40_000, 4_000

# Name, times as floats [s] or as whole numbers [ns], and values; both arrays of shape (n,).
Curve = tuple[str, NDArray[Any], NDArray[np.float64]]
# Group, title, unit and curves: the panels of a group show the same span of time.
Panel = tuple[str, str, str, Sequence[Curve]]


def plotted(panels: Sequence[Panel], colours: Mapping[str, str] = MappingProxyType({}),
            signals: Sequence[str] = (), wide: str = '') -> dict[str, Any]:
    """
    Return panels as the plain data that plotter.js reads, in the order in which they are drawn.

    What is not finite is left out, be it a sample, a curve or a panel. `colours` are those of
    curves by name; the others take theirs from COLOURS in turn. `signals` are those of the panels
    to choose from; the first of a group is shown at first. `wide` is a curve that others cover.
    """
    most = max(MOST_SAMPLES // len(panels), _LEAST_SAMPLES) if signals else MOST_SAMPLES
    found = [{
        'group': group, 'title': title, 'unit': unit, 'signal': signal,
        'curves': [_packed(name, time[there], values[there], colours.get(name, colour), most)
                   | {'width': 3.0 if name == wide else 1.4}
                   for (name, time, values), colour in zip(curves, COLOURS * len(curves))
                   if (there := np.isfinite(values)).any()],
    } for (group, title, unit, curves), signal in zip(panels, signals or [''] * len(panels))]
    return {'panels': [panel for panel in found if panel['curves']]}


def kept(values: NDArray[np.float64], most: int = MOST_SAMPLES) -> tuple[NDArray[np.intp], int]:
    """
    Return which samples show the same curve, `most` or few more, and of how many two are kept.

    Of each run of samples only the lowest and the highest are kept, so that no peak is lost.
    """
    if len(values) <= most:
        return np.arange(len(values)), 1
    width = math.ceil(2 * len(values) / most)
    whole = len(values) // width * width
    runs = values[:whole].reshape(-1, width)
    first = np.arange(0, whole, width)
    found = [first + runs.argmin(axis=1), first + runs.argmax(axis=1), [0, len(values) - 1]]
    if whole < len(values):
        rest = values[whole:]
        found.append([whole + rest.argmin(), whole + rest.argmax()])
    return np.unique(np.concatenate(found)), width


def _packed(name: str, time: NDArray[Any], values: NDArray[np.float64],
            colour: str, most: int) -> dict[str, Any]:
    stamps = time if time.dtype.kind == 'i' else np.rint(1e9 * time).astype(np.int64)
    chosen, width = kept(values, most)
    stamps, values = stamps[chosen], values[chosen]
    # shares of the widest difference from the first value: four bytes are then enough
    base = float(values[0])
    with np.errstate(over='ignore'):
        scale = float(np.abs(values - base).max()) or 1.0
    if math.isinf(scale):
        base, scale = 0.0, float(np.abs(values).max())
    since = stamps - stamps[0]
    steps = np.diff(since)
    even = len(steps) > 0 and bool(np.all(steps == steps[0]))
    return {'name': name, 'colour': colour, 'n': len(values), 'thinned': width,
            'base': base, 'scale': scale, 'start': int(stamps[0]) / 1e9,
            'step': int(steps[0]) / 1e9 if even else None,
            'times': None if even else _base64(since / 1e9, '<f8'),
            'values': _base64((values - base) / scale, '<f4')}


def _base64(numbers: NDArray[Any], kind: str) -> str:
    return base64.b64encode(numbers.astype(kind).tobytes()).decode('ascii')
