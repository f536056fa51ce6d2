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
"""The numbers that a simulation gets, by name: `numbers.inertia`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from antenna_drive.machines.own.declaration import ModelError
from antenna_drive.parameters.schema import nearest


class Numbers(Mapping[str, float]):
    """
    Numbers of a simulation as attributes; it remembers which were asked for.

    Attributes
    ----------
    asked_for : names that the simulation has read

    """

    def __init__(self, values: Mapping[str, float]) -> None:
        """Take the values by name."""
        self._values = values
        self.asked_for: set[str] = set()

    def __getattr__(self, name: str) -> float:
        """
        Return a number.

        Raises
        ------
        ModelError : no entry of the model declares it

        """
        if name.startswith('__'):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, name: str) -> float:
        """Return a number; see `__getattr__`."""
        self.asked_for.add(name)
        try:
            return self._values[name]
        except KeyError:
            raise ModelError(f'numbers.{name}: no entry of the model declares it'
                             f'{nearest(name, self._values)}') from None

    def __contains__(self, name: object) -> bool:
        """Return whether there is a number of this name."""
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._values)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._values)
