# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The scorecard as a picture: confusion matrix, reliability diagram, hits by size."""

from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
import numpy as np

INCHES_PER_LABEL = 0.19
INK, GRID = '#1a3a5f', '#d0d4da'


def draw_scorecard(figures: dict[str, Any], path: Path) -> None:
    """Draw the figures of `scorecard.score` to a file; the suffix selects the format."""
    table = figures['confusion']
    rows = sorted(table)
    named = {answer for row in table.values() for answer in row}
    columns = [row for row in rows if row in named] + sorted(named - set(rows))
    height = max(8.0, INCHES_PER_LABEL * len(rows) + 3.0)
    width = max(8.0, INCHES_PER_LABEL * len(columns) + 4.0)
    with matplotlib.rc_context({'font.size': 7, 'svg.hashsalt': 'antenna_drive'}):
        figure = Figure(figsize=(width + 5.0, height), layout='constrained')
        grid = figure.add_gridspec(2, 2, width_ratios=(width, 5.0))
        _confusion(figure.add_subplot(grid[:, 0]), table, rows, columns)
        _reliability(figure.add_subplot(grid[0, 1]), figures)
        _sizes(figure.add_subplot(grid[1, 1]), figures['by_size'])
        figure.savefig(path, dpi=130)


def _confusion(axes: Any, table: dict[str, dict[str, int]], rows: list[str],
               columns: list[str]) -> None:
    shares = np.zeros((max(len(rows), 1), max(len(columns), 1)))
    for i, row in enumerate(rows):
        total = sum(table[row].values())
        for answer, count in table[row].items():
            j = columns.index(answer)
            shares[i, j] = count / total
            axes.text(j, i, str(count), ha='center', va='center', fontsize=6,
                      color='white' if count / total > 0.5 else INK)
    axes.imshow(shares, cmap='Blues', vmin=0.0, vmax=1.0, aspect='auto')
    axes.set_xticks(range(len(columns)), columns, rotation=90)
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which='minor', color=GRID, linewidth=0.4)
    axes.tick_params(which='both', length=0)
    axes.set_xlabel('named first')
    axes.set_ylabel('true')
    axes.set_title('Confusion: number of cases, shade by share of the row (without pairs)',
                   fontsize=10, loc='left')


def _reliability(axes: Any, figures: dict[str, Any]) -> None:
    bins = [b for b in figures['reliability'] if b['cases']]
    axes.plot([0, 1], [0, 1], color=GRID, zorder=0)
    axes.bar([0.5 * (b['low'] + b['high']) for b in bins], [b['accuracy'] for b in bins],
             width=0.09, color='#9dbbd9', label='right')
    axes.plot([b['confidence'] for b in bins], [b['accuracy'] for b in bins], 'o', color=INK,
              label='at its mean confidence')
    for b in bins:
        axes.annotate(str(b['cases']), (b['confidence'], b['accuracy']), fontsize=6,
                      xytext=(0, 5), textcoords='offset points', ha='center')
    axes.set(xlim=(0, 1), ylim=(0, 1.08), xlabel='stated probability of the first answer',
             ylabel='share that is right')
    axes.set_title(f'Reliability, calibration error {figures["ece"]:.3f}', fontsize=10, loc='left')
    axes.legend(loc='upper left', frameon=False)


def _sizes(axes: Any, by_size: dict[str, dict[str, Any]]) -> None:
    places = np.arange(len(by_size))
    for shift, name, colour in ((-0.2, 'top1', INK), (0.2, 'top3', '#9dbbd9')):
        values = [group[name] for group in by_size.values()]
        axes.bar(places + shift, np.nan_to_num(values), width=0.38, color=colour, label=name)
    axes.set_xticks(places, [f'{size}\n{group["cases"]} cases' for size, group in by_size.items()])
    axes.set(ylim=(0, 1.15), ylabel='share of single effects')
    axes.set_title('Hits by size of the effect', fontsize=10, loc='left')
    axes.legend(loc='upper right', ncols=2, frameon=False)
