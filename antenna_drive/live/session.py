# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a page may ask, and what is done about it."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from antenna_drive.article.experiments import experiments
from antenna_drive.emulator.wiring import OUTPUTS, TEST_SIGNAL
from antenna_drive.live.board import Board
from antenna_drive.live.experiment_buttons import listed, Obtained, plan, preview
from antenna_drive.live.link import DriveLink
from antenna_drive.live.own_processes import OwnDrive, RecorderProcess
from antenna_drive.recording.files import read_recording
from antenna_drive.recording.panels import PANELS
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import parse_sheet
from antenna_drive.recording.sheet_signal import settings_for, settings_of
from simgap.errors import UserError
from simgap.logs.channel import NANOSECONDS
from simgap.report.curves import kept

# How often nodes are looked after [s].
_LOOK_S = 0.5
_LONGEST_SPAN_S = 600.0
# Samples of a recording's curve that are sent to the page, and recordings that it lists.
MOST_SAMPLES = 20_000
_MOST_LISTED = 100
_RUN_SERVICES = ('pause', 'resume', 'step', 'reset')


class Session:
    """
    One drive, its recorder, and every page that is open.

    `ask` raises UserError for what is refused; the message is for the page.
    """

    def __init__(self, link: DriveLink, board: Board, recorder: RecorderProcess,
                 own: OwnDrive | None = None, experiment: str | None = None) -> None:
        """
        Serve a drive.

        link, board, recorder : the drive, what pages are told, who records
        own : the drive's processes if they are ours; None for a drive that was joined
        experiment : the experiment that was started
        """
        self.link, self.board = link, board
        self._recorder, self._own = recorder, own
        self._restarting = asyncio.Lock()
        self._obtained = Obtained()
        self._tables: set[str] = set()
        self._acts: dict[str, Callable[[Mapping[str, Any]], Awaitable[Any]]] = {
            'set': self._set, 'run': self._run, 'experiment': self._experiment,
            'preview': self._preview, 'record': self._record, 'load': self._load,
            'recordings': self._recordings, 'play': self._play, 'twin': self._twin}
        board.post('hello', {
            'signals': [{'name': f'{unit}/{signal.name}', 'unit': signal.unit,
                         'text': signal.description}
                        for unit, signals in OUTPUTS.items() for signal in signals],
            'panels': [{'title': panel.title, 'unit': panel.unit, 'factor': panel.factor,
                        'names': list(panel.names)} for panel in PANELS],
            'own': own is not None, 'namespace': link.namespace or '/',
            'experiments': listed(), 'units': list(OUTPUTS)})
        self._tell_experiment(experiment)
        self._tell_recorder()
        board.post('drive', {'trouble': '', 'ready': False})

    def _tell_experiment(self, name: str | None, before: int = 0) -> None:
        self._playing = name
        self._obtained.begin(before)
        self.board.post('experiment', {'name': name})
        self.board.post('obtained', {'name': name, 'run': 0, 'figures': {}})

    async def _look_at_experiment(self) -> None:
        name, history = self._playing, self.link.history
        figures = await asyncio.to_thread(self._obtained.look, name, history) if name else None
        if figures is not None and name == self._playing:
            self.board.post('obtained', {'name': name, 'run': history.run, 'figures': figures})

    def _tell_recorder(self) -> None:
        recorder = self._recorder
        self.board.post('recorder', {
            'running': recorder.running, 'path': str(recorder.path or ''), 'said': recorder.said,
            'folder': str(recorder.folder), 'bytes': recorder.size() if recorder.path else 0})

    async def look_after(self) -> None:
        """Ask new nodes for their parameters, and notice what has ended; never returns."""
        was_recording, run = False, 0
        while True:
            await asyncio.sleep(_LOOK_S)
            trouble = self._own.trouble() if self._own and not self._restarting.locked() else ''
            ready = self.link.ready()
            if not ready or self.link.history.run != run:
                # nodes that were started again may have other constants
                run = self.link.history.run
                self._tables.clear()
            if ready and not trouble:
                for unit in [name for name in OUTPUTS if name not in self._tables]:
                    try:
                        await self.link.load(unit)
                        self._tables.add(unit)
                    except UserError:
                        break  # it may be starting: the next look asks again
            self.board.post('drive', {
                'trouble': trouble, 'ready': ready and len(self._tables) == len(OUTPUTS),
                'lost': self.link.lost})
            self.board.post('nodes', {'nodes': self.link.nodes()})
            await self._look_at_experiment()
            if was_recording and not self._recorder.running:
                await asyncio.to_thread(self._recorder.stop)  # it has ended by itself
            if was_recording or self._recorder.running:
                self._tell_recorder()
            was_recording = self._recorder.running

    async def ask(self, message: Mapping[str, Any]) -> Any:
        """
        Do what a page asks.

        Returns plain data for the answer, None for none.

        Raises UserError: it is refused or makes no sense; the message says why.
        """
        act = self._acts.get(str(message.get('do')))
        if act is None:
            raise UserError(f'{str(message.get("do"))[:40]}: no such request')
        return await act(message)

    async def _set(self, message: Mapping[str, Any]) -> None:
        refusal = await self.link.set(_given(message, 'unit'), _given(message, 'values', dict))
        if refusal:
            raise UserError(refusal)
        if message['unit'] == TEST_SIGNAL and not all(
                name.startswith('run.') for name in message['values']):
            self._tell_experiment(None)  # what was published is of another test signal

    async def _run(self, message: Mapping[str, Any]) -> str:
        service = _given(message, 'service')
        if service not in _RUN_SERVICES:
            raise UserError(f'{service}: no such service')
        if service == 'step' and 'steps' in message:
            await self._set({'unit': TEST_SIGNAL, 'values': {'run.steps': message['steps']}})
        done, said = await self.link.trigger(service)
        if not done:
            raise UserError(said)
        return said

    async def _experiment(self, message: Mapping[str, Any]) -> str:
        name = _given(message, 'name')
        if name not in experiments():
            raise UserError(f'{name}: no such experiment')
        own, before = self._own, self.link.history.run
        found = plan(name, self.link.settings, own.config if own else ())
        if found.constants and own is None:
            unit, keys = next(iter(found.constants.items()))
            raise UserError(
                f'{name} needs other constants in {unit} ({", ".join(keys)}), which are fixed '
                f'while it runs: start the drive with config {experiments()[name].circuit}')
        async with self._restarting:
            if found.constants and own is not None:
                self._tables.clear()
                await asyncio.to_thread(own.stop)
                self.link.reports.clear()
                own.start(name)
                said = 'the drive is started again with the constants of this experiment'
            else:
                for unit, values in found.live.items():
                    await self._set({'unit': unit, 'values': values})
                await self._run({'service': 'reset'})
                said = 'a new run has begun'
        self._tell_experiment(name, before)
        return said

    async def _preview(self, message: Mapping[str, Any]) -> Any:
        span = message.get('span')
        if not isinstance(span, (int, float)) or not 0.0 < span <= _LONGEST_SPAN_S:
            raise UserError('span: allowed is a time up to 600 s')
        return preview(_given(message, 'values', dict), float(span))

    async def _play(self, message: Mapping[str, Any]) -> str:
        if 'twin' in message:
            sheet = parse_sheet(self.link.twins.next_test(_given(message, 'twin')))
            settings = settings_for(sheet.waveform) if sheet.waveform else {}
        else:
            path = Path(_given(message, 'path')).expanduser()
            settings = await asyncio.to_thread(settings_of, path)
        await self._set({'unit': TEST_SIGNAL, 'values': settings})
        self._tell_experiment(None)
        return await self._run({'service': 'reset'})

    async def _twin(self, message: Mapping[str, Any]) -> str:
        name, act = _given(message, 'name'), _given(message, 'act')
        if act == 'begin_test':
            self.link.twins.begin_test(name)
            return 'another test begins; the drive has to stand still now'
        if act == 'propose':
            return await self.link.twins.propose(name)
        raise UserError(f'{act[:40]}: no such act')

    async def _record(self, message: Mapping[str, Any]) -> str:
        if message.get('on'):
            path = self._recorder.start(str(message.get('name') or ''))
            self._tell_recorder()
            return str(path)
        await asyncio.to_thread(self._recorder.stop)
        self._tell_recorder()
        return self._recorder.said

    async def _recordings(self, message: Mapping[str, Any]) -> list[str]:
        return await asyncio.to_thread(recordings_in, self._recorder.folder)

    async def _load(self, message: Mapping[str, Any]) -> Any:
        path = Path(_given(message, 'path')).expanduser()
        return await asyncio.to_thread(lambda: thinned(read_recording(path, partial=True), path))

    async def close(self) -> None:
        """End what was started."""
        await asyncio.to_thread(self._recorder.stop)
        if self._own is not None:
            await asyncio.to_thread(self._own.stop)
        await asyncio.to_thread(self.link.close)


