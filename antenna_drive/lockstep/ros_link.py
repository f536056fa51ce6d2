# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
How frames travel over ROS 2: the only file that goes below rclpy's public interface.

An executor builds a wait set, a task and a message object for every frame, several times the
cost of a step. Here one wait set lives as long as the node, frames are taken as bytes, and
nobody but the lock-step thread ever touches them.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from antenna_drive.lockstep.frame import FrameLayout, read_foreign
from antenna_drive.lockstep.member import BRIEF_WAIT_S, Member, MEMORY
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64MultiArray


def remembered(depth: int) -> QoSProfile:
    """Return the quality of service with which a late subscriber gets the last messages too."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)


# One second of frames at 1 kHz, frame 0 for a late subscriber.
FRAME_QOS = remembered(MEMORY)
# Fast DDS sorts what waits to be taken by the time of its sender's clock and drops the oldest. If
# that clock was set back, the newest frame is the oldest to a reader that is full of what a sender
# remembers. A reader has room for all of that and as much again.
READ_QOS = remembered(2 * MEMORY)


class NotForExecutors(ReentrantCallbackGroup):  # type: ignore[misc]
    """The group of the subscriptions that no executor may serve."""

    def can_execute(self, entity: Any) -> bool:
        return False


def unserved(node: Node, kind: Any, topic: str, qos: QoSProfile, raw: bool = False) -> Any:
    """Return a subscription whose messages are taken when they are asked for."""
    return node.create_subscription(kind, topic, lambda message: None, qos, raw=raw,
                                    callback_group=NotForExecutors())


class FrameLink:
    """A node's frames out, its peers' frames in, and the wait in between."""

    def __init__(self, node: Node, layouts: Mapping[str, FrameLayout]) -> None:
        """Publish `<node>/frame` and subscribe to `<peer>/frame` of each peer in `layouts`."""
        self._layouts = dict(layouts)
        self._publisher = node.create_publisher(
            Float64MultiArray, f'{node.get_name()}/frame', FRAME_QOS)
        self._subscriptions = {
            peer: unserved(node, Float64MultiArray, f'{peer}/frame', READ_QOS, raw=True)
            for peer in self._layouts}
        self._handles = {peer: item.handle for peer, item in self._subscriptions.items()}
        self._guard = node.create_guard_condition(lambda: None, callback_group=NotForExecutors())
        self._guard_handle = self._guard.handle
        context = node.context.handle
        assert context is not None
        self._wait_set = _rclpy.WaitSet(len(self._handles), 1, 0, 0, 0, 0, context)
        self.publish = self._publisher.handle.publish_raw

    def take(self, peer: str) -> tuple[float, ...] | None:
        """
        Take the oldest frame of a peer that has not been taken.

        Returns its numbers, none at all if the message cannot be read; None if there is no
        message.
        """
        taken = self._handles[peer].take_message(Float64MultiArray, True)
        if taken is None:
            return None
        message: bytes = taken[0]
        frame = self._layouts[peer].decode(message)
        return read_foreign(message) if frame is None else frame

    def wait_for(self, peer: str, timeout_s: float) -> None:
        """Sleep until a frame of this peer is there or time is up."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        wait_set.add_subscription(self._handles[peer])
        wait_set.wait(int(timeout_s * 1e9))

    def wait(self, peers: Sequence[str], timeout_s: float) -> list[str]:
        """Sleep until a frame comes, `wake` is called or time is up; return whose have come."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        for peer in peers:
            wait_set.add_subscription(self._handles[peer])
        wait_set.add_guard_condition(self._guard_handle)
        wait_set.wait(max(0, int(timeout_s * 1e9)))
        return [peer for index, peer in enumerate(peers)
                if wait_set.is_ready('subscription', index)]

    def await_delivery(self, patience_s: float) -> None:
        """
        Wait until all who listen have received what was published, for `patience_s` [s] at most.

        A node that leaves has to wait: Fast DDS forgets a writer that says goodbye, and what it
        has sent and nobody has taken yet is lost.
        """
        # RuntimeError: this middleware has no acknowledgements
        with suppress(RuntimeError):
            self._publisher.wait_for_all_acked(Duration(seconds=patience_s))

    def wake(self) -> None:
        """End a wait, from any thread."""
        self._guard.trigger()

    def handles(self) -> tuple[Any, Any, dict[str, Any]]:
        """Return rclpy's handles of publisher, guard condition and subscriptions by peer."""
        return self._publisher.handle, self._guard_handle, self._handles

    def publishers(self) -> dict[str, int]:
        """Return how many publishers each peer's frame topic has."""
        return {peer: item.get_publisher_count() for peer, item in self._subscriptions.items()}


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
            if peer not in member.inbox.stepping:
                self.take_some(peer)
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
