# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Run the article's saw-tooth test on both circuits, in this process, and compare the bias voltages.

  python examples/first_run.py
"""

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.run import simulate

PUBLISHED = {'T3a': 'old circuit, published 0 to 10.4 V',
             'T3b': 'new circuit, published 7.2 to 11.6 V'}


def main() -> None:
    """Print the range of the bias voltage, once the drive has settled."""
    for name, words in PUBLISHED.items():
        run = simulate(experiments()[name].drive(), duration=20.0)
        bias = run['torque_share/bias_voltage'][run.time >= 10.0]
        print(f'{words}: obtained {bias.min():.1f} to {bias.max():.1f} V')


if __name__ == '__main__':
    main()
