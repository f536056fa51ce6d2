# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder with a real drive: five processes, real DDS, other libraries to read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
import re
import signal
import struct
import subprocess
import sys
from threading import Thread
import time
from typing import Any

from antenna_drive.cli import main
import pytest

pytest.importorskip('rclpy', reason='there is no ROS 2 here')

from antenna_drive.emulator.run import Emulator  # noqa: E402, I100
from antenna_drive.emulator.wiring import DRIVE, UNITS  # noqa: E402
from antenna_drive.lockstep.member import MEMORY  # noqa: E402
from antenna_drive.lockstep.observer import Observer  # noqa: E402
from antenna_drive.lockstep.processes import DriveProcesses  # noqa: E402
from antenna_drive.lockstep.readings import CHANGES_QOS  # noqa: E402
from antenna_drive.parameters.loading import load  # noqa: E402
from antenna_drive.parameters.sets import changed  # noqa: E402
from antenna_drive.recording.bag_reader import read_bag  # noqa: E402
from antenna_drive.recording.csv_format import read_csv, write_csv  # noqa: E402
from antenna_drive.recording.recording import Recording  # noqa: E402
from antenna_drive.recording.replay import twin  # noqa: E402
from mcap.exceptions import EndOfFile  # noqa: E402
from mcap.reader import NonSeekingReader  # noqa: E402
import numpy as np  # noqa: E402
from rcl_interfaces.srv import SetParameters  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402
from simgap.logs.channel import RecordingWarning  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

# Times real time: what two cores keep up with while they run the tests as well.
KEPT_PACE = 0.4
# A guest gets what the nodes remember of the last 1000 steps. It loses what they forget before it
# is sent, and if need be sent again: here it has ten seconds.
PACE_FOR_A_GUEST = 0.1
SQUARE: dict[str, Any] = {'waveform': 'square', 'amplitude': 0.001, 'period': 1.0}


def steps_by_rosbags(path: Path) -> dict[str, list[int]]:
    """Return the log times of every topic, in steps of 1 ms, as the rosbags library reads them."""
    found: dict[str, list[int]] = {f'/{name}': [] for name in DRIVE.signals}
    with AnyReader([path]) as reader:
        for connection, stamp, _ in reader.messages():
            assert stamp % 1_000_000 == 0
            found[connection.topic].append(stamp // 1_000_000)
    return found


class Drive:
    """A running drive, which waits for the test and for the observers that are named."""

    def __init__(self, observers: Sequence[str] = (), **run: Any) -> None:
        self.step = -1
        self.runs: list[int] = []
        self.ended_at: list[int] = []  # the step before each run began
        self.changed_at: list[int] = []
        self._stepped_s = time.monotonic()
        self._observer = Observer('watcher', self._on_step, on_begin=self._on_begin,
                                  on_change=self._on_change)
        self.node = self._observer.node
        self.processes = DriveProcesses({'test_signal': {
            **SQUARE, 'run.observers': ['watcher', *observers],
            **{f'run.{name}': value for name, value in run.items()}}})

    def _on_begin(self, run: int, step_s: float) -> None:
        self.runs.append(run)
        self.ended_at.append(self.step)
        self.step = -1

    def _on_step(self, k: int, time_s: float, samples: Any) -> None:
        self.step = k
        self._stepped_s = time.monotonic()

    @property
    def stands_still(self) -> bool:
        """Return whether no step has come for a second."""
        return time.monotonic() - self._stepped_s > 1.0

    def _on_change(self, unit: str, record: Mapping[str, Any]) -> None:
        if 'changes' in record:
            self.changed_at.append(record['step'])

    def change(self, unit: str, name: str, value: float) -> None:
        """Change a parameter of a unit."""
        client: Any = self.node.create_client(SetParameters, f'{unit}/set_parameters')
        self.until(client.service_is_ready)
        answer = client.call_async(SetParameters.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg()]))
        self.until(answer.done)
        assert [result.reason for result in answer.result().results] == ['']

    def call(self, service: str) -> None:
        """Call a service of the run control."""
        client: Any = self.node.create_client(Trigger, f'test_signal/{service}')
        self.until(client.service_is_ready)
        answer = client.call_async(Trigger.Request())
        self.until(answer.done)
        assert answer.result().success, answer.result().message

    def until(self, reached: Callable[[], bool]) -> None:
        """Follow the drive until something is so."""
        def is_so() -> bool:
            self.processes.check()
            return reached()
        self._observer.spin(is_so)

    def __enter__(self) -> Drive:
        self.processes.__enter__()
        return self

    def __exit__(self, *failure: Any) -> None:
        self.processes.__exit__(*failure)
        self._observer.close()


