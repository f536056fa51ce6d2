# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Currents in real amperes, as a clamp meter shows them, beside those in article amperes."""

from collections.abc import Iterable
from dataclasses import replace

from antenna_drive.recording.recording import Recording
from simgap.logs.channel import Channel, RecordingError

ARTICLE, REAL = 'article A', 'real A'


def real_amperes(recording: Recording) -> float | None:
    """Return how many real amperes one article ampere is, None if the recording tells nothing."""
    for motor in ('motor_1', 'motor_2'):
        try:
            ratio = recording.configuration[motor]['armature.physical_amperes_per_article_ampere']
        except (KeyError, TypeError):
            continue
        if isinstance(ratio, float):
            return ratio
    return None


def with_real_amperes(recording: Recording, names: Iterable[str]) -> Recording:
    """
    Return the signals of these names, and each current among them once more in real amperes.

    A current `motor_1/current` is followed by `motor_1/real_current`.

    Raises RecordingError: the recording does not tell how many real amperes an article ampere is,
    or there is no current.
    """
    kappa = real_amperes(recording)
    if kappa is None:
        raise RecordingError('the recording does not tell how many real amperes an article '
                             'ampere is: it has no configuration; one of antenna-drive record '
                             'has')
    channels = {}
    for name in names:
        channel = channels[name] = recording[name]
        if channel.unit == ARTICLE:
            unit, _, signal = name.partition('/')
            channels[f'{unit}/real_{signal}'] = Channel(
                REAL, channel.time_ns, kappa * channel.values)
    if not any(channel.unit == REAL for channel in channels.values()):
        raise RecordingError('there is no current among the signals')
    return replace(recording, channels=channels)
