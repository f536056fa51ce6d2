# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Where a drive runs, so that it meets no other one.

Nodes of the same name in the same namespace and domain hear each other, and everybody's domain is
0 unless they say otherwise. Who starts a drive that nobody else has to find gives it a namespace
of its own. A namespace that was asked for must be free: no drive of this machine that was started
by us holds it, which cannot be missed, and no nodes of these names are seen. What this leaves
undiscovered, nodes that somebody starts later or on another machine, the frames tell by their
senders.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import os
import secrets
import time

from antenna_drive.emulator.wiring import UNITS
from antenna_drive.lockstep.entry import own_node
from antenna_drive.lockstep.leaving import held, leave
from rclpy.node import Node
from simgap.errors import UserError

# For how long to look for nodes [s]; they find each other in a tenth of it.
_LOOK_S = 1.0
_GLANCE_S = 0.05


class AnotherDrive(UserError):
    """Another drive has the names of this one, or took part in it."""

    status = 1


@contextmanager
def drive_namespace(given: str | None, command: str) -> Iterator[str]:
    """
    Give a drive its namespace, as long as it runs.

    given : the namespace that was asked for, '' or '/' for none; None for one of the drive's own
    command : what the drive is started for; a namespace of its own begins with it

    Yields the namespace, '/east', or '' for none.

    Raises AnotherDrive: the namespace is not free.
    Raises UserError: it is no name of a namespace.
    """
    if given is None:
        yield f'/{command}_{secrets.token_hex(4)}'
        return
    namespace = f'/{given.strip("/")}'.rstrip('/')
    try:
        node = own_node(f'look_{os.getpid()}', namespace)
    except ValueError as error:  # rclpy names what is wrong with it
        raise UserError(f'--namespace {given}: {error}') from error
    domain = node.context.get_domain_id()
    with held(f'antenna_drive/drive/{domain}{namespace}') as free:
        try:
            found = _seen(node, namespace) if free else list(UNITS)
        finally:
            leave(node)
        if found:
            raise AnotherDrive(
                f'a drive runs already in namespace {namespace or "/"} of ROS domain {domain} '
                f'({", ".join(found)}); end it, or choose another with --namespace')
        yield namespace


def _seen(node: Node, namespace: str) -> list[str]:
    """Return the units of the drive whose names nodes have in a namespace."""
    deadline = time.monotonic() + _LOOK_S
    while True:
        there = set(node.get_node_names_and_namespaces())
        found = [unit for unit in UNITS if (unit, namespace or '/') in there]
        if found or time.monotonic() > deadline:
            return found
        time.sleep(_GLANCE_S)