class RecorderProcess:
    """The recorder's process, as ros2 run starts it, and what it has said so far."""

    def __init__(self, *arguments: str, program: tuple[str, ...] = (
            '-m', 'antenna_drive.nodes.recorder')) -> None:
        self.lines: list[str] = []
        self.process = subprocess.Popen([sys.executable, *program, *arguments],
                                        stderr=subprocess.PIPE, text=True)
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.lines.append(line)

    def said(self, words: str) -> bool:
        assert self.process.poll() is None or not self._reader.is_alive() or self.lines
        return any(words in line for line in self.lines)

    @property
    def first_step(self) -> int:
        """Return the step from which it has said that it records."""
        [step] = re.findall(r'recording from step (\d+)', ''.join(self.lines))
        return int(step)

    @property
    def gone(self) -> bool:
        return self.process.poll() is not None

    def end(self, number: signal.Signals = signal.SIGINT) -> int:
        """Send a signal; return the exit code once everything said has been read."""
        self.process.send_signal(number)
        return self.wait()

    def wait(self) -> int:
        code = self.process.wait()
        self._reader.join()
        return code

    def __enter__(self) -> RecorderProcess:
        return self

    def __exit__(self, *failure: Any) -> None:
        self.process.kill()
        self.wait()
        assert self.process.stderr is not None
        self.process.stderr.close()


def recorder(*parameters: str, **more: Any) -> RecorderProcess:
    return RecorderProcess('--ros-args', *(item for p in parameters for item in ('-p', p)), **more)


@pytest.mark.slow
def test_the_record_command_loses_nothing_and_changes_nothing(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], fresh_domain: int) -> None:
    out = tmp_path / 'run'
    assert main(['record', '--duration', '2', '--out', str(out), '--config', 'old_circuit',
                 '--set', *(f'test_signal.{k}={v}' for k, v in SQUARE.items())]) == 0
    assert capsys.readouterr().out == f'2001 steps, 2 s: {out}\n'
    for topic, steps in steps_by_rosbags(out).items():
        assert steps == list(range(2001)), topic
    recording = read_bag(out)
    # the same drive in one process, by what the recording knows of it, and by the configuration
    again = twin(recording)
    assert again.channels == recording.channels
    drive = changed(load('old_circuit'), {f'test_signal.rate.{k}': v for k, v in SQUARE.items()})
    run = Emulator(drive).run(2.0)
    for name in recording:
        assert np.array_equal(recording[name].values, run[name]), name
    assert set(recording.configuration) == set(UNITS)
    assert recording.configuration['test_signal']['waveform'] == 'square'
    assert recording.configuration['torque_share']['k_2'] == -3.502


