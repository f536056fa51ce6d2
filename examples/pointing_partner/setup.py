# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Build and install pointing_partner, with colcon or pip."""

from setuptools import setup

PACKAGE = 'pointing_partner'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=[PACKAGE],
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=['antenna_drive'],
    zip_safe=True,
    maintainer='The antenna_drive authors',
    maintainer_email='maintainers@example.com',
    description="A pointing loop outside of antenna_drive's lock-step, in plain rclpy",
    license='Apache-2.0',
    entry_points={
        'console_scripts': [f'pointing = {PACKAGE}.pointing:main'],
    },
)
