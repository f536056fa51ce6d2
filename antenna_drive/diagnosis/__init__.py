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
The engine of the diagnosis: where a machine and its model part, why, and how far it can be mended.

This is its public face; machines import nothing else of it.
"""

from antenna_drive.diagnosis.by_label import ByLabel, without_labels
from antenna_drive.diagnosis.check import check_machine, idle_effects, MachineError
from antenna_drive.diagnosis.confusability import Confusability, confusability
from antenna_drive.diagnosis.design import (
    DesignEffort, Judged, objective_for, Proposal, TestDesign, TestSpace,
)
from antenna_drive.diagnosis.diagnosis import diagnose, Diagnosis, Progress
from antenna_drive.diagnosis.diagram import Diagram, DiagramBlock
from antenna_drive.diagnosis.evidence import Evidence
from antenna_drive.diagnosis.hypothesis import Hypothesis
from antenna_drive.diagnosis.least_squares import LeastSquares, with_initial_conditions
from antenna_drive.diagnosis.machine import (
    Colour, Course, DisturbanceInput, Effect, Experiment, FloatArray, Form, Machine, Parameter,
    Point, Regimes, TimeScales,
)
from antenna_drive.diagnosis.motion import Motion
from antenna_drive.diagnosis.proposal import as_data
from antenna_drive.diagnosis.ranking import rank_hypotheses, Ranking
from antenna_drive.diagnosis.rivals import Findings, Rival
from antenna_drive.diagnosis.settings import DEFAULT, Settings
from antenna_drive.diagnosis.unknown_input import courses

__all__ = [
    'as_data', 'ByLabel', 'check_machine', 'Colour', 'Confusability', 'confusability', 'Course',
    'courses', 'DEFAULT', 'DesignEffort', 'diagnose', 'Diagnosis', 'Diagram', 'DiagramBlock',
    'DisturbanceInput', 'Effect', 'Evidence', 'Experiment', 'Findings', 'FloatArray', 'Form',
    'Hypothesis', 'idle_effects', 'Judged', 'LeastSquares', 'Machine', 'MachineError', 'Motion',
    'objective_for', 'Parameter', 'Point', 'Progress', 'Proposal', 'rank_hypotheses', 'Ranking',
    'Regimes', 'Rival', 'Settings', 'TestDesign', 'TestSpace', 'TimeScales',
    'with_initial_conditions', 'without_labels',
]
