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
"""The drive with a position loop: six units, the motors fed by the loop's rate command."""

from pathlib import Path

from antenna_drive.emulator.wiring import DRIVE, Wired
from own_position_loop.physics import BLOCK

POINTED = DRIVE.plus(
    Path(__file__).with_name('position_loop.yaml'),
    position_loop=Wired(BLOCK, 'own_position_loop.node').fed(encoder='plant/encoder'),
    motor_1=DRIVE.units['motor_1'].fed(rate_command='position_loop/rate_command'),
    motor_2=DRIVE.units['motor_2'].fed(rate_command='position_loop/rate_command'))
