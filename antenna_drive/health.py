# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What of this installation is there, what works, and what to do about the rest.

Each part of the package is checked by use: a library is imported, the physics computes, a ROS 2
message is sent and received.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
import csv
from dataclasses import dataclass
from functools import partial
import importlib
from importlib import metadata
import math
import os
from pathlib import Path
import platform
import shutil
import sys
import tempfile
import time
from typing import Any

from antenna_drive import __version__
from antenna_drive.remedies import ROS_REMEDY
from antenna_drive.ros_releases import release_of, wheels
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
import simgap
from simgap.command.remedies import REMEDIES
from simgap.errors import one_line, UserError

OK, MISSING, BROKEN, NOTE = 'ok', 'missing', 'broken', 'note'
# How long a message may take to come back to its own process [s].
_LOOPBACK_S = 10.0


@dataclass(frozen=True)
class Finding:
    """
    What was found of one thing.

    part : of the package that needs it
    what : its name
    state : ok, missing, broken, or note for what is no fault but good to know
    found : version, place or error
    remedy : what to do; '' if nothing is to be done
    """

    part: str
    what: str
    state: str
    found: str
    remedy: str = ''


def _machine() -> Iterator[Finding]:
    yield Finding('machine', 'Python', OK, f'{platform.python_version()}, {sys.executable}')
    memory = os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 2**30
    yield Finding('machine', 'system', OK, f'{platform.system()} {platform.machine()}, '
                                           f'{os.cpu_count()} cores, {memory:.0f} GB')
    yield Finding('machine', 'engine', OK,
                  f'simgap {simgap.__version__}, {Path(simgap.__file__).parent}')
    program = shutil.which('antenna-drive')
    if program is None:
        yield Finding('machine', 'antenna-drive', NOTE, 'not on PATH',
                      'python -m antenna_drive does the same; or add '
                      f'{Path(sys.executable).parent} to PATH')
    else:
        yield Finding('machine', 'antenna-drive', OK, f'{__version__}, {program}')


def _libraries(part: str, *modules: str) -> Iterator[Finding]:
    for module in modules:
        yield _library(part, module, _bounds())


def _library(part: str, module: str, bounds: Mapping[str, str]) -> Finding:
    """Import a library, look for its files, compare its version with what `bounds` ask for."""
    names = sorted(set(metadata.packages_distributions().get(module, ())))
    if gone := [name for name in names if _lacks_files(name)]:
        return Finding(part, module, BROKEN,
                       f'files of {", ".join(gone)} are gone, as after an upgrade in place',
                       f'pip install --force-reinstall --no-deps {" ".join(gone)}')
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        name = (error.name or '').partition('.')[0]
        if name == module:
            return Finding(part, module, MISSING, 'not installed', REMEDIES.get(
                name, f"in a checkout: pip install -e '.[{part}]'"))
        return Finding(part, module, BROKEN, one_line(error),
                       REMEDIES.get(name, f'pip install {name}'))
    except Exception as error:  # whatever a library that does not fit raises
        return Finding(part, module, BROKEN, one_line(f'{type(error).__name__}: {error}'),
                       'install it again in this environment')
    name = next((name for name in names if name.lower() in bounds), ''.join(names[:1]))
    if not name:
        return Finding(part, module, OK, 'found')
    version, wanted = metadata.version(name), bounds.get(name.lower(), '')
    if not SpecifierSet(wanted).contains(version, prereleases=True):
        return Finding(part, module, BROKEN, f'{version}, wanted {wanted}',
                       f"pip install '{name}{wanted}'")
    return Finding(part, module, OK, version)


def _lacks_files(name: str) -> bool:
    """Tell whether code that pip has installed with a distribution is no longer there."""
    distribution = metadata.distribution(name)
    # `files` of Python 3.12 leaves out those that are not there
    rows = csv.reader((distribution.read_text('RECORD') or '').splitlines())  # not of pip: none
    paths = [Path(row[0]) for row in rows if row]
    return any(path.suffix == '.py' or '.so' in path.suffixes for path in paths
               if not Path(str(distribution.locate_file(path))).exists())


