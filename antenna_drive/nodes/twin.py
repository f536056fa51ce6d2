# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Watches a real drive beside its twin, and says when the two part.

The twin is the emulator, driven with the measured rate command in step with it. At first the drive
has to be healthy: the twin settles (15 s), learns its quiet record (five minutes), tunes itself to
it, and watches from then on.

  ros2 run antenna_drive twin                      a drive with our own topics
  ros2 run antenna_drive twin --ros-args -p real:=/elevation -p sheet:=my_sheet.yaml
  ros2 run antenna_drive twin --ros-args -p map:=my_topics.yaml -p quiet_file:=quiet.json

It publishes twin/<signal> and twin/residual/<signal> (Float64, SI units, article amperes), and in
/diagnostics: OK, a gap (which signals, since when, in their units and in standard deviations),
input that has stopped, or rubbish in the input. It goes on when the drive comes back.

real            namespace of the drive's topics, if their names are our own
map             YAML: topics, units, signs and time of another drive. docs/twin.md
config          configuration files or sets, as of the other nodes
sheet           a test sheet: circuit, bias, tolerances
alarms_per_day  false alarms that are allowed a day, 1 if not given
quiet           length of the quiet record, 300 s if not given
quiet_file      where the quiet record's figures are kept. If the file is there, it is used and
                nothing is learned; else it is written
tune            false: keep the configuration as it is
verdict         true: repeat the diagnosis on what there is, on twin/verdict (String, JSON), until
                it says 'decided'. A message on twin/begin_test (Empty) begins another test, while
                the drive stands still. The service twin/propose (Trigger) asks for the next test;
                some minutes later it is on twin/next_test (String, JSON)

Drives on other machines: ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET.
"""

from functools import partial
import sys

from antenna_drive.programs import run_program

main = partial(run_program, 'twin', __doc__, 'antenna_drive.nodes.twin_node')

if __name__ == '__main__':
    sys.exit(main())
