# Copyright 2026 The antenna_drive authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