def _bounds() -> Mapping[str, str]:
    """Return the versions that this package asks for, by distribution."""
    try:
        return _read_bounds(metadata.requires('antenna_drive') or ())
    except metadata.PackageNotFoundError:  # run from its sources
        return {}


def _read_bounds(required: Iterable[str]) -> dict[str, str]:
    """Return the versions that requirements ask for, by distribution; the first of each counts."""
    found: dict[str, str] = {}
    for item in map(Requirement, required):
        found.setdefault(item.name.lower(), str(item.specifier))
    return found


def _physics() -> Iterator[Finding]:
    yield from _libraries('physics', 'numpy', 'scipy', 'numba', 'yaml', 'threadpoolctl')
    from antenna_drive.emulator.run import simulate
    from antenna_drive.parameters import load
    began = time.monotonic()
    run = simulate(load(), duration=0.1)
    finite = all(math.isfinite(float(run[name][-1])) for name in run.names)
    took = time.monotonic() - began
    yield Finding('physics', 'a run of 0.1 s', OK if finite else BROKEN,
                  f'{took:.1f} s' if finite else 'not finite',
                  '' if finite else 'report it with the versions above')
    from antenna_drive.physics.compiling import KEEPING
    folder = KEEPING.folder()
    if folder is None:
        yield Finding('physics', 'compiled physics', NOTE, 'is not kept: no folder can be written',
                      'set NUMBA_CACHE_DIR to a folder that can be written')
    else:
        yield Finding('physics', 'compiled physics', OK, f'kept in {folder.parent}')


def _ros() -> Iterator[Finding]:
    release, known = _release()
    found = [_library('nodes', module, known) for module in (
        'rclpy', 'std_msgs', 'std_srvs', 'rosgraph_msgs', 'diagnostic_msgs', 'sensor_msgs')]
    for finding in found:
        if finding.what == 'rclpy' and finding.state == BROKEN:
            finding = Finding(finding.part, finding.what, BROKEN, finding.found, ROS_REMEDY)
        yield finding
    if any(finding.state != OK for finding in found):
        return
    from rclpy.utilities import get_rmw_implementation_identifier
    yield Finding('nodes', 'ROS 2', OK, f'{release}, {get_rmw_implementation_identifier()}')
    yield _loopback()
    reach = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') or 'as ROS 2 has it'
    yield Finding('nodes', 'discovery', OK,
                  f'domain {os.environ.get("ROS_DOMAIN_ID", "0")}, range {reach}')
    yield from _ros2_run()
    free = shutil.disk_usage('/dev/shm').free / 2**20 if Path('/dev/shm').is_dir() else None
    if free is not None and free < 64.0:
        yield Finding('nodes', 'shared memory', NOTE, f'{free:.0f} MB free in /dev/shm',
                      'make room: without it messages go through the network stack')


def _release() -> tuple[str, Mapping[str, str]]:
    """Return which ROS 2 is used, and what its wheels are held to where it is of wheels."""
    if distribution := os.environ.get('ROS_DISTRO'):
        return f'{distribution}, sourced', {}
    try:
        release = release_of(metadata.version('ros-rclpy'))
    except metadata.PackageNotFoundError:
        return 'none sourced', {}
    if release is None:
        return 'wheels of a release that was not tried', {}
    return f'wheels of {release}', _read_bounds(wheels(release))


def _loopback() -> Finding:
    """Send a message through ROS 2 and take it again, in a context of its own."""
    from antenna_drive.lockstep.entry import own_node
    from antenna_drive.lockstep.leaving import leave
    from rclpy.executors import SingleThreadedExecutor
    from std_msgs.msg import Float64
    node = own_node(f'doctor_{os.getpid()}')
    try:
        got: list[float] = []
        topic = f'doctor_{os.getpid()}'
        publisher = node.create_publisher(Float64, topic, 1)
        node.create_subscription(Float64, topic, lambda message: got.append(message.data), 1)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        began = time.monotonic()
        while not got and time.monotonic() - began < _LOOPBACK_S:
            publisher.publish(Float64(data=1.0))
            executor.spin_once(timeout_sec=0.1)
        executor.shutdown()
        leave(node)
    finally:
        node.context.try_shutdown()
    if got:
        return Finding('nodes', 'a message', OK,
                       f'sent and received in {time.monotonic() - began:.1f} s')
    return Finding('nodes', 'a message', BROKEN, f'sent, not received within {_LOOPBACK_S:g} s',
                   'look at RMW_IMPLEMENTATION, ROS_DOMAIN_ID, the discovery variables and the '
                   'firewall of this machine')


