# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The numbers that a simulation gets, by name: `numbers.inertia`."""

from collections.abc import Iterator, Mapping

from simgap.inputs.schema import nearest
from simgap.model.declared import ModelError


class Numbers(Mapping[str, float]):
    """Numbers of a simulation as attributes; `asked_for` has those it has read."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self._values = values
        self.asked_for: set[str] = set()

    def __getattr__(self, name: str) -> float:
        """Return a number. Raises ModelError if no entry of the model declares it."""
        if name.startswith('__'):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, name: str) -> float:
        self.asked_for.add(name)
        try:
            return self._values[name]
        except KeyError:
            raise ModelError(f'numbers.{name}: no entry of the model declares it'
                             f'{nearest(name, self._values)}') from None

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)
