# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Each example in a --help runs when it is pasted, in a folder that has the files that it names.

Those that take minutes are trials. Those of the laboratory take hours, and two need another
machine: of these it is tested that the command understands them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
import os
from pathlib import Path
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time

from antenna_drive import cli as drive
from antenna_drive.cli import main
from installations import NODES, ROOT
from lab import cli as laboratory
import numpy as np
from own.test_own_propose import push_off
import pytest
from simgap import cli as engine
from simgap.command.programs import OK

PROGRAMS = {item.PROGRAM.name: item.PROGRAM for item in (drive, engine, laboratory)}
_BEGIN = re.compile(rf' +((?:{"|".join(PROGRAMS)}|ros2|mkdir) .*)')
_ABOUT = re.compile('   +| +#')
# The machine of the examples, and programs that play a test on it and on an antenna.
MACHINE = 'from own.test_own_propose import model\nmachine = model()\n'
PLAY = """\
#!/bin/sh
{python} -c '
import sys
import numpy as np
rows = np.genfromtxt(sys.argv[1], delimiter=",", names=True, comments="#")
time = rows["time_s"]
angle = 0.8 * np.exp(-0.1 * time) * np.cos(2.0 * time)
np.savetxt(sys.argv[2], np.column_stack([time, rows["turn"], angle, np.gradient(angle, time)]),
           delimiter=",", header="time_s,turn,angle,rate", comments="")
' "$1" "$2" && echo 'constants: {{height: 0.8}}' > "${{2%.csv}}.yaml"
"""
# Each ends when it is asked to, and says so many words before.
SERVERS = {'antenna-drive live': 'http://', 'ros2 run': 'ready; waits for'}
# What starts a whole drive runs beside no other test that does.
DRIVES = ('antenna-drive live', 'antenna-drive record', 'antenna-drive article --through-nodes')
TRIALS = ('antenna-drive investigate', 'simgap investigate', 'antenna-drive confusability',
          'antenna-drive diagnose-many', 'simgap propose',
          'antenna-drive article --figures', 'antenna-drive article --through-nodes',
          'antenna-drive propose', 'antenna-drive predict', 'antenna-drive diagnose',
          'simgap diagnose')
ELSEWHERE = {'lab ': 'the laboratory takes hours, or needs a trial that took them',
             '--scheduler tcp://host:8786': 'there is no cluster of that name',
             'ros2 service': 'needs the ros2 command line and a drive, see test/ros2cli',
             'simgap machine-from': 'it needs a robot and MuJoCo, see test/robot',
             'my_machine.yaml': 'MuJoCo models are tested in test/own'}


def examples_of(text: str) -> Iterator[str]:
    """Yield the examples in a help, as a shell gets them."""
    lines = iter(text.splitlines())
    for line in lines:
        if not (begin := _BEGIN.fullmatch(line)):
            continue
        # what is said about it stands behind some spaces, or a number sign
        word = _ABOUT.split(begin[1])[0].strip()
        while word.endswith('\\') or word.count("'") % 2:
            word = f'{word.removesuffix(chr(92)).rstrip()} {next(lines).strip()}'
        yield word


def found() -> list[str]:
    """Return the examples of all programs and nodes, each once."""
    texts = [program._module(name).__doc__ or '' for program in PROGRAMS.values()
             for name in program.commands]
    texts += [ast.get_docstring(ast.parse(path.read_text()), clean=False) or ''
              for path in sorted((ROOT / 'antenna_drive' / 'nodes').glob('*.py'))]
    return list(dict.fromkeys(word for text in texts for word in examples_of(text)))


EXAMPLES = found()
# mkdir prepares the example after it
COMMANDS = [word for word in EXAMPLES if not word.startswith('mkdir')]


def test_they_are_found() -> None:
    assert len(EXAMPLES) > 80
    for program in PROGRAMS.values():
        assert any(word.startswith(f'{program.name} ') for word in EXAMPLES)
    assert all(any(f' {node}' in word for word in EXAMPLES) for node in (
        'twin', 'recorder', 'joint_states', 'partner', 'command_player', 'recording_player'))


