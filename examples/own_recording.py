# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make a recording in the format of a field test, read it back, and look at it.

  python examples/own_recording.py FOLDER

To diagnose a drive of your own, bring its recordings into this format (docs/recording.md), then:

  antenna-drive diagnose FOLDER/square.csv
"""

from pathlib import Path
import sys

from antenna_drive.emulator.run import simulate
from antenna_drive.parameters import load
from antenna_drive.parameters.sets import changed
from antenna_drive.readings import FIELD_COLUMNS
from antenna_drive.recording.csv_format import write_csv
from antenna_drive.recording.files import read_recording
from antenna_drive.recording.recording import Recording
import numpy as np

# Square wave of 0.05 deg/s. In motor 1 a tachometer reads 5 percent too much.
SIGNAL = {'test_signal.rate.waveform': 'square', 'test_signal.rate.amplitude': 8.7e-4,
          'test_signal.rate.period': 6.3}
TOO_MUCH = 1.05
# Standard deviations of the sensors' noise, in the units of the signals.
NOISE = {'motor_1/ammeter': 0.01, 'motor_2/ammeter': 0.01, 'motor_1/tach_rate': 0.0035,
         'motor_2/tach_rate': 0.0035, 'plant/encoder': 1e-6, 'torque_share/bias_voltage': 0.01}


def main(folder: Path) -> None:
    """Write square.csv, read it, and print what is in it."""
    run = simulate(changed(load(), SIGNAL), duration=15.0, every=5)
    random = np.random.default_rng(1)
    signals = {name: run[name] + NOISE.get(name, 0.0) * random.normal(size=run.time.size)
               for name in FIELD_COLUMNS.values()}
    signals['motor_1/tach_rate'] *= TOO_MUCH
    path = folder / 'square.csv'
    write_csv(Recording.from_arrays(run.time, signals), path, field=True)

    recording = read_recording(path)
    print(recording)
    for name in recording.names:
        channel = recording[name]
        print(f'{name:28} {channel.values.min():10.4g} to {channel.values.max():10.4g} '
              f'{channel.unit}')


if __name__ == '__main__':
    main(Path(sys.argv[1]))
