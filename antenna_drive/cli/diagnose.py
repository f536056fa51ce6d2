# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
r"""
Say where a real drive and the model part, which effect is behind it, and how far it goes.

Give one or more recordings of the same machine (CSV, with the test sheet NAME.yaml beside
NAME.csv, or a bag). The more different the tests, the surer the verdict: a slow square wave, a
triangle and a chirp or multisine of half a minute each are a good programme.

For example:

  antenna-drive diagnose field.csv
  antenna-drive diagnose rec_a.csv rec_b.csv rec_c.csv --config my_drive.yaml \
      --json verdict.json --report verdict.html --corrected corrected.yaml
  antenna-drive diagnose rec_a.csv rec_b.csv rec_c.csv rec_d.csv --after verdict.json
  antenna-drive diagnose --model my_machine.py:machine logs/*.csv --map map.yaml

--corrected writes a configuration with the effects and the tolerances in it, as fitted;
`antenna-drive predict` shows how well it predicts a recording that was not used here.

--after takes a verdict on some of the recordings. Its answers are fitted to all of them, each
from where its fit had ended, beside what is found afresh. Otherwise a test in which motors creep
may hide the true one.

--model diagnoses a machine of your own, as `simgap diagnose` does, see docs/own-machine.md;
`simgap check` says beforehand what is wrong with it.
"""

import argparse
from pathlib import Path

from antenna_drive import __version__
from antenna_drive.recording.files import import_file, load_map, read_recording
from simgap.cli.diagnose import (
    add_diagnosis_options, add_map_option, diagnosed, earlier_of, facts, numbers_of, settings_of,
    write_report,
)
from simgap.command.large_arrays import give_back_large_arrays
from simgap.command.output import check_options, give, Progress, reading, replaced
from simgap.errors import UserError
from simgap.inputs.schema import Entry


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('recordings', nargs='+', metavar='RECORDING',
                        help='recordings of one machine: .csv, bags (folder or .mcap), or with '
                             '--map any file that docs/recording.md lists')
    parser.add_argument('--model', metavar='FILE.py:NAME',
                        help='diagnose a machine of your own in the place of the drive; also '
                             'FILE.yaml')
    add_map_option(parser)
    parser.add_argument('--config', action='append', default=[], metavar='FILE',
                        help='configuration of the model, a file or the name of a set in '
                             'config/; may be given several times (default: reference)')
    add_diagnosis_options(parser, 'current_1=0.05')
    parser.add_argument('--corrected', type=Path, metavar='FILE',
                        help='write the configuration with what was found to FILE (.yaml)')


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, and write what was asked for; 0 whatever the verdict, 1 for too few samples."""
    check_options(arguments, jobs=Entry('', 1, whole=True))
    give_back_large_arrays()
    if arguments.model:
        for option in ('config', 'corrected'):
            if getattr(arguments, option):
                raise UserError(f'--{option}: does not go with --model')
        return diagnosed(arguments.model, arguments.recordings, arguments)
    # the compiled physics takes a while to load: not before it is needed
    from antenna_drive.diagnosis.diagnose import corrected, diagnose_recordings
    from antenna_drive.parameters.loading import load

    drive = load(*arguments.config)
    settings = settings_of(arguments.threshold)
    limits = dict(numbers_of('--matters', arguments.matters))
    earlier = earlier_of(arguments.after)
    recordings = {}
    with reading():
        import_map = load_map(arguments.map) if arguments.map else None
        for path in arguments.recordings:
            name = Path(path).stem
            while name in recordings:
                name += '_'
            recordings[name] = (import_file(path, import_map) if import_map
                                else read_recording(path))
    with Progress('diagnosis', 1.0) as progress:
        diagnosis = diagnose_recordings(
            recordings, drive, lambda share, doing: progress.update(share), arguments.jobs,
            settings, arguments.without, limits, earlier)
    correction = corrected(drive, diagnosis)
    write_report(arguments.report, diagnosis, facts(
        f'antenna-drive {__version__}', 'antenna drive',
        ' + '.join(arguments.config) or 'reference', arguments.recordings))
    lines = [diagnosis.summary()]
    if arguments.corrected:
        with replaced(arguments.corrected) as stream:
            stream.write(correction.text.encode())
        lines.append(f'{arguments.corrected}: ' + (
            f'cannot hold {", ".join(correction.unwritten)}' if correction.unwritten else
            'holds all that was found about the machine')
            + (f'; {len(correction.recorder)} errors of the recorder are in the JSON'
               if correction.recorder else ''))
    give({**diagnosis.as_data(), 'recorder': list(correction.recorder)}, arguments.json,
         '\n'.join(lines))
    return int(diagnosis.word == 'too_few_to_judge')
