# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The groups of the benchmark, run one after another, and their figures as a table."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
import importlib
import time
from typing import Any

from lab.bench.measuring import machine
from simgap.errors import UserError

_MODULES = {'transport': 'transport', 'simulation': 'simulation', 'batch': 'batches',
            'diagnosis': 'diagnosis', 'fleet': 'fleet', 'start': 'start', 'live': 'live'}

# Goals of the headline figures: at least (+) or at most (-) the number.
GOALS: dict[str, tuple[str, float]] = {
    'transport.ratio_to_bare': ('+', 0.8),
    'transport.ratio_to_bare_compiled': ('+', 0.8),
    'transport.ratio_to_bare_compiled_placed': ('+', 0.8),
    'transport.rtf_1ms': ('+', 3.5),
    'transport.rtf_1ms_placed': ('+', 5.0),
    'transport.rtf_1ms_busy': ('+', 2.0),
    'transport.rtf_05ms': ('+', 2.0),
    'transport.cpu_per_step_us': ('-', 80.0),
    'transport.first_step_s': ('-', 2.0),
    'transport.late_fraction': ('-', 1e-3),
    'transport.late_fraction_05ms': ('-', 1e-2),
    'simulation.speedup.python_control': ('+', 50.0),
    'simulation.speedup.pathsim': ('+', 50.0),
    'simulation.speedup.solve_ivp': ('+', 20.0),
    'simulation.speedup.drake': ('+', 5.0),
    'simulation.ratio_to_c': ('+', 0.5),
    'batch.two_core_speedup': ('+', 1.8),
    'diagnosis.took_s': ('-', 15.0),
    'diagnosis.peak_memory_MB': ('-', 600.0),
    'diagnosis.two_core_speedup': ('+', 1.7),
    'fleet.two_worker_speedup': ('+', 1.8),
    'start.second_first_step_s': ('-', 1.5),
    'live.first_curve_s': ('-', 10.0),
    'live.slider_ms': ('-', 50.0),
    'live.rate_share_paced': ('+', 0.95),
    'live.rate_share': ('+', 0.95),
    'live.lost_steps': ('-', 0.0),
}


def measure(groups: Iterable[str], repetitions: int, quick: bool,
            progress: Callable[[str], None],
            options: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Any]:
    """
    Measure groups one after another; return the machine and the figures of each group.

    A group that cannot be measured here has an entry `left_out` with the reason instead. Medians
    are over `repetitions` turns; `quick` has shorter runs and fewer settings. `progress` gets a
    description of each measurement, `options` has further arguments of a group's `measure`.
    """
    result: dict[str, Any] = {'machine': machine(), 'quick': quick, 'repetitions': repetitions}
    for group in groups:
        module = importlib.import_module(f'lab.bench.{_MODULES[group]}')
        began = time.monotonic()
        try:
            result[group] = module.measure(repetitions, quick, partial(_report, progress, group),
                                           **(options or {}).get(group, {}))
        except ModuleNotFoundError as error:
            result[group] = {'left_out': {group: f'{error.name} is not installed'}}
        except UserError as error:
            result[group] = {'left_out': {group: str(error)}}
        result[group]['wall_s'] = time.monotonic() - began
    result['load_average_after'] = machine()['load_average']
    return result


def _report(progress: Callable[[str], None], group: str, doing: str) -> None:
    progress(f'{group}: {doing}')


def table(result: Mapping[str, Any]) -> str:
    """Return the figures of a result, one per line, with their goals."""
    lines = [f'{"figure":<52} {"median":>10} {"least":>10} {"greatest":>10}  goal']
    for name, item in figures(result):
        goal = ''
        if name in GOALS:
            sign, bound = GOALS[name]
            goal = f'{"at least" if sign == "+" else "at most"} {bound:g}, ' + (
                'reached' if reached(name, item['median']) else 'not reached')
        lines.append(f'{name:<52} {item["median"]:10.4g} {item["min"]:10.4g} '
                     f'{item["max"]:10.4g}  {goal}'.rstrip())
    for group in _MODULES:
        for what, why in result.get(group, {}).get('left_out', {}).items():
            lines.append(f'{group}: {what} left out, {why}')
    return '\n'.join(lines)


def reached(name: str, value: float) -> bool:
    """Return whether a headline figure reaches its goal."""
    sign, bound = GOALS[name]
    return value >= bound if sign == '+' else value <= bound


def figures(result: Mapping[str, Any], prefix: str = '') -> Iterable[tuple[str, Any]]:
    """Yield dotted name and figure of every figure in a result."""
    for name, item in result.items():
        if not isinstance(item, Mapping):
            continue
        if 'median' in item:
            yield f'{prefix}{name}', item
        else:
            yield from figures(item, f'{prefix}{name}.')
