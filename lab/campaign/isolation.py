# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Look at the drive from another network, and at what the middleware has of ROS 2 security."""

from collections.abc import Mapping, Sequence
import json
import os
from pathlib import Path
import random
import subprocess
import sys
import tempfile
from typing import Any

from lab.campaign.trials import Outcome

RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
SUBNET = {RANGE: 'SUBNET'}
LISTEN_S = 8.0
NODE = (sys.executable, '-m', 'antenna_drive.nodes.signal_generator')
LISTENER = (sys.executable, '-m', 'lab.campaign.listener', str(LISTEN_S))
WITHOUT_SECURITY = "doesn't have the security libraries"


def run(name: str, options: Mapping[str, Any], rng: random.Random) -> Outcome:
    """Do one check."""
    outcome = Outcome()
    if name == 'security':
        _security(outcome)
    else:
        _another_network(outcome)
    return outcome


def _ip(*words: str) -> None:
    subprocess.run(['ip', *words], check=True, capture_output=True, text=True, timeout=20.0)


def _another_network(outcome: Outcome) -> None:
    """See a node from the same network and from another, with and without the setting."""
    networks = [f'antenna_{os.getpid()}_{side}' for side in 'ab']
    try:
        for number, network in enumerate(networks):
            _ip('netns', 'add', network)
        _ip('link', 'add', 'end_a', 'netns', networks[0], 'type', 'veth', 'peer', 'name', 'end_b',
            'netns', networks[1])
        for number, (network, end) in enumerate(zip(networks, ('end_a', 'end_b')), 1):
            _ip('-n', network, 'addr', 'add', f'10.213.77.{number}/24', 'dev', end)
            _ip('-n', network, 'link', 'set', end, 'up')
            _ip('-n', network, 'link', 'set', 'lo', 'up')
            _ip('-n', network, 'link', 'set', 'lo', 'multicast', 'on')
            _ip('-n', network, 'route', 'add', '239.255.0.0/16', 'dev', end)
        seen = {
            'same network, no setting': _sees(networks[0], {}, networks[0], {}),
            'other network, no setting': _sees(networks[0], {}, networks[1], {}),
            'other network, setting of the other': _sees(networks[0], {}, networks[1], SUBNET),
            'other network, setting of both': _sees(networks[0], SUBNET, networks[1], SUBNET)}
    except FileNotFoundError:
        outcome.skipped = 'there is no ip command (iproute2)'
        return
    except subprocess.CalledProcessError as error:
        outcome.skipped = f'no network namespace can be made here: {error.stderr.strip()}'
        return
    finally:
        for network in networks:
            subprocess.run(['ip', 'netns', 'del', network], capture_output=True)
    outcome.figures['seen'] = seen
    wanted = {'same network, no setting': True, 'other network, no setting': False,
              'other network, setting of the other': False, 'other network, setting of both': True}
    for case, want in wanted.items():
        outcome.count('views')
        if seen[case] != want:
            outcome.find(f'{case}: the drive is {"" if seen[case] else "not "}seen', 'let_in')


def _sees(where: str, given: Mapping[str, str], from_where: str,
          given_there: Mapping[str, str]) -> bool:
    """Tell whether a listener in one network sees a node in another, or hears its hello."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith(
        ('ROS_AUTOMATIC', 'ROS_LOCALHOST', 'ROS_STATIC', 'FASTDDS', 'FASTRTPS'))}

    def start(network: str, settings: Mapping[str, str], command: Sequence[str],
              **more: Any) -> subprocess.Popen[str]:
        return subprocess.Popen(['ip', 'netns', 'exec', network, *command], text=True,
                                env={**environment, **settings}, stdin=subprocess.DEVNULL, **more)

    node = start(where, given, NODE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        listener = start(from_where, given_there, LISTENER, stdout=subprocess.PIPE,
                         stderr=subprocess.DEVNULL)
        said, _ = listener.communicate(timeout=120.0)
        found = json.loads(said.strip().splitlines()[-1])
        return 'test_signal' in found['nodes'] or found['frames'] > 0
    finally:
        node.terminate()
        node.wait(20.0)


def _security(outcome: Outcome) -> None:
    """Start a node that has to be secure; the middleware says if it cannot be."""
    with tempfile.TemporaryDirectory() as keystore:
        (Path(keystore) / 'enclaves').mkdir()
        done = subprocess.run(
            NODE, capture_output=True, text=True, timeout=120.0,
            env={**os.environ, 'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': 'Enforce',
                 'ROS_SECURITY_KEYSTORE': keystore})
    outcome.count('views')
    outcome.figures['security'] = (
        'the middleware was built without it' if WITHOUT_SECURITY in done.stderr
        else 'the middleware has it')
    outcome.figures['said'] = done.stderr.strip()[-300:]
    if done.returncode == 0:
        outcome.find('a node without keys runs although security is enforced', 'let_in')
    if 'Traceback' in done.stderr:
        outcome.find('a node without keys ends with a traceback', 'tracebacks',
                     text=done.stderr[-2000:])
