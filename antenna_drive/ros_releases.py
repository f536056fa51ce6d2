# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The ROS 2 releases that are on PyPI as wheels: one table, and what is made of it.

A release that comes next is a row of RELEASES, and a row of docs/distributions.md once the
suite has passed on it. setup.py makes an extra of each row, and scripts/set-up installs one. This
file imports nothing, as setup.py runs it before anything is installed.
"""

# The wheels are for CPython 3.10 to 3.14 on x86-64 Linux, and for nothing else.
WHEELS_EXIST = "sys_platform == 'linux' and platform_machine == 'x86_64'"

# What the nodes need, with the middleware.
PACKAGES = ('ros-rclpy[fastrtps]', 'ros-std-msgs', 'ros-std-srvs', 'ros-rosgraph-msgs',
            'ros-diagnostic-msgs', 'ros-sensor-msgs')
# Of each release the first version of each of these packages. The wheels of one release fit each
# other alone (ros-rclpy pins its own to the patch), so each is held to its minor series.
RELEASES = {
    'jazzy': ('7.1.0', '5.3.0', '5.3.0', '2.0.0', '5.3.0', '5.3.0'),  # until 2029-05
    'kilted': ('9.1.0', '5.5.0', '5.5.0', '2.3.0', '5.5.0', '5.5.0'),  # until 2026-12
}
# The one that is maintained longest: the extra `ros`.
DEFAULT = 'jazzy'


def wheels(release: str = DEFAULT) -> tuple[str, ...]:
    """Return the wheels of a release, as pip asks for them."""
    return tuple(f'{package}~={version}'
                 for package, version in zip(PACKAGES, RELEASES[release], strict=True))


def extras() -> dict[str, list[str]]:
    """Return the extra of each release and that of the default; empty where no wheels exist."""
    return {name: [f'{wheel} ; {WHEELS_EXIST}' for wheel in wheels(release)]
            for name, release in {'ros': DEFAULT, **dict(zip(RELEASES, RELEASES))}.items()}


def release_of(rclpy_version: str) -> str | None:
    """Return the release whose wheels have this rclpy, None for any other rclpy."""
    series = rclpy_version.split('.')[:2]
    return next((release for release, (first, *_) in RELEASES.items()
                 if first.split('.')[:2] == series), None)
