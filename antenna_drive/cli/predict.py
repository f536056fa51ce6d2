# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
Predict a recording from its rate command and test sheet, and say how far off the prediction is.

The readings of the recording are compared with the prediction and not used for it. Give a
recording that the diagnosis has not seen: that is the proof of a corrected configuration.
--recorder takes the errors of the recorder from the JSON of a diagnosis. With --against, a second
configuration is compared: usually the one before the correction.

For example:

  antenna-drive diagnose rec_a.csv rec_b.csv rec_c.csv \
      --corrected corrected.yaml --json verdict.json
  antenna-drive predict rec_d.csv --config corrected.yaml --recorder verdict.json \
      --against reference --out predicted.csv

Prints, for each signal, the rms of measured minus predicted in its own unit. With --against, the
answer is no (exit code 1) if --config is farther off than --against: if the ratio of the two rms,
averaged over the signals as a geometric mean, is above 1.
"""

import argparse
import json
import math
from pathlib import Path
from typing import Any, TYPE_CHECKING

from antenna_drive.recording.atomic import refuse_existing
from antenna_drive.recording.files import read_recording
from simgap.command.output import add_json_option, give, reading
from simgap.errors import UserError
from simgap.verdict.spoken import number

if TYPE_CHECKING:
    from antenna_drive.diagnosis.modifiers import SensorReadings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('recording', metavar='RECORDING',
                        help='a .csv with its test sheet beside it, or a bag (folder or .mcap)')
    parser.add_argument('--config', action='append', required=True, metavar='FILE',
                        help='configuration to predict with, a file or the name of a set in '
                             'config/; may be given several times, later over earlier')
    parser.add_argument('--recorder', type=Path, metavar='VERDICT',
                        help='JSON of a diagnosis; the errors of the recorder are taken from it')
    parser.add_argument('--against', action='append', default=[], metavar='FILE',
                        help='configuration to compare with, without errors of the recorder')
    parser.add_argument('--out', type=Path, metavar='CSV',
                        help='write the prediction, at the times of the recording; '
                             'it must not be there yet')
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Predict, write what was asked for; 1 if the prediction is worse than --against."""
    # the compiled physics takes a while to load: not before it is needed
    from antenna_drive.diagnosis.prediction import predict
    from antenna_drive.parameters.loading import load
    from antenna_drive.recording.csv_format import write_csv

    if arguments.out is not None:
        if arguments.out.suffix != '.csv':
            raise UserError(f'--out {arguments.out}: allowed is a name that ends with .csv')
        refuse_existing(arguments.out)
    recorder = _recorder(arguments.recorder) if arguments.recorder else None
    drive = load(*arguments.config)
    other = load(*arguments.against) if arguments.against else None
    with reading():
        recording = read_recording(arguments.recording)
    name = Path(arguments.recording).stem
    notes: list[str] = []
    prediction = predict(name, recording, drive, recorder, notes.append)
    signals: dict[str, dict[str, Any]] = {
        channel: {'rms': rms, 'unit': unit} for channel, (rms, unit) in prediction.rms().items()}
    if other is not None:
        for channel, (rms, _) in predict(name, recording, other).rms().items():
            signals[channel]['against'] = rms
    if arguments.out is not None:
        write_csv(prediction.as_recording(recording), arguments.out, field=True)
    better = other is None or _mean_ratio(signals) <= 1.0
    lines = []
    for channel, item in signals.items():
        line = f'{channel:<14} {item["rms"]:.4g} {item["unit"]}'
        if 'against' in item:
            line += (f'   {item["against"]:.4g} {item["unit"]} with --against, '
                     f'{_change(item["rms"], item["against"])}')
        lines.append(line)
    lines += [f'note: {note}' for note in notes]
    give({'recording': name, 'signals': signals, 'notes': notes,
          **({} if other is None else {'ratio': _mean_ratio(signals)})},
         arguments.json, '\n'.join(lines))
    return 0 if better else 1


def _mean_ratio(signals: dict[str, dict[str, Any]]) -> float:
    """Return the geometric mean of rms over rms with --against."""
    tiny = 1e-300
    return math.exp(sum(math.log(max(item['rms'], tiny) / max(item['against'], tiny))
                        for item in signals.values()) / len(signals))


def _change(now: float, before: float) -> str:
    """Return how a size differs from another, as people say it."""
    if now <= before:
        return f'{100.0 * (1.0 - now / before) if before else 0.0:.0f} % less'
    change = now / before - 1.0 if before else math.inf
    if not math.isfinite(change):
        return 'where there was nothing'
    return f'{number(change)} times more' if change >= 1.0 else f'{100.0 * change:.0f} % more'


def _recorder(path: Path) -> 'SensorReadings':
    from antenna_drive.diagnosis.prediction import recorder_errors
    try:
        content = json.loads(path.read_text(encoding='utf-8'))
    except (ValueError, RecursionError) as error:
        raise UserError(f'{path}: not JSON: {error}') from error
    entries = content.get('recorder') if isinstance(content, dict) else None
    if not isinstance(entries, list):
        raise UserError(f'{path}: recorder: is missing; give the JSON of antenna-drive diagnose')
    try:
        return recorder_errors(entries)
    except UserError as error:
        raise UserError(f'{path}: {error}') from None
