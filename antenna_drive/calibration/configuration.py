# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A fitted parameter set as a configuration file."""

from collections.abc import Sequence
from typing import Any

from antenna_drive.calibration.problem import CalibrationProblem
from antenna_drive.parameters.loading import find
from antenna_drive.yaml_text import dump_yaml
from simgap.inputs.plain_yaml import read_yaml

# Significant digits: more than any figure determines.
_DIGITS = 7


def configuration(problem: CalibrationProblem, shares: Sequence[float], start: str) -> str:
    """
    Return a candidate as a configuration file that overrides the start of the fit.

    problem : the fit
    shares : the candidate, as shares of the bounds
    start : configuration that the fit started from; its other parameters are kept
    """
    content: dict[str, Any] = {}
    if find(start) != find('reference'):
        content = dict(read_yaml(find(start)) or {})
    units = {item.key: item.unit for item in problem.free}
    for key, value in problem.parameters(shares).items():
        section, _, entry = key.partition('.')
        numbers = [_rounded(item) for item in value] if isinstance(value, tuple) else (
            _rounded(value))
        body = dict(content.get(section) or {})
        body[entry] = {'value': numbers, 'unit': units[key], 'source': 'fitted'}
        content[section] = body
    return dump_yaml(content, default_flow_style=None, width=10_000)


def _rounded(value: float) -> float:
    return float(f'{value:.{_DIGITS}g}')