@pytest.mark.slow
def test_a_recorder_joins_a_running_drive_and_keeps_every_step(
        tmp_path: Path, fresh_domain: int) -> None:
    (tmp_path / 'sheet.yaml').write_text('circuit: new\n')
    with Drive(pace=0.0) as drive:
        drive.until(lambda: drive.step > 1500)  # longer than the nodes remember
        drive.change('test_signal', 'run.pace', PACE_FOR_A_GUEST)
        with recorder(f'out:={tmp_path}/run', f'sheet:={tmp_path}/sheet.yaml',
                      'split:=0.4') as process:
            drive.until(lambda: process.said('recording from step'))
            drive.change('torque_share', 'bias_pot', 0.5)
            drive.until(lambda: bool(drive.changed_at))
            # two seconds more, because a guest may be behind the drive
            last = max(drive.changed_at[0], process.first_step + 1000) + 200
            drive.until(lambda: drive.step > last)
            assert process.end() == 0, process.lines
            assert process.said('steps recorded to')
    assert len(list((tmp_path / 'run').glob('*.mcap'))) > 1
    for topic, steps in steps_by_rosbags(tmp_path / 'run').items():
        assert len(steps) > 1000
        assert steps == list(range(steps[0], steps[-1] + 1)), topic
    recording = read_bag(tmp_path / 'run')
    assert recording.sheet.circuit == 'new'
    assert set(recording.configuration) == set(UNITS), process.lines
    assert [(c.unit, dict(c.values)) for c in recording.changes] == [
        ('torque_share', {'bias_pot': 0.5})]


WRONG_CHANGES = (
    '{"run": "abc", "step": 0, "settings": {}}', '{"run": null, "step": 0, "changes": {}}',
    '{"run": Infinity, "step": 0, "changes": {}}', '{"run": 1e999, "step": 0, "changes": {}}',
    '{"run": 5, "step": {}, "changes": {"a": 1}}', '[]', 'no JSON', '[' * 100_000,
    '{"run": 5, "step": 0, "changes": {"a": NaN}}',
    '{"run": 5, "step": 0, "changes": {"a": "\\ud800"}}')


