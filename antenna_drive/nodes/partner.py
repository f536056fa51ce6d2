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
"""
Stands in the lock-step for a partner that does not wait: a controller or an amplifier of yours.

  ros2 run antenna_drive partner --ros-args -r __node:=test_signal
      -p "partner.reads:=[plant/encoder]" -p partner.deadline:=0.05 -p partner.on_miss:=zero

The node takes the place of the unit whose name it has. It tells the partner what it reads on
<node>/partner_inputs, and puts out the partner's last answer from <node>/answer. In the place of
test_signal it owns the run and has its run.* parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
import sys

from antenna_drive.lockstep.entry import run_partner


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run_partner(args, __doc__)


if __name__ == '__main__':
    sys.exit(main())