def _ros2_run() -> Iterator[Finding]:
    prefixes = [Path(prefix) for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(':')
                if prefix]
    index = Path('share', 'ament_index', 'resource_index', 'packages', 'antenna_drive')
    place = next((prefix for prefix in prefixes if (prefix / index).exists()), None)
    if shutil.which('ros2') is None:
        yield Finding('nodes', 'ros2 run', NOTE, 'the ros2 command is not on PATH',
                      'source a ROS 2; or start the nodes without it: rate_loop_plant, '
                      'motor_drive, torque_share, test_signal')
    elif place is None:
        yield Finding('nodes', 'ros2 run', NOTE,
                      'AMENT_PREFIX_PATH does not lead to antenna_drive',
                      f'export AMENT_PREFIX_PATH={sys.prefix}'
                      '${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}')
    else:
        yield Finding('nodes', 'ros2 run', OK, str(place))


def _files() -> Iterator[Finding]:
    for what, folder in (('this folder', Path.cwd()), ('temporary files',
                                                       Path(tempfile.gettempdir()))):
        free = shutil.disk_usage(folder).free / 2**30
        if not os.access(folder, os.W_OK):
            yield Finding('files', what, NOTE, f'{folder} cannot be written',
                          'results need a folder that can')
        elif free < 0.5:
            yield Finding('files', what, NOTE, f'{folder} has {1024.0 * free:.0f} MB left',
                          'make room: a recording of an hour takes a gigabyte')
        else:
            yield Finding('files', what, OK, f'{folder}, {free:.0f} GB free')


# Parts in the order in which they are told; those of NEEDED are no choice, and those of CHECKOUT,
# for who changes or measures the package, are examined when they are named.
PARTS: dict[str, Callable[[], Iterator[Finding]]] = {
    'machine': _machine,
    'files': _files,
    'physics': _physics,
    'nodes': _ros,
    **{part: partial(_libraries, part, *modules) for part, modules in {
        'pages': ('jinja2',),
        'recording': ('mcap',),
        'bags': ('mcap', 'rosbags', 'mcap_protobuf'),
        'plot': ('matplotlib',),
        'live': ('tornado',),
        'parquet': ('pyarrow',),
        'cluster': ('distributed',),
        'completion': ('shtab',),
        'mujoco': ('mujoco',),
        'fmu': ('fmpy', 'pythonfmu', 'pythonfmu3'),
        'test': ('pytest', 'pytest_timeout', 'xdist', 'hypothesis', 'mypy', 'rosbags', 'flake8',
                 'vermin'),
        'bench': ('control', 'pathsim', 'pydrake'),
        'colcon': ('colcon_core', 'colcon_ros'),
    }.items()},
}
CHECKOUT = ('test', 'bench', 'colcon')
NEEDED = ('machine', 'files', 'physics', 'pages')


def examine(part: str) -> Iterator[Finding]:
    """Yield what is found of a part; a fault of the check itself is a finding, too."""
    try:
        yield from PARTS[part]()
    except UserError as error:
        yield Finding(part, 'check', BROKEN, str(error))
    except Exception as error:  # a part that breaks must not hide the others
        yield Finding(part, 'check', BROKEN, one_line(f'{type(error).__name__}: {error}'),
                      'report this line, with the output of antenna-drive doctor --json -')


def as_data(findings: list[Finding]) -> dict[str, Any]:
    """Return findings as plain data."""
    return {'version': __version__, 'works': all(item.state != BROKEN for item in findings),
            'findings': [vars(item) for item in findings]}
