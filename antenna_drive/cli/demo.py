# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Run the saw-tooth test on the old and on the new torque-share circuit, in five ROS 2 processes.

The test is the one of Figs. 18-20: 0.685 deg/s, 5 s. The command prints the published bias
voltages beside those obtained and writes, into the folder --out:

  summary.json         the figures
  bias_voltage.png     both runs, with the published ranges
  old_circuit.csv, new_circuit.csv    every signal at every step
"""

from __future__ import annotations

import argparse
from pathlib import Path
import tempfile
from typing import Any, TYPE_CHECKING

from simgap.command.output import Progress, write_json

if TYPE_CHECKING:  # the nodes' library is missing on some machines, which is said in one line
    from antenna_drive.article.readings import BiasRange
    from antenna_drive.lockstep.sampling import Sampled

# Experiment, circuit, and the published range of the bias voltage [V]: analysis and field.
_TESTS = {
    'old': ('T3a', 'old_circuit', (0.0, 10.4), (0.0, 11.2)),
    'new': ('T3b', 'new_circuit', (7.2, 11.6), (8.0, 11.4)),
}
_BIAS = 'torque_share/bias_voltage'
_STEP_S = 1e-3
# The first period, in which the drive starts up, is left out of the figures.
_AFTER_S = 5.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--out', type=Path, default=Path('out/demo'), metavar='DIR',
                        help='folder for the results (default: %(default)s)')


def run(args: argparse.Namespace) -> int:
    """Run both tests; return 0 if the bias voltages are the published ones, 1 if not."""
    from antenna_drive.article.experiments import experiments
    from antenna_drive.article.readings import bias_range
    import numpy as np

    args.out.mkdir(parents=True, exist_ok=True)
    runs: dict[str, Sampled] = {}
    ranges: dict[str, BiasRange] = {}
    for name, (test, circuit, analysis, field) in _TESTS.items():
        print(f'{name} circuit, in five processes', flush=True)
        runs[name] = _through_processes(experiments()[test], circuit)
        time = np.arange(runs[name].samples.shape[0], dtype=np.float64) * _STEP_S
        voltage = runs[name].samples[:, runs[name].names.index(_BIAS), 0]
        ranges[name] = found = bias_range(time, voltage, _AFTER_S)
        print(f'  published, analysis  {analysis[0]:4.1f} to {analysis[1]:4.1f} V\n'
              f'  published, field     {field[0]:4.1f} to {field[1]:4.1f} V\n'
              f'  obtained             {found.low_V:4.1f} to {found.high_V:4.1f} V, '
              f'{100 * found.zero_fraction:.0f} percent of the time at zero', flush=True)
        _write_series(args.out / f'{circuit}.csv', runs[name])
    summary = _summary(runs, ranges)
    write_json(summary, args.out / 'summary.json')
    _draw(args.out / 'bias_voltage.png', runs)
    print(f'{summary["steps"]} steps in {summary["wall_s"]:.1f} s, '
          f'{summary["real_time_factor"]:.1f} times real time; results in {args.out}')
    return 0 if _as_published(ranges) else 1


def _through_processes(experiment: Any, circuit: str) -> Sampled:
    from antenna_drive.lockstep.sampling import sample_processes

    steps = round(experiment.duration / _STEP_S)
    with Progress('  saw-tooth', steps) as progress:
        return sample_processes(steps, _STEP_S, name='demo', settings=experiment.settings,
                                config=[circuit], progress=progress.update)


def _write_series(path: Path, sampled: Sampled) -> None:
    from antenna_drive.recording.csv_format import write_csv
    from antenna_drive.recording.recording import Recording
    import numpy as np

    recording = Recording.from_arrays(
        np.arange(sampled.samples.shape[0]) * _STEP_S,
        {name: sampled.samples[:, column, 0] for column, name in enumerate(sampled.names)})
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        for written in write_csv(recording, Path(folder) / path.name):
            written.replace(path.parent / written.name)


def _summary(runs: dict[str, Sampled], ranges: dict[str, BiasRange]) -> dict[str, Any]:
    steps = sum(sampled.samples.shape[0] - 1 for sampled in runs.values())
    wall_s = sum(sampled.wall_s for sampled in runs.values())
    return {
        'processes': min(sampled.processes for sampled in runs.values()),
        **{name: {'bias_min_V': found.low_V, 'bias_max_V': found.high_V,
                  'zero_fraction': found.zero_fraction} for name, found in ranges.items()},
        'steps': steps,
        'wall_s': wall_s,
        'real_time_factor': steps * _STEP_S / wall_s,
    }


def _as_published(ranges: dict[str, BiasRange]) -> bool:
    old, new = ranges['old'], ranges['new']
    return (old.low_V == 0.0 and abs(old.high_V - 10.4) <= 0.2 and old.zero_fraction >= 0.1
            and abs(new.low_V - 7.2) <= 0.3 and abs(new.high_V - 11.6) <= 0.2
            and new.zero_fraction == 0.0)


def _draw(path: Path, runs: dict[str, Sampled]) -> None:
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    import numpy as np

    figure, axes = pyplot.subplots(len(runs), 1, sharex=True, figsize=(8.0, 6.0),
                                   layout='constrained')
    for axis, (name, sampled) in zip(axes, runs.items(), strict=True):
        _, _, analysis, _ = _TESTS[name]
        time = np.arange(sampled.samples.shape[0]) * _STEP_S
        axis.axhspan(*analysis, color='tab:orange', alpha=0.15,
                     label='published range, analysis')
        axis.plot(time, sampled.samples[:, sampled.names.index(_BIAS), 0], linewidth=1.2,
                  label='five ROS 2 processes')
        axis.set(title=f'{name} circuit', ylabel='bias voltage [V]', ylim=(-0.5, 13.0),
                 xlim=(0.0, time[-1]))
        axis.grid(alpha=0.3)
    axes[-1].legend(loc='lower right', framealpha=0.9)
    axes[-1].set_xlabel('time [s]')
    figure.suptitle('Torque bias under the saw-tooth, 0.685 deg/s, 5 s')
    figure.savefig(path, dpi=150)
    pyplot.close(figure)
