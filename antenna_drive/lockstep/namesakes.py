# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A second node of the same name, as the graph shows it."""

import os

from rclpy.node import Node

# Fast DDS takes a process for gone that it has not heard of for so long (the lease duration).
LEASE_S = 20.0


def namesake(node: Node) -> str:
    """Say that another node has the node's name, and what to do; '' if none is known of."""
    own = node.get_name(), node.get_namespace()
    if sum(item == own for item in node.get_node_names_and_namespaces()) < 2:
        return ''
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return (f'another node is called {node.get_fully_qualified_name()} in ROS domain {domain}: '
            'end one of the two, or give each drive a namespace (-r __ns:=/east) or a domain '
            f'(ROS_DOMAIN_ID); a node that was killed is forgotten after {LEASE_S:.0f} s')
