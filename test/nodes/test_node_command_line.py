# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says to a person who starts it wrongly, and with what exit code."""

from __future__ import annotations

from pathlib import Path
import signal
import subprocess
import sys

import pytest

NODES = ('rate_loop_plant', 'motor_drive', 'torque_share', 'signal_generator')


def run_node(node: str, *args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, '-m', f'antenna_drive.nodes.{node}', *args],
                          capture_output=True, text=True, timeout=120.0)


def the_line(done: subprocess.CompletedProcess[str]) -> str:
    assert not done.stdout
    [line] = done.stderr.splitlines()
    return line


@pytest.mark.parametrize('node', NODES)
def test_a_machine_without_ros_is_told_what_is_missing(node: str) -> None:
    program = (f'import sys; sys.modules["rclpy"] = None\n'
               f'from antenna_drive.nodes.{node} import main\nsys.exit(main([]))')
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          timeout=120.0)
    assert done.returncode == 3
    assert 'needs rclpy' in the_line(done)
    assert 'pip install' in the_line(done)


@pytest.mark.parametrize('node', NODES)
def test_help_needs_no_ros(node: str) -> None:
    program = (f'import sys; sys.modules["rclpy"] = None\n'
               f'from antenna_drive.nodes.{node} import main\nsys.exit(main(["--help"]))')
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          timeout=120.0)
    assert done.returncode == 0
    assert '--ros-args' in done.stdout


@pytest.mark.parametrize('node, args, said', [
    ('torque_share', ('-p', 'bias_pod:=0.5'), 'did you mean bias_pot?'),
    ('torque_share', ('-p', 'bias_pot:=1e9'), 'bias_pot'),
    ('torque_share', ('-p', "config:=['no_such_circuit']"), 'no_such_circuit'),
    ('signal_generator', ('-p', 'run.pase:=1.0'), 'run.pase'),
    ('signal_generator', ('-p', 'run.step:=0.0'), 'run.step'),
    ('signal_generator', ('-p', 'waveform:=triangel'), 'waveform'),
    ('motor_drive', ('-p', 'run.pace:=1.0'), 'run.pace'),
    ('motor_drive', ('-r', '__node:=motor_3'), 'motor_1, motor_2'),
    ('motor_drive', ('--params-file', 'no_such_file.yaml'), 'no_such_file.yaml'),
    # a list without anything in it, which has no type in ROS 2
    ('signal_generator', ('-p', 'frequencies:=[]'), 'frequencies'),
    ('signal_generator', ('-p', 'run.pace:=[]'), 'run.pace'),
    ('torque_share', ('-p', 'bias_pot:=[]'), 'bias_pot'),
    ('torque_share', ('-p', 'config:=[1, 2]'), 'config: [1, 2] given'),
    ('joint_states', ('-p', 'joints:=[]'), 'joints'),
    ('recorder', ('-p', 'out:=[]'), 'out'), ('recorder', ('-p', 'out:=5'), 'out: 5 given'),
    ('recorder', ('-p', 'sync:=[]'), 'sync'), ('twin', ('-p', 'alarms_per_day:=[]'), 'alarms_per'),
])
@pytest.mark.usefixtures('node_domain')
@pytest.mark.slow
def test_wrong_input_is_one_line_and_exit_code_2(
        node: str, args: tuple[str, ...], said: str) -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    done = run_node(node, '--ros-args', *args)
    assert done.returncode == 2
    assert said in the_line(done)


@pytest.mark.usefixtures('node_domain')
def test_what_is_no_ros_argument_is_refused() -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    done = run_node('torque_share', '--bias')
    assert done.returncode == 2
    assert '--bias' in the_line(done)


@pytest.mark.usefixtures('node_domain')
def test_a_file_of_parameters_sets_constants_too(tmp_path: Path) -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    from drive_watch import Watch
    file = tmp_path / 'mine.yaml'
    file.write_text('motor_1:\n  ros__parameters:\n    armature.resistance: 2\n'
                    '    config: [old_circuit]\n')
    node = subprocess.Popen([sys.executable, '-m', 'antenna_drive.nodes.motor_drive',
                             '--ros-args', '--params-file', str(file)])
    try:
        with Watch() as watch:
            assert watch.get('motor_1', 'armature.resistance', 'config') == [2.0, ['old_circuit']]
            watch.until(lambda: 'test_signal' in watch.value('motor_1', 'waiting for'),
                        'the report that it waits')
    finally:
        node.send_signal(signal.SIGTERM)
        assert node.wait(60.0) == 0


@pytest.mark.usefixtures('node_domain')
def test_an_empty_list_of_configurations_is_none(tmp_path: Path) -> None:
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    from drive_watch import Watch
    file = tmp_path / 'mine.yaml'
    file.write_text('/**:\n  ros__parameters:\n    config: []\n    bias_pot: 0.5\n')
    node = subprocess.Popen([sys.executable, '-m', 'antenna_drive.nodes.torque_share',
                             '--ros-args', '--params-file', str(file)])
    try:
        with Watch() as watch:
            assert watch.get('torque_share', 'bias_pot', 'config') == [0.5, ['reference']]
    finally:
        node.send_signal(signal.SIGTERM)
        assert node.wait(60.0) == 0


def test_discovery_and_transport_are_the_users_to_choose() -> None:
    from antenna_drive.lockstep.entry import choose_transport
    untouched = {'ROS_LOCALHOST_ONLY': '0', 'FASTDDS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    environment = dict(untouched)
    choose_transport(environment)
    assert environment == untouched
    environment = {}
    choose_transport(environment)
    assert environment.pop('ROS_AUTOMATIC_DISCOVERY_RANGE') == 'LOCALHOST'
    (profiles,) = environment.values()
    assert 'heartbeat_response_delay' in Path(profiles).read_text()


def test_a_node_asks_nobody_for_types() -> None:
    rclpy = pytest.importorskip('rclpy')
    if rclpy.get_rmw_implementation_identifier() != 'rmw_fastrtps_cpp':
        pytest.skip('the middleware is not Fast DDS')
    program = ('import os\nfrom pathlib import Path\n'
               'from antenna_drive.lockstep.entry import choose_transport\n'
               'choose_transport(os.environ)\n'
               'import rclpy\nrclpy.init()\nnode = rclpy.create_node("any")\n'
               'print(*(p.read_text().strip() for p in Path("/proc/self/task").glob("*/comm")))')
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          timeout=120.0)
    threads = done.stdout.split()
    assert any(name.startswith('dds.udp') for name in threads), done.stderr
    assert not [name for name in threads if name.startswith('dds.tls')]
