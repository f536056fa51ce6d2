# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Stands in the lock-step for a partner that does not wait: a controller or an amplifier of yours.

  ros2 run antenna_drive partner --ros-args -r __node:=test_signal
      -p "partner.reads:=[plant/encoder]" -p partner.deadline:=0.05 -p partner.on_miss:=zero

The node takes the place of the unit whose name it has. It tells the partner what it reads on
<node>/partner_inputs, and puts out the partner's last answer from <node>/answer. In the place of
test_signal it owns the run and has its run.* parameters.
"""

from functools import partial
import sys

from antenna_drive.lockstep.entry import run_partner

main = partial(run_partner, description=__doc__)

if __name__ == '__main__':
    sys.exit(main())
