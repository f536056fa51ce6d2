# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Start a drive in its five processes and record it: every signal at every macro-step.

The drive waits for the recorder, so nothing is lost at any pace. The bag holds the configuration
in force too. Without --config it is the reference set at rest; give the test signal a waveform:

  antenna-drive record --duration 20 --out run --config old_circuit
      --set test_signal.waveform=saw_tooth test_signal.amplitude=0.01196 test_signal.period=5

--play plays a test sheet, such as `antenna-drive propose` writes: its waveform, bias, circuit and
elevation are set on the nodes, and the bag carries it.

The drive runs in a namespace of its own, so that it meets no other one. To watch it with other
tools, give it the plain names, or any others: --namespace / or --namespace /east.

To record a drive that runs already: ros2 run antenna_drive recorder --ros-args -p out:=run
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
import time
from typing import Any

from antenna_drive.cli.options import add_config_option, add_settings_option, parse_settings
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.recording.recorder import RunRecorder
from antenna_drive.recording.sheet import load_sheet, TestSheet
from simgap.command.output import check_options, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry

_NAME = 'recorder'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--duration', type=float, required=True, metavar='S',
                        help='simulated time to record [s]')
    parser.add_argument('--out', type=Path, required=True, metavar='BAG',
                        help='the folder to write; it must not be there yet')
    add_config_option(parser)
    add_settings_option(parser)
    given = parser.add_mutually_exclusive_group()
    given.add_argument('--sheet', type=Path, metavar='FILE', help='a test sheet for the bag')
    given.add_argument('--play', type=Path, metavar='FILE',
                       help='a test sheet that the drive plays, and for the bag')
    parser.add_argument('--step', type=float, default=0.001, metavar='S',
                        help='macro-step [s]; 0.001 if not given')
    parser.add_argument('--pace', type=float, default=0.0, metavar='K',
                        help='times real time; 0, as fast as possible, if not given')
    parser.add_argument('--namespace', metavar='NS',
                        help='ROS namespace of the drive, such as /east; / for none; one of its '
                             'own if not given')
    parser.add_argument('--quiet', action='store_true', help='show no progress')


def run(args: argparse.Namespace) -> int:
    check_options(args, duration=Entry('s', 1e-5, 1e9), step=Entry('s', 1e-5, 0.1))
    parameters = parse_settings(args.settings)
    sheet = load_sheet(args.play or args.sheet) if args.play or args.sheet else None
    if args.play:
        for unit, values in _played(args.play, sheet, args.config).items():
            parameters[unit] = {**values, **parameters.get(unit, {})}
    steps = record_drive(parameters, args.config, args.out, sheet, args.duration, args.step,
                         args.pace, args.quiet, args.namespace)
    print(f'{steps} steps, {round(args.duration / args.step) * args.step:g} s: {args.out}')
    return 0


def _played(path: Path, sheet: TestSheet | None,
            config: Sequence[str]) -> Mapping[str, Mapping[str, Any]]:
    """Return what a sheet sets on each node."""
    from antenna_drive.diagnosis.sheet_settings import parameters_of
    from antenna_drive.parameters.loading import load
    assert sheet is not None
    try:
        return parameters_of(sheet, load(*config))
    except UserError as error:
        raise UserError(f'{path}: {error}') from None


def record_drive(parameters: Mapping[str, Mapping[str, Any]], config: Sequence[str], out: Path,
                 sheet: TestSheet | None, duration: float, step_s: float = 0.001,
                 pace: float = 0.0, quiet: bool = False, namespace: str | None = None) -> int:
    """
    Start a drive in its five processes and record it.

    parameters, config : of its nodes, as `DriveProcesses` takes them
    out : the folder to write, which must not be there yet
    sheet : for the bag
    duration, step_s : simulated time and macro-step [s]
    pace, quiet : times real time, 0 for as fast as possible; and whether to show no progress
    namespace : None for one of the drive's own, see drive_namespace

    Returns the number of steps that were recorded, which are all of them.

    Raises AnotherDrive: the namespace is not free, or nodes of others have taken part.
    Raises UserError: a node has ended by itself, the bag cannot be written or lacks steps, or the
    drive had not the parameters that were asked for.
    """
    recorder = RunRecorder(
        out, {f'{unit}/{s.name}': s.unit for unit, own in OUTPUTS.items() for s in own},
        sheet, recorded_by=_NAME)
    from antenna_drive.recording.own_drive import check_rows, check_settings
    last = round(duration / step_s)
    parameters = {**parameters, TEST_SIGNAL: {**parameters.get(TEST_SIGNAL, {}), **{
        'run.step': step_s, 'run.pace': pace, 'run.duration': last * step_s,
        'run.observers': [_NAME]}}}
    try:
        _run(recorder, parameters, config, last, quiet, namespace)
    finally:
        recorder.close()
    check_rows(out, last + 1)
    check_settings(out, recorder.settings, parameters, config)
    return last + 1


def _run(recorder: RunRecorder, parameters: Mapping[str, Mapping[str, Any]],
         config: Sequence[str], last: int, quiet: bool, namespace: str | None) -> None:
    """Let a drive of our own make its steps, and give them to the recorder."""
    from antenna_drive.lockstep.namespaces import drive_namespace
    from antenna_drive.lockstep.observer import Observer
    from antenna_drive.lockstep.processes import DriveProcesses
    from antenna_drive.lockstep.sampling import RunWatch

    def step(number: int, time_s: float, samples: Any) -> None:
        if number <= last:
            recorder.step(number, samples[:, 0].tolist())
            watch.done = number

    def complete() -> bool:
        if not watch.complete(processes, observer):
            return False
        recorder.idle()
        # what is in force comes by another way than the steps
        return recorder.knows_configuration or time.monotonic() > watch.deadline

    with drive_namespace(namespace, 'record') as space, Observer(
            _NAME, step, on_begin=recorder.begin, on_change=recorder.told,
            namespace=space) as observer, \
            DriveProcesses(parameters, config=config, namespace=space) as processes, \
            Progress(f'recording {space}', last, quiet=quiet) as progress:
        watch = RunWatch(last, progress.update)
        observer.spin(complete)