@pytest.mark.parametrize('example', COMMANDS)
def test_it_is_understood(example: str) -> None:
    """Program, command and options are there, and the options have what they take."""
    for part in example.split('&&'):
        words = shlex.split(part.partition('>')[0])
        if words[0] == 'ros2':
            assert words[1] == 'service' or words[2] == 'antenna_drive' and words[3] in NODES
            continue
        parsed = PROGRAMS[words[0]].parser(words[1]).parse_args(words[1:])
        assert parsed is not None


@pytest.fixture(scope='module')
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that the examples name."""
    folder = tmp_path_factory.mktemp('prepared')

    def record(name: str, seconds: float, *settings: str) -> None:
        assert main(['run', '--duration', f'{seconds}', '--out', f'{folder / name}',
                     *(['--set', *settings] if settings else [])]) == OK

    wave = 'test_signal.waveform={}', 'test_signal.amplitude=0.005', 'test_signal.period=2'
    record('run', 26.0, *(item.format('saw_tooth') for item in wave))
    for name, kind in {'a': 'square', 'b': 'saw_tooth', 'c': 'sine', 'd': 'square'}.items():
        record(f'whole_{name}.csv', 4.0, *(item.format(kind) for item in wave))
        assert main(['export', f'{folder}/whole_{name}.csv', f'{folder}/rec_{name}.csv',
                     '--field']) == OK
    record('field_bag', 4.0)
    for name in ('rec_a.csv', 'rec_a.meta.json', 'rec_a.yaml'):
        if (folder / name).exists():
            shutil.copy(folder / name, folder / name.replace('rec_a', 'field'))
    for suffix in ('csv', 'meta.json'):
        shutil.copy(folder / f'whole_a.{suffix}', folder / f'run.{suffix}')
    (folder / 'antennas' / 'north').mkdir(parents=True)
    for path in folder.glob('rec_a.*'):
        shutil.copy(path, folder / 'antennas' / 'north')
    (folder / 'my_drive.yaml').write_text('gearbox: {half_gap: 0.16}\n')
    (folder / 'my_antenna.yaml').write_text('gearbox: {half_gap: 0.15}\n')
    shutil.copy(ROOT / 'examples' / 'data_sheet.yaml', folder)
    sheet = ('waveform: {type: multisine, amplitude_deg_s: 0.2, frequencies_hz: [1.0, 3.0],\n'
             '           weights: [0.5, 0.5], phases: [0.0, 1.0], start_s: 0.05}\n')
    for name in ('next', 'my_sheet', 'planned'):
        (folder / f'{name}.yaml').write_text(sheet)
    (folder / 'log.csv').write_text('t,speed\n0.0,0.0\n0.1,1.0\n0.2,2.0\n')
    (folder / 'log_map.yaml').write_text(
        'time: {column: t}\nsignals:\n'
        '  test_signal/rate_command: {column: speed, unit: deg/s}\n')
    (folder / 'my_topics.yaml').write_text(
        'time: {column: source}\nsignals:\n'
        '  test_signal/rate_command: {column: /log/speed, unit: deg/s}\n'
        '  plant/encoder: {column: /log/elevation, unit: deg}\n')
    own_machine(folder)
    return folder


def own_machine(folder: Path) -> None:
    """Write a machine of one's own, its logs, and a program that plays a test."""
    (folder / 'my_machine.py').write_text(MACHINE)
    (folder / 'logs').mkdir()
    for number, name in enumerate(('logs/one', 'logs/two', 'more', 'a', 'b')):
        log = push_off(10.0, np.random.default_rng(number))
        height = log.constants['height']
        angle = height * np.exp(-0.1 * log.time) * np.cos(2.0 * log.time)
        np.savetxt(folder / f'{name}.csv', np.column_stack(
            [log.time, log['turn'], angle, np.gradient(angle, log.time)]), delimiter=',',
            header='time_s,turn,angle,rate', comments='')
        (folder / f'{name}.yaml').write_text(f'constants: {{height: {height}}}\n')
    (folder / 'map.yaml').write_text(
        'time: {column: time_s}\nsignals:\n' + ''.join(
            f'  {name}: {{column: {name}, unit: "{unit}"}}\n'
            for name, unit in (('turn', 'rad'), ('angle', 'rad'), ('rate', 'rad/s'))))
    (folder / 'play.sh').write_text(PLAY.format(python=sys.executable))
    (folder / 'play.sh').chmod(0o755)


