# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The drive through the ros2 command line, as people use it, after either installation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
import os
from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys
import time

from installations import Installation
from lab.campaign.domains import claimed_domain
import pytest

pytestmark = pytest.mark.slow
PATH = os.pathsep.join((str(Path(sys.executable).parent), os.environ['PATH']))
ROS2 = shutil.which('ros2', path=PATH)
LIMIT_S = 120.0  # long enough for a busy machine; nothing waits for it but a failure
STOP_S = 15.0
# node name: executable
DRIVE = {'test_signal': 'test_signal', 'motor_1': 'motor_drive', 'motor_2': 'motor_drive',
         'torque_share': 'torque_share', 'plant': 'rate_loop_plant'}
# for the verbs that can wait for a node
PATIENT = ('--no-daemon', '--timeout', '60')
# A tenth of real time leaves the machine to the commands.
CALM = {'test_signal': ('-p', 'run.pace:=0.1')}
TOPICS = {
    '/clock': 'rosgraph_msgs/msg/Clock',
    '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray',
    '/test_signal/rate_command': 'std_msgs/msg/Float64',
    '/motor_1/current': 'std_msgs/msg/Float64',
    '/motor_2/current': 'std_msgs/msg/Float64',
    '/motor_1/tach_rate': 'std_msgs/msg/Float64',
    '/torque_share/bias_voltage': 'std_msgs/msg/Float64',
    '/plant/axis_rate': 'std_msgs/msg/Float64',
    '/plant/encoder': 'std_msgs/msg/Float64',
    **{f'/{node}/frame': 'std_msgs/msg/Float64MultiArray' for node in DRIVE},
}


class Shell:
    """A shell in which the package is installed and `ros2` is at hand."""

    def __init__(self, installation: Installation, domain: int) -> None:
        """Take the installation's environment, in a ROS 2 domain of its own."""
        assert ROS2 is not None
        self._ros2 = ROS2
        self._environment = {**installation.environment, 'PATH': PATH, 'PYTHONUNBUFFERED': '1',
                             'ROS_DOMAIN_ID': str(domain)}

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        """Start a `ros2` command as the head of a process group, as a terminal does."""
        return subprocess.Popen([self._ros2, *arguments], env=self._environment, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                start_new_session=True)

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run a `ros2` command to its end."""
        return subprocess.run([self._ros2, *arguments], env=self._environment, text=True,
                              capture_output=True, timeout=LIMIT_S)

    def ask(self, *arguments: str, until: Callable[[str], object] = bool) -> str:
        """
        Return what a `ros2` command prints, once it succeeds and prints what is waited for.

        Without a daemon each command has to find the drive anew, and on a busy machine it may
        give up before it has found all of it.
        """
        give_up = time.monotonic() + LIMIT_S
        while True:
            done = self.run(*arguments)
            if done.returncode == 0 and until(done.stdout):
                return done.stdout
            assert time.monotonic() < give_up, done.stdout + done.stderr


def interrupt(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Press Ctrl-C and return the exit code and what was printed."""
    os.killpg(process.pid, signal.SIGINT)
    try:
        printed, _ = process.communicate(timeout=STOP_S)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    return process.returncode, printed


# What depends on how the package was installed is tried after both installations, the rest after
# the one that needs nothing but pip.
after_both = pytest.mark.parametrize('shell', ['colcon', 'pip'], indirect=True, scope='module')
after_one = pytest.mark.parametrize('shell', ['pip'], indirect=True, scope='module')


@pytest.fixture(scope='module')
def shell(request: pytest.FixtureRequest) -> Iterator[Shell]:
    """
    Return a shell after an installation, or skip without rclpy or the ros2 command.

    Its drive is slow, and disturbs no other one: these tests are a group of their own.
    """
    pytest.importorskip('rclpy', reason='ROS 2 is not installed')
    if ROS2 is None:
        pytest.skip('the ros2 command line is not installed')
    with claimed_domain() as domain:
        yield Shell(request.getfixturevalue(f'{request.param}_installation'), domain)


@pytest.fixture(scope='module')
def drive(shell: Shell) -> Iterator[Shell]:
    """Start the five nodes with `ros2 run`, and return the shell to look at them from."""
    processes = {
        node: shell.start('run', 'antenna_drive', executable, '--ros-args', '-r',
                          f'__node:={node}', *CALM.get(node, ()))
        for node, executable in DRIVE.items()}
    try:
        # With its type given, this waits for a topic that nobody publishes yet.
        shell.ask('topic', 'echo', '--once', '--no-daemon', '/plant/axis_rate',
                  'std_msgs/msg/Float64')
        yield shell
    finally:
        ended = {node: interrupt(process) for node, process in processes.items()}
    assert {node: code for node, (code, _) in ended.items()} == dict.fromkeys(DRIVE, 0), ended