@pytest.mark.slow
def test_whatever_is_said_of_changes_the_recorder_goes_on(
        tmp_path: Path, fresh_domain: int) -> None:
    with Drive(['recorder'], pace=KEPT_PACE) as drive:
        speaker = drive.node.create_publisher(String, 'motor_1/changes', CHANGES_QOS)
        for text in WRONG_CHANGES:
            speaker.publish(String(data=text))  # remembered for whoever comes later
        with recorder(f'out:={tmp_path}/run') as process:
            drive.until(lambda: process.gone or process.said('recording from step'))
            for text in WRONG_CHANGES:
                speaker.publish(String(data=text))
            drive.until(lambda: process.gone or process.said(
                f'{2 * len(WRONG_CHANGES)} messages refused'))
            assert not process.gone, process.lines
            began = drive.step
            # the drive may be that far ahead of an observer that it waits for
            drive.until(lambda: drive.step > began + 300 + MEMORY // 2)
            assert process.end() == 0, process.lines
            assert not process.said('Traceback'), process.lines
    for topic, steps in steps_by_rosbags(tmp_path / 'run').items():
        assert len(steps) > 300
        assert steps == list(range(steps[0], steps[-1] + 1)), topic
    assert set(read_bag(tmp_path / 'run').configuration) == set(UNITS)


@pytest.mark.slow
def test_a_killed_recorder_loses_a_second_at_most(tmp_path: Path, fresh_domain: int) -> None:
    # A guest: the drive would wait for the return of any other.
    with Drive(pace=PACE_FOR_A_GUEST) as drive:
        with recorder(f'out:={tmp_path}/run') as process:
            drive.until(lambda: process.said('recording from step'))
            begun = drive.step
            drive.until(lambda: drive.step > begun + 1200)
            killed = drive.step
            process.process.kill()
            process.wait()
            drive.until(lambda: drive.step > killed + 100)  # the drive goes on
    found: dict[str, list[int]] = {f'/{name}': [] for name in DRIVE.signals}
    with (tmp_path / 'run' / 'run_0.mcap').open('rb') as file, pytest.raises(EndOfFile):
        for _, topic, message in NonSeekingReader(file).iter_messages(log_time_order=False):
            assert len(struct.unpack('<4sd', message.data)) == 2
            found[topic.topic].append(message.sequence)
    for steps in found.values():
        assert steps == list(range(steps[0], steps[-1] + 1))
        assert steps[-1] >= killed - 1000
    with pytest.warns(RecordingWarning, match='read up to'):
        assert set(read_bag(tmp_path / 'run', partial=True).configuration) == set(UNITS)


@pytest.mark.slow
def test_a_new_run_gets_a_new_bag(tmp_path: Path, fresh_domain: int) -> None:
    with Drive(['recorder'], pace=1.0) as drive, recorder(f'out:={tmp_path}/run') as process:
        drive.until(lambda: process.said('recording from step'))
        # the last frame of a node that is killed while it sends may not reach the recorder
        drive.call('pause')
        drive.processes.kill('motor_1')
        drive.processes.start('motor_1')
        drive.call('resume')
        drive.until(lambda: process.said('run_run_2') and drive.step > 300)
        assert process.end(signal.SIGTERM) == 0, process.lines
    assert len(drive.runs) == 2
    for name in ('run', 'run_run_2'):
        for steps in steps_by_rosbags(tmp_path / name).values():
            assert steps == list(range(steps[0], steps[-1] + 1))
    assert read_bag(tmp_path / 'run_run_2').start_ns == 0


@pytest.mark.slow
def test_what_a_node_has_sent_before_it_ends_reaches_a_busy_recorder(
        tmp_path: Path, fresh_domain: int) -> None:
    out = tmp_path / 'run'
    with Drive(['recorder'], pace=KEPT_PACE) as drive, recorder(f'out:={out}') as process:
        drive.until(lambda: drive.step > 500)
        process.process.send_signal(signal.SIGSTOP)
        stopped_at = drive.step
        # the drive goes on for 500 steps without an observer, which may be behind already
        drive.until(lambda: drive.step > stopped_at + 200 or drive.stands_still)
        leaving = drive.processes.process('motor_1')
        leaving.send_signal(signal.SIGTERM)
        time.sleep(0.3)
        process.process.send_signal(signal.SIGCONT)
        assert leaving.wait(10.0) == 0
        drive.processes.start('motor_1')
        drive.until(lambda: len(drive.runs) == 2 and drive.step > 100)
        assert process.end() == 0, process.lines
    for topic, steps in steps_by_rosbags(out).items():
        assert steps == list(range(len(steps))) and len(steps) > drive.ended_at[1], topic


def test_an_existing_target_is_refused_at_once(tmp_path: Path, fresh_domain: int) -> None:
    (tmp_path / 'run').mkdir()
    with recorder(f'out:={tmp_path}/run') as process:
        assert process.wait() == 2
        assert process.lines == [f'recorder: {tmp_path}/run: exists already; remove it or choose '
                                 'another name\n']
    assert list((tmp_path / 'run').iterdir()) == []


# Of 0.4 MB in a second of the drive: room for what is made safe once or twice a second to be so.
FULL_DISK = """
import resource, signal, sys
from antenna_drive.nodes.recorder import main
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.slow
def test_a_full_disk_is_told_and_stops_nothing_else(tmp_path: Path, fresh_domain: int) -> None:
    # even a drive that waits for the recorder at every step goes on
    with Drive(['recorder'], pace=0.0) as drive, recorder(
            f'out:={tmp_path}/run', program=('-c', FULL_DISK)) as process:
        drive.until(lambda: process.said('cannot be written'))
        told = drive.step
        drive.until(lambda: drive.step > told + 500)
        assert process.end() == 1
        assert process.said('File too large; recorded up to')
    with pytest.warns(RecordingWarning, match='read up to'):
        assert len(read_bag(tmp_path / 'run', partial=True)['plant/encoder']) > 100


@pytest.mark.slow
def test_a_good_run_does_not_make_up_for_a_bad_one(tmp_path: Path, fresh_domain: int) -> None:
    with Drive(['recorder'], pace=0.0) as drive, recorder(
            f'out:={tmp_path}/run', program=('-c', FULL_DISK)) as process:
        drive.until(lambda: process.said('cannot be written'))
        drive.processes.kill('motor_1')
        drive.processes.start('motor_1')
        drive.until(lambda: process.said('run_run_2'))
        assert process.end() == 1
    assert read_bag(tmp_path / 'run_run_2').start_ns == 0


# A killed node may not have sent every frame to everybody: here what motor_1 sends after step 600
# of its first run does not get through.
CUT_OFF = """
import sys
from antenna_drive.lockstep.ros_link import FrameLink
from antenna_drive.nodes.recorder import main
take, runs = FrameLink.take, []
def take_some(link, peer):
    while (frame := take(link, peer)) is not None and peer == 'motor_1' and frame[0]:
        runs[:] = runs or [frame[0]]
        if frame[0] != runs[0] or frame[1] <= 600.0:
            break
    return frame
FrameLink.take = take_some
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.slow
def test_a_drive_that_waits_for_frames_which_a_killed_node_has_not_sent_begins_again(
        tmp_path: Path, fresh_domain: int) -> None:
    with Drive(['recorder'], pace=0.0) as drive, recorder(
            f'out:={tmp_path}/run', program=('-c', CUT_OFF)) as process:
        drive.until(lambda: drive.step > 1000 and drive.stands_still)
        drive.processes.kill('motor_1')
        drive.processes.start('motor_1')
        drive.until(lambda: process.said('run_run_2'))
        assert process.end() == 1
        assert process.said('or a node was killed before it had sent them')
    assert len(read_bag(tmp_path / 'run')['plant/encoder']) == 601
    assert read_bag(tmp_path / 'run_run_2').start_ns == 0


@pytest.mark.slow
def test_a_recorded_command_is_played_by_a_node_as_in_one_process(
        tmp_path: Path, fresh_domain: int) -> None:
    time = np.arange(0.0, 1.0, 0.013)
    field = tmp_path / 'field.csv'
    command = np.where(time < 0.5, 1e-3 * np.sin(9.0 * time), -1e-3)
    write_csv(Recording.from_arrays(time, {'test_signal/rate_command': command}), field)
    again = twin(read_csv(field))
    samples: dict[int, Any] = {}
    with Observer('watcher', lambda k, t, s: samples.__setitem__(k, s[:, 0].copy())) as observer:
        with DriveProcesses(
                {'test_signal': {'run.pace': 0.0, 'run.observers': ['watcher']}},
                commands={'test_signal': [sys.executable, '-m',
                                          'antenna_drive.nodes.command_player', str(field)]}):
            observer.spin(lambda: len(samples) > 1000)
    last = len(again['plant/encoder'])
    assert last == 989
    for row, name in enumerate(observer.names):
        # the twin's last step is a step of the played command too, whatever comes after it
        assert [samples[k][row] for k in range(last)] == again[name].values.tolist(), name
    assert samples[1000][0] == samples[last][0] == -1e-3


def test_a_player_without_a_recording_says_so() -> None:
    for arguments, words in (([], 'which recording?'), (['none.csv'], 'none.csv: no such file')):
        with RecorderProcess(*arguments, program=(
                '-m', 'antenna_drive.nodes.command_player')) as process:
            assert process.wait() == 2
            assert len(process.lines) == 1
            assert words in process.lines[0]


@pytest.mark.slow
def test_wrong_arguments_are_refused_in_one_line(tmp_path: Path,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, words in ((['--out', 'x'], 'ROS 2 arguments follow --ros-args'),
                             (['--ros-args', '-p', f'sheet:={tmp_path}/no.yaml'], 'No such file'),
                             (['--ros-args', '-p', 'split:=-1.0'], 'split: -1.0 given')):
        with RecorderProcess(*arguments) as process:
            assert process.wait() == 2
            assert len(process.lines) == 1
            assert words in process.lines[0]
    for arguments, words in (
            (['--set', 'motor_3.x=1'], 'motor_3: no such unit, did you mean motor_2'),
            (['--sheet', 'none.yaml'], 'none.yaml: No such file'),
            (['--set', 'motor_1.gear=1'], 'motor_1 has ended with status 2')):
        assert main(['record', '--duration', '1', '--out', str(tmp_path / 'run'),
                     *arguments]) == 2
        assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