def environment(folder: Path) -> dict[str, str]:
    """Return that of a shell which finds the programs of this source tree."""
    programs = folder / 'bin'
    programs.mkdir()
    for program, module in {'antenna-drive': 'antenna_drive', 'simgap': 'simgap'}.items():
        (programs / program).write_text(f'#!/bin/sh\nexec {sys.executable} -m {module} "$@"\n')
    modules = {'test_signal': 'signal_generator'}
    (programs / 'ros2').write_text(
        '#!/bin/sh\nshift 2\nnode=$1\nshift\n' + ''.join(
            f'[ $node != {node} ] || exec {sys.executable} -m '
            f'antenna_drive.nodes.{modules.get(node, node)} "$@"\n' for node in NODES))
    for path in programs.iterdir():
        path.chmod(0o755)
    # a home of its own, but for the compiled code: it is that of the other tests
    cache = os.environ.get('XDG_CACHE_HOME') or str(Path.home() / '.cache')
    return {**os.environ, 'PATH': f'{programs}:{os.environ["PATH"]}', 'HOME': str(folder),
            'XDG_CACHE_HOME': cache,
            'PYTHONPATH': os.pathsep.join(map(str, (ROOT, ROOT / 'test')))}


def before(number: int) -> str:
    """Return what has to be pasted before an example: folders, or the verdict that it reads."""
    word = EXAMPLES[number]
    earlier = [*EXAMPLES[number - 1::-1], *EXAMPLES[number + 1:]]
    if '~/' in word:
        return next(item for item in earlier if item.startswith('mkdir'))
    if re.search(r'(?<!--json )verdict\.json', word):
        return next(item for item in earlier if '--json verdict.json' in item
                    and item.split()[0] == word.split()[0] and 'yaml logs' not in item)
    return ''


def pasted(drives: bool) -> Iterator[object]:
    """
    Yield the examples that start a drive, or the others, each with what goes before it.

    What cannot be run here says why.
    """
    for number, word in enumerate(EXAMPLES):
        if word.startswith('mkdir') or word.startswith(DRIVES) is not drives:
            continue
        reason = next((ELSEWHERE[part] for part in ELSEWHERE if part in word), '')
        yield pytest.param(' && '.join(filter(None, (before(number), word))), id=word, marks=[
            pytest.mark.skip(reason) if reason else
            pytest.mark.trial if word.startswith(TRIALS) else pytest.mark.slow])


@pytest.mark.timeout(1200)
@pytest.mark.parametrize('example', [*pasted(drives=False)])
def test_it_runs(example: str, prepared: Path, tmp_path: Path, node_domain: int) -> None:
    paste(example, prepared, tmp_path)


@pytest.mark.timeout(1200)
@pytest.mark.parametrize('example', [*pasted(drives=True)])
def test_its_drive_runs(example: str, prepared: Path, tmp_path: Path, fresh_domain: int) -> None:
    paste(example, prepared, tmp_path)


def paste(example: str, prepared: Path, tmp_path: Path) -> None:
    """Run an example in a copy of the folder, until it ends or is asked to."""
    folder = tmp_path / 'here'
    shutil.copytree(prepared, folder)
    server = next((said for begin, said in SERVERS.items() if example.startswith(begin)), '')
    for target in re.findall(r'--out (\S+)', example) + re.findall(
            r'(?:export|import) \S+ (\S+)', example):
        for path in folder.glob(f'{Path(target).stem}.*' if '.' in target else target):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    log = tmp_path / 'said'
    with log.open('wb') as stream:
        # the shell becomes the program, which gets the signal
        process = subprocess.Popen(['bash', '-c', f'exec {example}' if server else example],
                                   cwd=folder, env=environment(tmp_path), stdin=subprocess.DEVNULL,
                                   stdout=stream, stderr=stream)
        try:
            while server and process.poll() is None and server not in log.read_text():
                time.sleep(0.05)
            if server:
                process.send_signal(signal.SIGINT)
            code = process.wait()
        finally:
            process.kill()
    said = log.read_text(errors='replace')
    assert code in ((0, 130) if server else (0, 1)), said
    assert server in said and 'Traceback' not in said, said
