# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
What a verdict found of a robot's joint, written back into the robot's own file.

It is changed as text, so a difference of the two files shows what was found.
"""

from collections.abc import Iterator, Mapping
import math
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers.expat import ExpatError

import numpy as np
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.xml_text import Element, XmlText
from simgap.machine.by_label import without_labels
from simgap.model.declared import ModelError
from simgap.model.machine import OwnMachine
from simgap.model.model_file import FileSimulation
from simgap.model.robot_joint import DRY, robot, TEETH, text_of, TWIST
from simgap.verdict.record import Verdict

# What a file may say of a joint J, by its place in the machine; what else has to follow it.
_SAID = {'joint.J.frictionloss': 'coulomb', 'joint.J.damping': 'viscous',
         'joint.J.armature': 'rotor', 'actuator.J_drive.forcerange[1]': 'limit',
         'actuator.J_drive.gainprm[0]': 'kp', 'actuator.J_drive.biasprm[2]': 'kv',
         'body.J_load.mass': 'load', 'tendon.J_teeth.stiffness': 'stiffness',
         'tendon.J_teeth.lengthspring[1]': 'half_gap', 'joint.J_twist.damping': 'loss'}
_FOLLOWS = ('actuator.J_drive.forcerange[0]', 'actuator.J_drive.biasprm[1]',
            'tendon.J_teeth.lengthspring[0]', *(f'body.J_load.inertia[{k}]' for k in range(3)))
_MJCF = {'coulomb': 'frictionloss', 'viscous': 'damping', 'rotor': 'armature'}
_URDF = {'dynamics': {'coulomb': 'friction', 'viscous': 'damping'}, 'limit': {'limit': 'effort'}}
_TWIST = ('stiffness', 'half_gap', 'loss')
_INERTIAL = 'mass diaginertia fullinertia value ixx ixy ixz iyy iyz izz'.split()
_SAME = 1e-3  # share by which a number has to change to be written


class Corrections(NamedTuple):
    """What was found of a joint: each number by its name in `_SAID`, or by its place."""

    joint: str
    step_s: float  # of the machine
    before: Mapping[str, float]
    now: Mapping[str, float]
    changed: Mapping[str, float]


def source_of(model: Path, target: Path) -> tuple[Path, str]:
    """Return the file that is corrected into `target`, and its joint; ModelError if none is."""
    source = read_yaml(model).get('source') if model.suffix in ('.yaml', '.yml') else None
    path = model.parent / str((source or {}).get('file'))
    if not source or path.suffix != target.suffix or not path.is_file():
        raise ModelError(f'--corrected {target}: {model} is not made by simgap machine-from of a '
                         f'{target.suffix or "file of that kind"}; its entry source is {source}')
    return path, str(source['joint'])


def found_of(verdict: Verdict, joint: str) -> Corrections:
    """Return what the best answer of a verdict says of the joint, in its first test."""
    machine = without_labels(verdict.machine)
    assert isinstance(machine, OwnMachine)
    simulate = machine.model.simulate
    assert isinstance(simulate, FileSimulation)
    told: list[dict[str, float]] = []
    for point in (dict[str, float](), verdict.best.state.point()):
        numbers, defaults = machine.numbers(point, 0), simulate.simulator.defaults.tolist()
        values = simulate.acted(dict(zip(simulate.places, defaults, strict=True)), numbers)
        places = {place: place.replace(f'.{joint}', '.J', 1) for place in values
                  if place not in simulate.starts}
        told.append({_SAID.get(name, name): values[place] for place, name in places.items()
                     if name not in _FOLLOWS}
                    | {'delay' if item.act == 'delays' else f'{item.act} {item.target}':
                       item.factor * numbers[item.number] for item in simulate.of_signals})
    return Corrections(joint, simulate.longest_step_s, told[0], told[1], {
        name: value for name, value in told[1].items()
        if abs(value - told[0][name]) > _SAME * abs(told[0][name])})


def corrected(source: Path, found: Corrections,
              ) -> tuple[bytes, list[tuple[str, float, float, str]]]:
    """
    Return a file with what was found, and of each number name, before, now, and where it is.

    Before and now are in SI; the last is '' if such a file cannot say it. Raises ModelError if the
    file does not have the joint.
    """
    try:
        data, said = (_urdf if source.suffix == '.urdf' else _mjcf)(source, found)
    except (ExpatError, ValueError, KeyError, IndexError, StopIteration) as error:
        raise ModelError(f'{source}: {error!r}: joint {found.joint} and all entries of the model '
                         'file have to be as when it was made, none in an included file') from None
    return data, [(name.replace('.J', f'.{found.joint}'), found.before[name], value,
                   said.get(name, '')) for name, value in found.changed.items()]


def _mjcf(source: Path, found: Corrections) -> tuple[bytes, dict[str, str]]:
    """Return an MJCF with what was found, and where each number is."""
    text, model, now = XmlText(source.read_bytes()), robot(source), dict(found.changed)
    joint = text.root.find('joint', name=found.joint)[0]
    value = {name: f'{value:.9g}' for name, value in found.now.items()}
    places = {name: (joint, {attribute: value[name]}) for name, attribute in _MJCF.items()}
    for drive in (item for part in text.root.find('actuator') for item in part.children
                  if item.attributes.get('joint') == found.joint):
        places |= {name: (drive, attributes) for name, attributes in _servo(
            drive.tag, value, math.ceil(found.now['delay'] / found.step_s) + 2)}
    if not now.keys().isdisjoint(_TWIST):
        now |= {name: found.now[name] for name in ('rotor', *_TWIST)}
        places |= {name: (joint, {}) for name in _TWIST}
        _insert_twist(text, joint, model, value, found)
    if found.now['coulomb']:
        text.change(joint, **DRY)
    body = next(item for item in text.root.find('body') if joint in item.children)
    for item, attributes in (places[name] for name in now if name in places):
        text.change(item, **attributes)
    said = {name: ' '.join((item.tag, *attributes)) for name, (item, attributes) in places.items()}
    said |= _scale(text, body.find('body'), found)
    return bytes(text), said


def _servo(tag: str, value: Mapping[str, str],
           samples: int) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield what an actuator of MJCF can say, as attributes."""
    yield 'delay', {'delay': value['delay'], 'interp': 'linear', 'nsample': str(samples)}
    if 'limit' in value:
        yield 'limit', {'forcerange': f'-{value["limit"]} {value["limit"]}'}
    kp, kv = value.get('kp', ''), value.get('kv', '0')
    if kp and tag == 'position':
        yield from (('kp', {'kp': kp}), ('kv', {'kv': kv.lstrip('-')}))
    elif kp and tag == 'general':
        yield from dict.fromkeys(('kp', 'kv'), {'gainprm': kp, 'biasprm': f'0 -{kp} {kv}'}).items()


