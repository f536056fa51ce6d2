# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a machine is made of, in one place for those who write one."""

from simgap.machine.arrays import Course, FloatArray, Point
from simgap.machine.catalogue import Catalogue
from simgap.machine.effect import Effect, Form, Parameter
from simgap.machine.experiment import Colour, Excerpt, Experiment
from simgap.machine.machine import DisturbanceInput, Learnable, Machine
from simgap.machine.motion import Motion, Regimes, TimeScales
from simgap.machine.nuisances import Nuisances

__all__ = ['Catalogue', 'Colour', 'Course', 'DisturbanceInput', 'Effect', 'Excerpt', 'Experiment',
           'FloatArray', 'Form', 'Learnable', 'Machine', 'Motion', 'Nuisances', 'Parameter',
           'Point', 'Regimes', 'TimeScales']
