# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A number that may differ from the model, and an effect: such numbers with one physical cause."""

from dataclasses import dataclass, field

# Sizes that may be tried out before a fit, as shares of the bounds.
_SHARES = (-0.9, -0.6, -0.4, -0.25, -0.15, -0.08, 0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 0.9)


@dataclass(frozen=True)
class Parameter:
    """
    A number in which the machine may differ from its model; zero is the model as configured.

    name : unique in its machine
    low, high : hard bounds in `unit`, with zero between them
    step : of the difference quotient, in the unit of the value
    prior_sigma : standard deviation of a Gaussian prior about zero; 0 for no prior
    experiment : index of the one experiment that it acts on; None for all
    start : where a fit begins
    is_shape : True for a shape parameter, which has no meaning while its effect is absent
    tolerance : size up to which the model's number may be off without being wrong
    label : key and value of the label of the tests that it acts on; None for all
    of : name of the number that it is added to in these tests; empty for none
    spread : standard deviation from day to day, in `unit`; 0 for a usual share of the prior's
    configured : what zero stands for, for people
    least_step : of the difference quotient where the prediction is a staircase; 0 for none
    """

    name: str
    unit: str
    low: float
    high: float
    step: float
    prior_sigma: float = 0.0
    experiment: int | None = None
    start: float = 0.0
    is_shape: bool = False
    tolerance: float = 0.0
    label: tuple[str, str] | None = field(default=None, kw_only=True)
    least_step: float = field(default=0.0, kw_only=True)
    of: str = field(default='', kw_only=True)
    spread: float = field(default=0.0, kw_only=True)
    configured: float = field(default=0.0, kw_only=True)


@dataclass(frozen=True)
class Form:
    """
    One mathematical form of an effect.

    parameters : those that are not shape parameters are zero where the effect is absent
    scanned : True if the form was chosen by a scan of many, such as the orders of a ripple
    is_wave : True if its two sizes are the sine and the cosine part of a wave
    """

    name: str
    parameters: tuple[Parameter, ...]
    scanned: bool = field(default=False, kw_only=True)
    is_wave: bool = field(default=False, kw_only=True)

    @property
    def sizes(self) -> list[Parameter]:
        """Return the parameters that vanish with the effect."""
        return [p for p in self.parameters if not p.is_shape]

    @property
    def start(self) -> dict[str, float]:
        """Return the point at which a fit of this form begins."""
        return {p.name: p.start for p in self.parameters}

    @property
    def shapes(self) -> dict[str, float]:
        """Return a point without the effect, at which derivatives by its sizes are taken."""
        return {p.name: p.start for p in self.parameters if p.is_shape}

    @property
    def trials(self) -> list[dict[str, float]]:
        """Return sizes to try of a single one, as shares of its bounds."""
        if len(self.sizes) != 1:
            return []
        [size] = self.sizes
        return [{size.name: share * (size.high if share > 0.0 else -size.low)}
                for share in _SHARES if share > 0.0 or size.low < 0.0]


@dataclass(frozen=True)
class Effect:
    """
    Something that the model may lack.

    id, component : 'component.effect', and the part of the machine that it sits in
    cause : its physical cause, one sentence
    forms : alternatives; the best one counts
    parts : ids of the effects that act together in it, each in its own place
    simpler : ids of the effects that it becomes at an end of its range
    """

    id: str  # noqa: A003: the word of the verdict's format
    component: str
    cause: str
    forms: tuple[Form, ...]
    parts: tuple[str, ...] = ()
    simpler: tuple[str, ...] = ()
