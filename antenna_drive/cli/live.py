# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Open a page in the browser to see and turn the drive while it runs.

It starts a drive of its own, with the saw-tooth test on the new circuit, or joins one that runs.
The page shows the block diagram of the article's Figs. 4 to 6 with live numbers, strip charts of
the last minute, every tuning parameter with its range, the run control, the article's experiments
and recordings. The drive never waits for the page. Ctrl-C ends the page and what it has started.

  antenna-drive live                             a drive of its own, at real-time pace
  antenna-drive live --experiment T1             begin with another of the article's experiments
  antenna-drive live --config my_drive.yaml --set test_signal.waveform=zero
  antenna-drive live --join                      a drive that runs already
  antenna-drive live --join --namespace /east    ... in a namespace
  antenna-drive live --host 0.0.0.0              for other machines; the address has a token

The page is served to this machine only, unless --host names an address. Whoever has the address
with its token can then turn the drive; the connection is not encrypted.
"""

import argparse
from pathlib import Path

from antenna_drive.cli.options import add_config_option, add_settings_option, parse_settings
from simgap.command.output import check_options
from simgap.errors import UserError
from simgap.inputs.schema import Entry

_PORT = 8034


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--join', action='store_true',
                        help='join a drive that runs, in place of starting one')
    parser.add_argument('--namespace', default='', metavar='NS',
                        help='ROS namespace of the drive, such as /east')
    parser.add_argument('--experiment', metavar='NAME',
                        help="one of the article's: T1, T2, T3a, T3b, T4a, T4e; its settings go "
                             'over those of --set (default: T3b, none with --config or --set)')
    add_config_option(parser)
    add_settings_option(parser)
    parser.add_argument('--pace', type=float, metavar='K',
                        help='times real time at the start; 0: as fast as possible (default: 1)')
    parser.add_argument('--out', type=Path, default=Path('recordings'), metavar='DIR',
                        help='folder for recordings (default: %(default)s)')
    parser.add_argument('--port', type=int, default=_PORT, metavar='N',
                        help='port of the page; 0: any free one (default: %(default)s)')
    parser.add_argument('--host', default='', metavar='ADDRESS',
                        help='address to listen on, for other machines; a token is then needed')
    parser.add_argument('--token', default='', metavar='TEXT',
                        help='the token with --host; a random one if not given')


def run(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C; return 0."""
    check_options(args, pace=Entry('1', 0.0, 1e3), port=Entry('1', 0, 65535, whole=True))
    if args.token and not args.host:
        raise UserError('--token: is for --host; a page for this machine only needs none')
    if args.join:
        for option, given in (('--config', args.config), ('--set', args.settings),
                              ('--experiment', args.experiment),
                              ('--pace', args.pace is not None)):
            if given:
                raise UserError(f'{option}: is for a drive that is started here; --join takes the '
                                'drive as it is, and the page can change it')
    from antenna_drive.article.experiments import experiments
    experiment = args.experiment
    if experiment is not None and experiment not in experiments():
        raise UserError(f'--experiment {experiment}: no such experiment, allowed are '
                        f'{", ".join(experiments())}')
    if experiment is None and not args.join and not args.config and not args.settings:
        experiment = 'T3b'
    from antenna_drive.live.serving import LiveOptions, serve
    return serve(LiveOptions(
        join=args.join, namespace=args.namespace, experiment=experiment,
        config=tuple(args.config), parameters=parse_settings(args.settings),
        pace=1.0 if args.pace is None else args.pace, out=args.out.resolve(), port=args.port,
        host=args.host, token=args.token))
