# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Build and install own_position_loop, with colcon or pip."""

from setuptools import setup

PACKAGE = 'own_position_loop'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=[PACKAGE],
    package_data={PACKAGE: ['*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=['antenna_drive'],
    zip_safe=False,
    maintainer='The antenna_drive authors',
    maintainer_email='maintainers@example.com',
    description='A position loop as a sixth unit of antenna_drive',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [f'position_loop = {PACKAGE}.node:main'],
    },
)
