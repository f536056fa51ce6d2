# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Typed parameter sets, loaded from config/ and checked before anything is used."""

from antenna_drive.parameters.loading import load
from antenna_drive.parameters.sets import Drive
from simgap.inputs.schema import Entry, ParameterError

__all__ = ['Drive', 'Entry', 'load', 'ParameterError']