@after_both
@pytest.mark.parametrize('topic', ['/torque_share/bias_voltage', '/plant/encoder'])
def test_topic_echo(drive: Shell, topic: str) -> None:
    """A signal can be listened to by its name alone."""
    printed = drive.ask('topic', 'echo', '--once', '--no-daemon', topic)
    assert math.isfinite(float(re.findall(r'^data: (\S+)$', printed, re.MULTILINE)[0]))


@after_one
def test_topic_list(drive: Shell) -> None:
    """The topics of the drive are listed with their types."""
    expected = {f'{topic} [{kind}]' for topic, kind in TOPICS.items()}
    drive.ask('topic', 'list', '-t', '--no-daemon',
              until=lambda listed: expected <= set(listed.splitlines()))


@after_one
def test_topic_info(drive: Shell) -> None:
    """A signal has one publisher."""
    info = drive.ask('topic', 'info', '--no-daemon', '/motor_1/current')
    assert 'Type: std_msgs/msg/Float64\n' in info
    assert 'Publisher count: 1\n' in info


@after_one
def test_topic_hz(drive: Shell) -> None:
    """A signal comes at a steady rate that can be measured."""
    process = drive.start('topic', 'hz', '--window', '20', '/plant/axis_rate')
    assert process.stdout is not None
    for line in process.stdout:
        match = re.search(r'average rate: (\S+)', line)
        if match:
            assert float(match[1]) > 0.0
            break
    else:
        pytest.fail('ros2 topic hz ended without a rate')
    interrupt(process)


@after_one
def test_node_info(drive: Shell) -> None:
    """A node shows its signals and the frames that it reads."""
    # within the usual half second a busy machine has told the publishers only
    info = drive.ask('node', 'info', '--no-daemon', '--spin-time', '3', '/motor_2')
    publishers = info.partition('Publishers:')[2].partition('Service')[0]
    assert '/motor_2/frame: std_msgs/msg/Float64MultiArray' in publishers
    assert '/motor_2/current: std_msgs/msg/Float64\n' in publishers
    subscribers = info.partition('Subscribers:')[2].partition('Publishers:')[0]
    for node in ('test_signal', 'torque_share', 'plant'):
        assert f'/{node}/frame: std_msgs/msg/Float64MultiArray' in subscribers


@after_one
def test_param_list(drive: Shell) -> None:
    """Constants and tuning values are parameters of the unit's own node."""
    listed = drive.ask('param', 'list', '--no-daemon', '/torque_share').split()
    assert {'bias_pot', 'fade_out_voltage', 'filter_1.gain', 'filter_1.pole', 'k_2'} <= set(listed)


@after_both
def test_param_get_and_set(drive: Shell) -> None:
    """A tuning value is set while the drive runs, and reported once it is in force."""
    node = (*PATIENT, '/torque_share', 'bias_pot')
    assert drive.ask('param', 'get', *node).startswith('Double value is: ')
    assert 'successful' in drive.ask('param', 'set', *node, '0.25')
    assert drive.ask('param', 'get', *node) == 'Double value is: 0.25\n'


@after_one
@pytest.mark.parametrize('name, value', [('bias_pot', '1.5'), ('k_2', '-3.0')])
def test_param_set_is_refused(drive: Shell, name: str, value: str) -> None:
    """What is out of range, and a physical constant, is refused with a reason and unchanged."""
    node = (*PATIENT, '/torque_share', name)
    before = drive.ask('param', 'get', *node)
    refused = drive.run('param', 'set', *node, value)
    assert re.search(f'failed: .*{name}', refused.stdout + refused.stderr)
    assert drive.ask('param', 'get', *node) == before


@after_one
def test_param_describe(drive: Shell) -> None:
    """A parameter tells its unit, its range, and whether it may change."""
    described = drive.ask('param', 'describe', *PATIENT, '/torque_share', 'fade_out_voltage')
    assert re.search(r'Description: .*\bV\b', described)
    assert re.search(r'Min value: -50\.0\s+Max value: 0\.0', described)


@after_one
def test_plant_constants_are_read_only(drive: Shell) -> None:
    """The read-only mark stands on what cannot be tuned."""
    described = drive.ask('param', 'describe', *PATIENT, '/plant', 'gear_ratio')
    assert 'Read only: true' in described


@after_both
def test_namespace_moves_a_node(shell: Shell) -> None:
    """In a namespace everything of a node is in the namespace; alone it waits, and can be left."""
    process = shell.start('run', 'antenna_drive', 'torque_share', '--ros-args', '-r',
                          '__ns:=/elevation')
    value = shell.ask('param', 'get', *PATIENT, '/elevation/torque_share', 'bias_pot')
    assert value.startswith('Double value is: ')
    shell.ask('topic', 'list', '--no-daemon',
              until=lambda topics: '/elevation/torque_share/frame' in topics.split())
    code, printed = interrupt(process)
    assert code == 0, printed
