# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Build and install own_torque_share, with colcon or pip."""

from setuptools import setup

PACKAGE = 'own_torque_share'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=[PACKAGE],
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=['antenna_drive', 'numpy'],
    zip_safe=True,
    maintainer='The antenna_drive authors',
    maintainer_email='maintainers@example.com',
    description="A torque share of one's own that takes the place of antenna_drive's",
    license='Apache-2.0',
    entry_points={
        'console_scripts': [f'constant_bias = {PACKAGE}.constant_bias:main'],
    },
)
