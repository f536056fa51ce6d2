# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""XML as text: what is not changed stays as it was written, with its order and its comments."""

from collections.abc import Mapping
from dataclasses import dataclass, field
import re
from xml.parsers.expat import ParserCreate

_HEAD = re.compile(rb'<(?:"[^"]*"|\'[^\']*\'|[^"\'>])*>')
_REMARK = re.compile(rb'[ \t]*<!--[^\n]*?-->(?=[ \t]*\r?\n)')


@dataclass(eq=False)
class Element:
    tag: str
    attributes: Mapping[str, str]
    start: int  # byte at which it begins
    opened: int  # behind its start tag
    end: int = 0  # behind the whole of it
    children: list['Element'] = field(default_factory=list)

    def find(self, tag: str, **attributes: str) -> list['Element']:
        """Return it and what is in it, in the order of the text, with a tag and attributes."""
        own = self.tag == tag and attributes.items() <= self.attributes.items()
        return [self] * own + [item for child in self.children
                               for item in child.find(tag, **attributes)]


class XmlText:
    """The bytes of an XML file, and changes of it; ExpatError if it is none."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._inserted: list[tuple[int, int, bytes]] = []
        self._set: dict[Element, dict[str, str]] = {}
        parser, stack = ParserCreate(), [Element('', {}, 0, 0)]

        def begin(tag: str, attributes: dict[str, str]) -> None:
            head = _HEAD.match(data, start := parser.CurrentByteIndex)
            stack[-1].children.append(Element(tag, attributes, start, head.end() if head else 0))
            stack.append(stack[-1].children[-1])

        def end(tag: str) -> None:
            item = stack.pop()
            is_empty = data.endswith(b'/>', item.start, item.opened)
            item.end = item.opened if is_empty else data.index(b'>', parser.CurrentByteIndex) + 1

        parser.StartElementHandler, parser.EndElementHandler = begin, end
        parser.Parse(data, True)
        self.root = stack[0].children[0]

    def change(self, item: Element, **attributes: str) -> None:
        self._set.setdefault(item, {}).update(attributes)

    def insert(self, text: str, item: Element) -> None:
        """Insert a line behind an element, indented alike."""
        line = self._data[self._data.rfind(b'\n', 0, item.start) + 1:item.start]
        space = line[:len(line) - len(line.lstrip())]
        at = remark.end() if (remark := _REMARK.match(self._data, item.end)) else item.end
        self._inserted.append((at, at, b'\n' + space + text.encode()))

    def __bytes__(self) -> bytes:
        """Return the changed text."""
        found, changes = self._data, self._inserted + [
            (item.start, item.opened, _headed(self._data[item.start:item.opened], values))
            for item, values in self._set.items()]
        for start, end, text in sorted(changes, reverse=True):
            found = found[:start] + text + found[end:]
        return found


def _headed(head: bytes, attributes: Mapping[str, str]) -> bytes:
    for name, value in attributes.items():
        written = f'{name}="{value}"'.encode()
        head, count = re.subn(rb'(?<=\s)' + name.encode() + rb'\s*=\s*("[^"]*"|\'[^\']*\')',
                              lambda _: written, head)
        if not count:
            head = re.sub(rb'\s*/?>$', lambda found: b' ' + written + found[0], head)
    return head
