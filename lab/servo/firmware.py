# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The firmware of a kind of servo, as a YAML file: ours, or one beside the logs."""

from dataclasses import dataclass
import math
from pathlib import Path
import re

from simgap.errors import UserError
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import Entry, mapping_of, ParameterError

_SHIPPED = Path(__file__).parent
# The file's entries. A gain or a count of 0 would divide by zero.
ENTRIES = {
    'counts_per_revolution': Entry('1', 1.0, description='of the encoder'),
    'duty_counts': Entry('1', 1.0, description='the load register at full duty'),
    'gain_divisor': Entry('1', 1e-9, description='duty counts = position gain * counts of error '
                          '/ divisor'),
    'rate_step_rpm': Entry('rpm', 1e-9, description='of the speed register'),
    'rate_window_s': Entry('s', 1e-9, description='time over which the speed register averages'),
}


@dataclass(frozen=True)
class Firmware:
    """The drive law and the registers of a kind of servo."""

    error_gain: float       # duty per position error and unit of the position gain [1/rad]
    duty_count: float       # the load register at full duty
    position_step: float    # of the encoder [rad]
    rate_step: float        # of the speed register [rad/s]
    rate_window_s: float    # time over which the speed register averages


def firmware_of(motor: str, beside: Path | None = None) -> Firmware:
    """
    Return the firmware of a kind of servo, from MOTOR.yaml in the folder `beside` or in ours.

    Raise UserError where there is no such file, or an entry of it is wrong or missing.
    """
    shipped = sorted(path.stem for path in _SHIPPED.glob('*.yaml'))
    # the name comes from a log: it must not lead out of the folders
    if re.fullmatch(r'[\w-]+', motor):
        for folder in (beside, _SHIPPED):
            if folder is not None and (folder / f'{motor}.yaml').is_file():
                return _read(folder / f'{motor}.yaml')
    raise UserError(f'motor: {motor!r} given, the drive law is known of {", ".join(shipped)}; put '
                    f'{motor}.yaml with {", ".join(ENTRIES)} beside the logs')


def _read(path: Path) -> Firmware:
    try:
        top = mapping_of('', read_yaml(path), ENTRIES)
        for name in ENTRIES:
            if name not in top:
                raise ParameterError(f'{name}: missing, give {ENTRIES[name].allowed()}')
        values = {name: float(entry.check(name, top[name]))  # type: ignore[arg-type]
                  for name, entry in ENTRIES.items()}
    except ParameterError as error:
        text = str(error)
        raise UserError(text if text.startswith(str(path)) else f'{path}: {text}') from None
    counts = values['counts_per_revolution'] / (2.0 * math.pi)
    duty = values['duty_counts']
    return Firmware(counts / (values['gain_divisor'] * duty), duty, 1.0 / counts,
                    values['rate_step_rpm'] * 2.0 * math.pi / 60.0, values['rate_window_s'])
