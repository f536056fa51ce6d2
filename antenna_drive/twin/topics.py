# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Which topics of a real drive are which signals: the map of recordings, read for topics.

The entries are those of docs/recording.md, Maps for other files; `column` is a topic. A topic has
one number in each message (std_msgs/Float64) or, with `index`, several (Float64MultiArray). Only
`time` differs, because a message has no time column:

  time: {column: source}      when the sender gave the message to its middleware; the default
  time: {column: arrival}     when it arrived here
  time: {column: /acu/row, index: 0, unit: s}    a number in the same message

With the last one, all signals come from that topic.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from antenna_drive.readings import RATE_COMMAND, SIGNALS
from antenna_drive.recording.files import parse_map
from antenna_drive.twin.intake import known
from simgap.inputs.plain_yaml import read_yaml
from simgap.inputs.schema import ParameterError
from simgap.logs.channel import nanoseconds
from simgap.logs.column_map import ImportMap, ISO_8601, SignalMap, TIME_UNITS

SOURCE, ARRIVAL = 'source', 'arrival'


@dataclass(frozen=True)
class Topic:
    """A topic of the real drive."""

    name: str  # as the node subscribes to it
    vector: bool  # whether its messages have several numbers
    signals: Mapping[str, SignalMap]  # what is read from it, by signal


@dataclass(frozen=True)
class TopicMap:
    """The topics of a real drive, and how their messages are read."""

    topics: Sequence[Topic]  # to subscribe to
    clock: str = SOURCE  # SOURCE, ARRIVAL, or the topic that holds the time
    time_index: int = 0  # which of its numbers
    time_unit: int = 1  # nanoseconds in its unit
    offset_ns: int = 0  # added to every stamp [ns]

    @property
    def has_stamps_of_messages(self) -> bool:
        """Whether a stamp is that of a message, not a number that the sender gives."""
        return self.clock in (SOURCE, ARRIVAL)

    def read(self, topic: Topic, numbers: Sequence[float], source_ns: int,
             arrival_ns: int) -> list[tuple[str, int, float]]:
        """
        Return the samples in a message: signal, stamp [ns] and value in SI units.

        A number that is not there, or has no value, is NaN.

        topic : of the message
        numbers : in the message
        source_ns, arrival_ns : when it was sent and when it arrived [ns]
        """
        stamp = source_ns if self.clock == SOURCE else arrival_ns
        if not self.has_stamps_of_messages:
            time = numbers[self.time_index] if self.time_index < len(numbers) else math.nan
            if not math.isfinite(time) or abs(time * self.time_unit) >= 2**63:
                return []
            stamp = int(nanoseconds(time * self.time_unit / 1e9))
        return [(name, stamp + self.offset_ns + signal.clock_offset_ns, _value(signal, numbers))
                for name, signal in topic.signals.items()]


def _value(signal: SignalMap, numbers: Sequence[float]) -> float:
    """Return the value of a signal in SI units; NaN if the message has none."""
    try:
        number = signal.number.value([numbers[reference.index or 0]
                                      for reference in signal.number.references])
        if signal.sign_bit:
            number = signal.sign_bit - number if number >= signal.sign_bit else number
        return float(signal.factor * (signal.gain * number + signal.offset))
    except (ArithmeticError, ValueError, IndexError):
        return math.nan


def own_topics(real: str = '') -> TopicMap:
    """Return the map of a drive whose topics and units are our own, in a namespace."""
    prefix = real.rstrip('/') + '/' if real else ''
    names = (RATE_COMMAND, *SIGNALS)
    tree = {'time': {'column': SOURCE}, 'signals': {
        name: {'column': prefix + name} for name in names}}
    return _topics(parse_map(tree), SOURCE, 0)


def load_topics(path: str | Path) -> TopicMap:
    """Read a map of topics; ParameterError names the file, the key and what is allowed."""
    tree: Any = read_yaml(Path(path))
    try:
        if not isinstance(tree, dict):
            raise ParameterError('signals: none is given')
        time = tree.get('time', {'column': SOURCE})
        index = 0
        if isinstance(time, dict) and 'index' in time:
            index = time['index']
            if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < 10000:
                raise ParameterError('time.index: allowed is a whole number from 0 on')
            time = {key: value for key, value in time.items() if key != 'index'}
        parsed = parse_map({**tree, 'time': time})
        if parsed.time.unit == ISO_8601:
            raise ParameterError('time.unit: a number in a message is no text; allowed is one of '
                                 + ', '.join(TIME_UNITS))
        return _topics(parsed, str(parsed.time.column), index)
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None


def _topics(parsed: ImportMap, clock: str, index: int) -> TopicMap:
    found: dict[str, dict[str, SignalMap]] = {}
    vectors: dict[str, bool] = {}
    for name, signal in parsed.signals.items():
        if not known(name):
            raise ParameterError(f'signals.{name}: a twin compares {", ".join(SIGNALS)}, and '
                                 f'needs {RATE_COMMAND}')
        topics = {str(reference.column) for reference in signal.number.references}
        if len(topics) > 1:
            raise ParameterError(f'signals.{name}: the numbers of an expression have to come in '
                                 'one message, as column("topic")[0]')
        topic = topics.pop()
        vector = any(reference.index is not None for reference in signal.number.references)
        if vectors.setdefault(topic, vector) != vector:
            raise ParameterError(f'signals.{name}: {topic} has several numbers in a message; '
                                 'index says which of them')
        if clock not in (SOURCE, ARRIVAL) and topic != clock:
            raise ParameterError(f'signals.{name}: the time is in the messages of {clock}, so '
                                 'every signal has to come from there')
        found.setdefault(topic, {})[name] = signal
    if RATE_COMMAND not in parsed.signals:
        raise ParameterError(f'signals: {RATE_COMMAND} is missing, which the twin is driven with')
    if len(parsed.signals) < 2:
        raise ParameterError('signals: nothing to compare; a twin compares '
                             + ', '.join(SIGNALS))
    return TopicMap([Topic(topic, vectors[topic], signals) for topic, signals in found.items()],
                    clock, index, TIME_UNITS[parsed.time.unit], parsed.time.offset_ns)
