# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Damaged versions of a file: bytes changed anywhere, and plain data changed at one place."""

from collections.abc import Callable, Iterator
import copy
import json
import random
from typing import Any

# what tends to hurt readers of text
POISON = [b'\x00', b'\xff', b'"', b"'", b',', b'\n', b'\r', b'nan', b'inf', b'1e999', b'-', b'{',
          b'}', b'[', b']', b':', b'&a ', b'*a', b'!!python/name:os.system ', b'\xef\xbb\xbf',
          b'9' * 400, b'2026-99-99', b'0x1', b'1_000', b'\t', b'#', b'%', b'? ', b'- ', b'|\n',
          '\u0661\u2028\x85'.encode(), b'\xed\xa0\x80', b'12:30:45', b'<<: ', b'~', b'.e', b'=',
          b'[' * 3000, b'{"a":' * 3000, b'9' * 5000, b'1e-400', b'1' + b'0' * 310, b'\\ud800']
# what tends to hurt whoever uses plain data
LEAVES: list[Any] = [
    None, True, False, 0, -1, 1, 2**31, 2**63, 2**64, 10**30, 10**400, -10**400, 0.5, -0.5,
    1e308, 5e-324, float('nan'), float('inf'), '', 'x', '1', 'nan', 'a/b', '../..', '\x00',
    '\n', '\ud800', 'x' * 100_000, [], {}, [[]], [None], {'': 0}, [1, 2, 3], ['a'],
    list(range(1000)), {'value': 1}, {'a': {'b': {}}}]
# nested more deeply than Python recurses; text, as no tree can be written so deep
DEEP = b'[' * 100_000


def mutations(content: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Yield damaged versions: cut, flipped, zeroed, doubled, left out, inserted, or shuffled."""
    rng = random.Random(seed)
    for _ in range(count):
        data = bytearray(content)
        for _ in range(rng.choice([1, 1, 1, 2, 5])):
            place = rng.randrange(len(data) + 1)
            length = min(rng.choice([1, 1, 4, 8, 43, 400]), len(data) - place)
            kind = rng.randrange(7)
            if kind == 0:
                del data[place:]
            elif kind == 1 and length:
                data[rng.randrange(place, place + length)] ^= 1 << rng.randrange(8)
            elif kind == 2:
                data[place:place + length] = bytes(length)
            elif kind == 3:
                data[place:place] = data[place:place + length]
            elif kind == 4:
                del data[place:place + length]
            elif kind == 5:
                data[place:place + length] = rng.randbytes(length)
            else:
                data[place:place] = rng.choice(POISON)
            if not data:
                break
        if bytes(data) != content:
            yield bytes(data)


def tree_mutations(tree: Any, write: Callable[[Any], bytes], count: int, seed: int,
                   ) -> Iterator[bytes]:
    """
    Yield the text of mappings, lists and scalars in which one to three places are changed.

    `count` texts are tried; those that `write` refuses are left out.
    """
    rng = random.Random(seed)
    for _ in range(count):
        changed = [copy.deepcopy(tree)]
        for _ in range(rng.choice([1, 1, 2, 3])):
            holder, key = rng.choice(list(_places(changed)))
            kind = rng.randrange(8)
            if kind < 5:
                holder[key] = copy.deepcopy(rng.choice(LEAVES))
            elif kind == 5 and holder is not changed:
                del holder[key]
            elif kind == 6 and isinstance(holder, dict):
                holder[rng.choice(['', 'x', 'value', '__class__', 'x' * 5000])] = holder[key]
            elif kind == 7:
                holder[key] = [holder[key], copy.deepcopy(holder[key])]
        try:
            yield write(changed[0])
        except (ValueError, UnicodeEncodeError):
            continue


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in list(items):
        yield tree, key
        if isinstance(value, (dict, list)):
            yield from _places(value)


def as_json(tree: Any) -> bytes:
    """Return the text of plain data as JSON, with NaN and infinities as Python writes them."""
    return json.dumps(tree).encode()


def as_yaml(tree: Any) -> bytes:
    """Return the text of plain data as YAML."""
    import yaml
    return yaml.safe_dump(tree).encode()