def _given(message: Mapping[str, Any], key: str, kind: type = str) -> Any:
    value = message.get(key)
    if not isinstance(value, kind) or not value:
        raise UserError(f'{key}: is missing')
    return value


def thinned(recording: Recording, path: Path) -> dict[str, Any]:
    """Return the signals that the charts show; times in seconds from the recording's start."""
    names = [name for panel in PANELS for name in panel.names if name in recording]
    curves = {}
    for name in names:
        channel = recording[name]
        if len(channel):
            chosen, _ = kept(channel.values, MOST_SAMPLES)
            time = (channel.time_ns[chosen] - recording.start_ns) / NANOSECONDS
            curves[name] = {'t': [round(float(t), 6) for t in time],
                            'y': [float(f'{y:.7g}') for y in channel.values[chosen]]}
    return {'name': path.name, 'path': str(path), 'duration': recording.duration_s,
            'curves': curves}


def recordings_in(folder: Path) -> list[str]:
    """Return the bags and CSV files of a folder, the newest first."""
    if not folder.is_dir():
        return []
    found = [item for item in folder.iterdir()
             if item.suffix in ('.csv', '.mcap') or (item / 'metadata.yaml').exists()]
    return [str(item) for item in sorted(
        found, key=lambda item: item.stat().st_mtime, reverse=True)[:_MOST_LISTED]]
