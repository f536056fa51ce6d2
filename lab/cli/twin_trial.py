# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Make a trial of the twin: sealed antennas of an independent program, played to it.

  --kind onset     an effect of middle or large size is switched on in the middle of each test
  --kind healthy   nothing happens in an hour (--duration); each alarm is a false one
  --kind verdict   the three recordings of an ordinary sealed case, diagnosed as they grow

The antennas have the tolerances and, but for --kind verdict, the imperfections of wild cases
(docs/trial.md). The twin is played in simulated time, as fast as the computer goes. With --topics
its node hears the antenna on topics at real time, six minutes a case. No more cases run at once
than there are cores, because a twin without a processor tells late. Truths are sealed in DIR
before anything is simulated, as by `lab trial`; DIR/results.jsonl is what the twin said.
The same command resumes an interrupted trial. To continue on another machine, put that file into a
new DIR.

For example:
  lab twin-trial --kind onset --cases 20 --seed 7 --out onsets
  lab twin-trial --kind onset --cases 20 --seed 7 --out real_time --topics --jobs 2
  lab twin-trial --kind healthy --cases 4 --seed 8 --out hours
  lab twin-trial --kind verdict --cases 30 --seed 9 --out growing --jobs 2
"""

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
import os
from statistics import median
from typing import Any

from antenna_drive.cli.options import add_worker_options
from antenna_drive.emulator.unit import FloatArray
from lab.antenna import cases
from lab.cli.trial import add_sealed_options
from lab.trials import onset, sealing
from lab.trials.driver import Arm, complete
from lab.trials.results import TrialResults
from lab.trials.scorecard import Case, score
from lab.trials.verdict import content_of, parse_verdict
from simgap.command.output import check_options, Progress
from simgap.errors import UserError
from simgap.inputs.schema import Entry

TOLERANCE = 0.02
WITHIN_S = 10.0
# An effect that changes the readings by less within that time does not show in the test: half a
# chi-square, the price of an effect in a diagnosis.
HIDDEN = 30.0
# Seconds of testing at which a growing verdict is looked at; three recordings of 30 s each. It
# cannot be decided before the second one.
LOOKS_S = (30.0, 45.0, 60.0, 75.0, 90.0)
RECORDED_S = 30.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `lab twin-trial`."""
    parser.add_argument('--kind', choices=('onset', 'healthy', 'verdict'), required=True,
                        help='what happens in the tests')
    add_sealed_options(parser)
    parser.add_argument('--duration', type=float, default=3600.0, metavar='S',
                        help='length of a healthy test [s] (default: %(default)g)')
    parser.add_argument('--alarms-per-day', type=float, default=1.0, metavar='N',
                        help='false alarms that the twin may give a day (default: %(default)g)')
    parser.add_argument('--topics', action='store_true',
                        help='play to the node of the twin on topics, at real time; not for '
                             '--kind verdict')
    add_worker_options(parser, 1)
    parser.add_argument('--quiet', action='store_true', help='show no progress')


def run(arguments: argparse.Namespace) -> int:
    """Make the cases that are not there yet, and print what the twin said of all."""
    check_options(arguments, cases=Entry('', 1, whole=True), seed=Entry('', 0, whole=True),
                  jobs=Entry('', 1, whole=True), duration=Entry('s', 180.0, 1e5),
                  alarms_per_day=Entry('1', 1e-6, 1e4))
    if arguments.topics and arguments.kind == 'verdict':
        raise UserError('--topics: --kind verdict reads whole recordings; leave one of them out')
    cores = os.cpu_count() or 1
    if arguments.topics and arguments.jobs > cores:
        raise UserError(f'--jobs {arguments.jobs}: allowed with --topics is at most {cores}, '
                        'the number of cores')
    manifest = _prepared(arguments)
    folder, names = arguments.out, list(manifest['seals'])
    print(f'{folder}: {len(names)} truths sealed, manifest {sealing.manifest_seal(manifest)}',
          flush=True)
    results = TrialResults(folder, manifest)
    with Progress('cases', len(names), quiet=arguments.quiet) as progress:
        complete(names, partial(sealing.open_truth, folder, manifest=manifest),
                 [Arm(lambda name, row: not row, partial(outcome, settings=manifest['settings']))],
                 results, arguments.jobs, arguments.scheduler,
                 done=lambda done, total: progress.update(done))
    print('\n'.join({'onset': of_onsets, 'healthy': of_healthy, 'verdict': of_verdicts}[
        arguments.kind]([results[name] for name in results])))
    return 0


