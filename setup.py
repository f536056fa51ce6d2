# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Build and install antenna_drive: with pip, with or without ROS 2, or with colcon."""

from pathlib import Path
import runpy
import sys

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

PACKAGE = 'antenna_drive'
# Executables whose module has another name; any other module of nodes/ with a main has its own.
NAMES = {'signal_generator': 'test_signal'}

# The table of ROS 2 releases, each of which is an extra. It cannot be imported: what the package
# needs is not installed yet.
ROS = runpy.run_path(str(Path(PACKAGE, 'ros_releases.py')))


# The engine is a distribution of its own, simgap/pyproject.toml. A wheel cannot name a folder as a
# dependency, so that of the drive carries the engine's package, made from the one source. There
# it lies inside the drive's, behind whatever simgap is installed beside it.
CARRIED = 'bdist_wheel' in sys.argv
CARRIER = f'{PACKAGE}.carried'


def engine(package: str) -> str:
    """Return the name under which a package of the engine is installed."""
    return f'{CARRIER}.{package}' if CARRIED else package


ENGINE = {engine(package): package.replace('.', '/')
          for package in find_packages(include=['simgap', 'simgap.*'])}


class BuildWithEngine(build_py):  # type: ignore[misc]
    """Build the packages, and the line that puts a carried engine behind all other packages."""

    def run(self) -> None:
        """Build."""
        super().run()
        if CARRIED:
            line = Path(self.build_lib, f'{PACKAGE}_carried.pth')
            line.write_text(CARRIER.replace('.', '/') + '\n')


def config_files() -> list[tuple[str, list[str]]]:
    """Return config/ with its folders, as it is to lie in share/antenna_drive/config."""
    folders = [Path('config'), *sorted(p for p in Path('config').rglob('*') if p.is_dir())]
    return [(f'share/{PACKAGE}/{folder}', sorted(str(p) for p in folder.iterdir() if p.is_file()))
            for folder in folders if folder.is_dir()]


def nodes() -> dict[str, str]:
    """Return the module of each executable of nodes/."""
    modules = sorted(path.stem for path in Path(PACKAGE, 'nodes').glob('*.py')
                     if '\nmain = ' in path.read_text())
    return {NAMES.get(module, module): module for module in modules}


def launchers() -> list[tuple[str, list[str]]]:
    """
    Return small scripts in lib/antenna_drive that lead `ros2 run` to pip's executables in bin.

    colcon puts the executables themselves into lib/antenna_drive, as setup.cfg tells it.
    """
    if not {'bdist_wheel', 'editable_wheel'} & set(sys.argv):
        return []
    folder = Path('build', 'launchers')
    folder.mkdir(parents=True, exist_ok=True)
    for node in nodes():
        script = folder / node
        script.write_text(f'#!/bin/sh\nexec "${{0%/*}}/../../bin/{node}" "$@"\n')
        script.chmod(0o755)
    return [(f'lib/{PACKAGE}', [str(folder / node) for node in nodes()])]


setup(
    name=PACKAGE,
    version='0.1.0',
    packages=[*find_packages(include=[PACKAGE, f'{PACKAGE}.*']), *ENGINE],
    package_dir=ENGINE if CARRIED else {},
    package_data={'': ['py.typed', '*.yaml', '*.xml', '*.html', '*.js', '*.css', 'LICENSE'],
                  f'{PACKAGE}.pages': ['templates/*', 'live/*'],
                  engine('simgap.report'): ['templates/*', 'uplot/*']},
    cmdclass={'build_py': BuildWithEngine},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        *config_files(),
        *launchers(),
    ],
    python_requires='>=3.10',
    install_requires=[
        'numpy >= 1.24',
        'scipy >= 1.10',
        # The oldest is Ubuntu 24.04's. A new compiler may round a step differently and does not
        # read the old one's cache: a new series is let in once the suite has passed with it.
        'numba >= 0.58, < 0.69',
        'PyYAML >= 5.4',
        # the doctor reads what is asked for, as pip does
        'packaging >= 21',
        # the pages: what a recording says is escaped by a library that is known for it
        'Jinja2 >= 3.0',
        # a diagnosis makes its fits side by side, each with a linear algebra of one thread
        'threadpoolctl >= 3.0',
    ],
    extras_require={
        **ROS['extras'](),
        'plot': ['matplotlib >= 3.6'],
        'parquet': ['pyarrow >= 10'],
        # trials, studies, calibrations and fleets on a cluster
        'cluster': ['dask[distributed] >= 2024.1'],
        'completion': ['shtab >= 1.6'],
        # the page of `live`: a web server with WebSockets in one wheel that needs no other
        'live': ['tornado >= 6.1'],
        # models that people have: `diagnose --model FILE.yaml`
        'mujoco': ['mujoco >= 3.3'],
        # ... and the drive as one of them: `fmu`, of FMI 2 and of FMI 3
        'fmu': ['fmpy >= 0.3.22', 'pythonfmu >= 0.7', 'pythonfmu3 >= 0.3.4'],
        # the first release that can complete a chunk on demand
        'recording': ['mcap >= 1.5'],
        # bags of other machines; the first rosbags that reads a storage file alone
        'bags': ['mcap >= 1.5', 'rosbags >= 0.11', 'mcap-protobuf-support >= 0.5'],
        'test': [
            # pytest-xdist 3.8 finds a test's group by an attribute that pytest 9.2 does not read
            'pytest >= 7.4, < 9.2',
            'pytest-timeout >= 2.2',
            'pytest-xdist >= 3.7',
            'shtab >= 1.6',
            'hypothesis >= 6.80',
            'mypy >= 1.8',
            'types-PyYAML',
            'rosbags >= 0.11',  # reads our bags, as someone else's program would
            # recordings as other people's programs write them
            'mcap-protobuf-support >= 0.5',
            'pyarrow >= 10',
            # the drive as an FMU, and a program that loads it, which comes as a wheel alone
            'pythonfmu >= 0.7',
            'pythonfmu3 >= 0.3.4',
            f"libcosimpy ; {ROS['WHEELS_EXIST']} and python_version >= '3.11'",
            # the page, and a client of it
            'tornado >= 6.1',
            # the linters of ament_flake8 and ament_pep257
            'flake8 >= 6',
            'flake8-builtins',
            'flake8-comprehensions',
            'flake8-deprecated',
            'flake8-docstrings',  # which is pydocstyle, as in ament_pep257
            'flake8-import-order',
            'flake8-quotes',
            'vermin',  # tells what the oldest Python lacks
        ],
        # what the emulator is measured against, and dask as a cluster; PathSim and Drake change
        # from release to release, so not older than those that the benchmark was written with
        'bench': [
            'control >= 0.10',
            'pathsim >= 0.27',
            f'drake >= 1.51 ; {ROS["WHEELS_EXIST"]}',
            'dask[distributed] >= 2024.1',
        ],
        'colcon': ['colcon-core >= 0.15', 'colcon-ros', 'colcon-common-extensions'],
    },
    zip_safe=False,
    author='The antenna_drive authors',
    maintainer='The antenna_drive authors',
    maintainer_email='maintainers@example.com',
    description='A two-motor antenna drive with torque bias, emulated as ROS 2 nodes in lock-step',
    license='Apache-2.0',
    keywords=['ROS', 'ROS 2', 'antenna', 'servo', 'torque bias', 'emulator'],
    entry_points={
        'console_scripts': [
            f'antenna-drive = {PACKAGE}.cli:main',
            'simgap = simgap.cli:main',
            *(f'{name} = {PACKAGE}.nodes.{module}:main' for name, module in nodes().items()),
        ],
    },
)