def _insert_twist(text: XmlText, joint: Element, model: Any, value: Mapping[str, str],
                  found: Corrections) -> None:
    """Insert the twist behind the motor, and change whatever else has to follow."""
    own = model.joint(found.joint)
    words = {**value, 'joint': found.joint, 'line': text_of(model.jnt_axis[own.id]),
             'pos': text_of(own.pos),
             'gap': text_of(found.now['half_gap'] * np.array([-1.0, 1.0]) + 0.0)}
    text.insert(TWIST.substitute(words), joint)
    text.insert(TEETH.substitute(words), text.root.children[-1])
    for key in text.root.find('key'):  # the twist has a coordinate, too
        for name, at in (('qpos', own.qposadr[0] + 1), ('qvel', own.dofadr[0] + 1)):
            if kept := key.attributes.get(name, '').split():
                text.change(key, **{name: ' '.join((*kept[:at], '0', *kept[at:]))})
    step = f'{min(found.step_s, model.opt.timestep):g}'
    if options := [item for item in text.root.find('option') if 'timestep' in item.attributes]:
        text.change(options[-1], timestep=step)
    else:
        text.insert(f'<option timestep="{step}"/>', text.root.children[-1])


def _scale(text: XmlText, links: list[Element], found: Corrections) -> dict[str, str]:
    """Scale mass and inertia of links or bodies, unless one has them from its shapes alone."""
    own = {link: [item for item in link.children if item.tag == 'inertial'] for link in links}
    if 'load' not in found.changed or any(not own[link] and link.find('geom') for link in links):
        return {}
    for part in (item for parts in own.values() for part in parts for item in (
            part, *part.children)):
        numbers = {name: np.array(part.attributes[name].split(), float)
                   for name in _INERTIAL if name in part.attributes}
        ratio = found.now['load'] / found.before['load']
        text.change(part, **{name: text_of(ratio * value) for name, value in numbers.items()})
    return {'load': f'inertial of {len(links)} links'}


def _urdf(source: Path, found: Corrections) -> tuple[bytes, dict[str, str]]:
    """Return a URDF with what was found, and where each number is."""
    text, said = XmlText(source.read_bytes()), dict[str, str]()
    joint = text.root.find('joint', name=found.joint)[0]
    for tag, names in _URDF.items():
        values = {attribute: f'{found.now[name]:.9g}' for name, attribute in names.items()
                  if name in found.changed}
        said |= {name: f'{tag} {attribute}' for name, attribute in names.items()}
        if own := [item for item in joint.children if item.tag == tag]:
            text.change(own[0], **values)
        elif values:
            written = ' '.join(f'{name}="{value}"' for name, value in values.items())
            text.insert(f'<{tag} {written}/>', joint.children[-1])
    links = joint.find('child')
    for link in links:  # which grows
        links += [item for other in text.root.find('joint') if other.find(
            'parent', link=link.attributes['link']) for item in other.find('child')]
    links = [text.root.find('link', name=link.attributes['link'])[0] for link in links]
    said |= _scale(text, links, found)
    return bytes(text), said