def _prepared(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the manifest of the trial, sealed now if there is none."""
    settings = {'kind': arguments.kind, 'cases': arguments.cases, 'seed': arguments.seed,
                'duration_s': arguments.duration, 'tolerance': TOLERANCE,
                'alarms_per_day': arguments.alarms_per_day,
                **({'topics': True} if arguments.topics else {})}
    folder = arguments.out
    if (folder / sealing.MANIFEST).exists():
        manifest = sealing.read_manifest(folder)
        if manifest['settings'] != settings:
            raise UserError(f'{folder}: a trial with other settings; choose another folder')
        return manifest
    if arguments.kind == 'verdict':
        truths = cases.draw_truths(arguments.cases, arguments.seed, TOLERANCE)
    else:
        truths = onset.draw_truths(
            arguments.cases, arguments.seed, TOLERANCE,
            arguments.duration if arguments.kind == 'healthy' else 0.0)
    return sealing.seal(folder, settings, truths)


def outcome(truth: dict[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the twin says of one case; a task of the workers."""
    kept = {'effects': truth['effects'], 'kind': truth['kind']}
    if settings['kind'] == 'verdict':
        return {**kept, **_grown(truth)}
    columns = onset.make_recording(truth)
    if truth['effects']:
        kept['shows_by'] = onset.shows_by(truth, columns, WITHIN_S)
    return {**kept, 'waveform': truth['sheets'][0]['waveform']['type'],
            'onset_s': truth['onset_s'], **_watched(
                columns, truth['sheets'][0], truth['onset_s'], settings)}


def _watched(columns: Mapping[str, FloatArray], sheet: Mapping[str, Any], onset_s: float,
             settings: Mapping[str, Any]) -> dict[str, Any]:
    if settings.get('topics'):
        from lab.campaign.twin_on_topics import watched_on_topics
        return watched_on_topics(columns, sheet, onset_s, settings['alarms_per_day'])
    from lab.campaign.twin_proving import watched
    from antenna_drive.twin.watch import TwinSettings
    return watched(columns, sheet, onset_s,
                   TwinSettings(alarms_per_day=settings['alarms_per_day']))


def _grown(truth: dict[str, Any]) -> dict[str, Any]:
    """Return the verdicts on a case as its recordings grow, and when the rule stopped."""
    from lab.campaign.twin_proving import grown, recording_of
    tests = [recording_of(cases.make_recording(truth, k), truth['sheets'][k]) for k in range(3)]
    stopped, looks = grown(tests, [RECORDED_S] * len(tests), LOOKS_S)
    return {'stopped_s': stopped, 'looks': [
        {'seconds': look.seconds, 'verdict': content_of(parse_verdict(result))}
        for look, result in looks]}


def of_onsets(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what a trial of onsets shows, in lines."""
    lines = []
    for item in results:
        effect, after = item['effects'][0], item['told_after_s']
        said = 'not told' if after is None else f'{after:4.1f} s, {item["gaps"][0]}'
        lines.append(f'{effect["id"]:32s} size {effect["size"]:.2f} {item["waveform"]:10s} '
                     f'shows by {item["shows_by"]:.0f}: {said}')
    times = [item['told_after_s'] for item in results if item['told_after_s'] is not None]
    soon = sum(time <= WITHIN_S for time in times)
    alarms = sum(len(item['alarms']) for item in results)
    hidden = sum(item['shows_by'] < HIDDEN for item in results)
    return [*lines, f'told within {WITHIN_S:g} s: {soon} of {len(results)}; later: '
            f'{len(times) - soon}; never: {len(results) - len(times)}; median '
            + (f'{median(times):.1f} s' if times else 'none')
            + f'; alarms before the onset: {alarms}',
            f'effects that do not show in their test (by less than {HIDDEN:g}): {hidden}']


def of_healthy(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what a trial of healthy drives shows, in lines."""
    lines = [f'{item["waveform"]:10s} {item["judged"]} s judged, {item["unjudged"]} s not, '
             f'{item["tuning"]}: '
             + ('; '.join(f'alarm at {alarm["time_s"]:.0f} s, {alarm["gaps"][0]}'
                          for alarm in item['alarms']) or 'no alarm') for item in results]
    hours = sum(item['judged'] for item in results) / 3600.0
    return [*lines, f'{sum(len(item["alarms"]) for item in results)} alarms in {hours:.2f} h']


def of_verdicts(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what a trial of growing verdicts shows, in lines."""
    def at(item: Mapping[str, Any], seconds: float) -> Case:
        look = next(look for look in item['looks'] if look['seconds'] == seconds)
        return Case(dict(item), parse_verdict(look['verdict']))

    def said(case: Case) -> str:
        assert case.verdict is not None
        first = case.verdict.which[0]
        return (f'{" + ".join(sorted(first.effects))} {first.probability:.2f}, '
                + ('right' if case.right else 'not right'))

    end = LOOKS_S[-1]
    seconds = [item['stopped_s'] or end for item in results]
    stopped = [at(item, tested) for item, tested in zip(results, seconds, strict=True)]
    whole = [at(item, end) for item in results]
    lines = [f'{case.label:40s} ' + (f'stopped at {item["stopped_s"]:g} s: '
                                     if item['stopped_s'] else 'not stopped: ')
             + f'{said(case)}; after {end:g} s: {said(last)}'
             for item, case, last in zip(results, stopped, whole, strict=True)]
    for name, group in (('stopped', stopped), (f'after {end:g} s', whole)):
        figures = score(group)
        lines.append(f'{name}: right {sum(case.right for case in group)} of {len(group)}; '
                     + '; '.join(f'{key} {figures[key]:.3f}' for key in (
                         'top1', 'no_gap_on_none', 'ece')))
    same = [case.verdict and last.verdict and case.verdict.means(
        case.verdict.which[0].effects, last.verdict.which[0].effects)
        for case, last in zip(stopped, whole, strict=True)]
    return [*lines, f'same answer as after {end:g} s: {sum(map(bool, same))} of '
            f'{len(same)}; median {median(seconds):g} s of testing']
