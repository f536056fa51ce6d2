# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Which peer's frames a node takes when."""

from antenna_drive.lockstep.exchange import BRIEF_WAIT_S
from antenna_drive.lockstep.member import Member
from antenna_drive.lockstep.ros_link import FrameLink


class Reception:
    """Takes frames of a member's peers from the link."""

    def __init__(self, link: FrameLink, member: Member, paced: bool) -> None:
        """Take frames for a member; `paced` says that a step may wait for the clock alone."""
        self._link = link
        self._member = member
        self._paced = paced

    def gather(self) -> bool:
        """
        Take a frame of each peer that the next step waits for.

        Returns False if a wait for something else is called for: one of them takes its time, or
        the next step waits for nobody but the clock.
        """
        member = self._member
        link = self._link
        missing = member.missing()
        # One peer at a time: a wait costs something for each that it looks at, and to be woken
        # by each in turn costs most.
        for peer in missing:
            frame = link.take(peer)
            if frame is None:
                link.wait_for(peer, BRIEF_WAIT_S)
                frame = link.take(peer)
                if frame is None:
                    return False
                if peer is not missing[0]:
                    # While the slowest is waited for, the frames of the others come.
                    member.inbox.put_first(peer)
            member.receive(peer, frame)
        return bool(missing) or not self._paced

    def take_some(self, peer: str) -> None:
        """
        Take all frames of an observer; those of a peer that steps up to the first not refused.

        For as long as frames come, the conductor begins no new run. One a turn would be too few:
        whoever speaks in a peer's name may send more than that, and an observer may have reported
        each of hundreds of steps.
        """
        member = self._member
        while (frame := self._link.take(peer)) is not None:
            refused = member.inbox.refused.total()
            member.receive(peer, frame)
            if peer in member.inbox.stepping and member.inbox.refused.total() == refused:
                break
