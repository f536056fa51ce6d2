# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Records a running drive to a bag: every lock-step sample of every signal, nothing lost.

It may come and go while the drive runs, and the drive does not wait for it: enough at real-time
pace. At full speed, start test_signal with `-p run.observers:=[recorder]`: then no step is made
before the recorder has the last.

  ros2 run antenna_drive recorder --ros-args -p out:=my_run -p sheet:=my_sheet.yaml

out    folder to write, not there yet; recording_DATE_TIME if not given. A drive that begins a
       new run gets a new folder, my_run_run_2 and so on.
sheet  a test sheet, which goes into the bag.
sync   after how many seconds the disk is made to hold what was written; if not given, at the end
       of each storage file.
split  after how many seconds the next storage file begins; 600 if not given, 0 for one file.

Ctrl-C completes the bag. A recorder that is killed loses the last half second at most; where the
power fails, what was written since the last sync may be lost.
"""

from functools import partial
import sys

from antenna_drive.programs import run_program

main = partial(run_program, 'recorder', __doc__, 'antenna_drive.nodes.recorder_node')

if __name__ == '__main__':
    sys.exit(main())
