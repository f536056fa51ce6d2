# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The models of the joints' trial, and what the task says of days and loggers beside the sheet."""

from dataclasses import replace

from lab.joints.models import axis as axis_model, joint as joint_model
from simgap.model import free, Model, within


def _told(model: Model) -> Model:
    days = {'coulomb_share': within(1.0, 0.04), 'viscous_share': within(1.0, 0.1)}
    base = {name: number for name, number in model.base.items() if name not in days}
    return replace(model, base={**base, 'current_filter': free(0.0, 2e-3, 's')},
                   per_test={**model.per_test, **days})


joint, axis = _told(joint_model.machine), _told(axis_model.machine)
