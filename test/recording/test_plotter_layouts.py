# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The layouts for PlotJuggler and Foxglove show topics that the drive has, in the right panels."""

from __future__ import annotations

from collections.abc import Iterator
import json
from typing import Any
from xml.etree import ElementTree

from antenna_drive.emulator.wiring import DRIVE
from antenna_drive.parameters.files import config_dir
from antenna_drive.recording.recording import unit_of

MUST_SEE = {f'/{name}' for name in (
    'test_signal/rate_command', 'motor_1/current', 'motor_2/current', 'motor_1/tach_rate',
    'motor_2/tach_rate', 'motor_1/gear_torque', 'motor_2/gear_torque', 'plant/axis_rate',
    'plant/encoder', 'torque_share/bias_voltage', 'torque_share/counter_torque')}
TOPICS = {f'/{name}' for name in DRIVE.signals}


def check(panels: list[tuple[str, list[str]]]) -> None:
    shown = [topic for _, topics in panels for topic in topics]
    assert set(shown) <= TOPICS
    assert set(shown) >= MUST_SEE
    assert len(shown) == len(set(shown))
    for title, topics in panels:
        # curves of one panel share its unit, which the title names
        named = title.partition('[')[2].rstrip(']')
        assert {unit_of(topic.lstrip('/')) for topic in topics} == {named}


def test_plotjuggler() -> None:
    root = ElementTree.parse(config_dir() / 'plotjuggler.xml').getroot()
    panels = []
    for area in root.iter('DockArea'):
        names = [str(curve.get('name')) for curve in area.iter('curve')]
        assert all(name.endswith('/data') for name in names)
        panels.append((str(area.get('name')), [n.removesuffix('/data') for n in names]))
    check(panels)
    for splitter in root.iter('DockSplitter'):
        assert len(splitter) == int(str(splitter.get('count')))
        assert len(str(splitter.get('sizes')).split(';')) == len(splitter)
    selected = root.find('.//selected_topics')
    assert selected is not None
    assert str(selected.get('value')).split(';') == [t for _, topics in panels for t in topics]


def test_plotjuggler_4() -> None:
    """The panels and colours of version 3, with topic and field of each curve, and no source."""
    old, new = (ElementTree.parse(config_dir() / name).getroot()
                for name in ('plotjuggler.xml', 'plotjuggler.pj4.xml'))
    assert new.attrib == {'pj4_version': '4', 'binding': 'generic'}
    assert {element.tag for element in new} == {'tabbed_widget'}

    def shown(root: ElementTree.Element) -> list[tuple[str, list[tuple[str, str]]]]:
        return [(str(area.get('name')), [(
            curve.get('name') or f'{curve.get("topic")}{curve.get("field")}',
            str(curve.get('color'))) for curve in area.iter('curve')])
            for area in root.iter('DockArea')]

    assert shown(new) == shown(old)
    for tag in ('Tab', 'DockArea', 'plot'):
        names = [element.get('id') for element in new.iter(tag)]
        assert names and None not in names and len(names) == len(set(names))
    assert {curve.get('field') for curve in new.iter('curve')} == {'/data'}
    assert [splitter.attrib for splitter in new.iter('DockSplitter')] == [
        splitter.attrib for splitter in old.iter('DockSplitter')]


def leaves(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        yield from leaves(layout['first'])
        yield from leaves(layout['second'])


def test_foxglove() -> None:
    layout = json.loads((config_dir() / 'foxglove.json').read_text())
    assert sorted(leaves(layout['layout'])) == sorted(layout['configById'])
    panels = []
    for name, panel in layout['configById'].items():
        if not name.startswith('Plot!'):
            continue
        assert all(path['value'].endswith('.data') for path in panel['paths'])
        panels.append((panel['title'], [p['value'].removesuffix('.data') for p in panel['paths']]))
        # the drive's topics carry no stamp of their own: the log time is simulated time
        assert {path['timestampMethod'] for path in panel['paths']} == {'receiveTime'}
    check(panels)
