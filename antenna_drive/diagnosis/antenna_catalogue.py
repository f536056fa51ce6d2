# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue of the antenna's effects; the orders of its waves are found or named."""

from collections.abc import Iterable, Sequence

from antenna_drive.diagnosis.catalogue import DIGITS_SEEN
from antenna_drive.diagnosis.modifiers import KnownModifiers
from antenna_drive.diagnosis.waves import Wave
from antenna_drive.readings import AT
import numpy as np
from scipy.ndimage import median_filter
from simgap.machine.contract import Catalogue, Effect, Experiment, FloatArray, Form

# Numbers of cycles per revolution that are tried of each wave.
_ORDERS = 3
# Time within which the integral of a tachometer does not drift [s].
_WINDOW_S = 1.5
# Number of orders about one that say what is usual there.
_NEIGHBOURS = 9


class AntennaCatalogue(Catalogue):
    """
    The effects of the antenna drive, and the orders of its waves.

    What their parameters do is registered in `modifiers`, which grows as orders are chosen.
    `digits_seen` says whether the readings show digits that are coarser than the sheet says.
    """

    def __init__(self, effects: Iterable[Effect], modifiers: KnownModifiers,
                 digits_seen: bool) -> None:
        super().__init__(effects)
        self._modifiers, self._digits_seen = modifiers, digits_seen
        modifiers.register(p for effect in self.values() for form in effect.forms
                           for p in form.parameters)

    def forms(self, effect: Effect, experiments: Sequence[Experiment],
              residuals: Sequence[FloatArray]) -> Sequence[Form]:
        """Return an effect's forms; those of a wave with its likeliest orders."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return [self.wave_at(form, order) for order in likely_orders(
                form, experiments, residuals, _ORDERS)]
        return effect.forms

    def typical_form(self, effect: Effect) -> Form:
        """Return the first form of an effect; of a wave, one of a middle order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self.wave_at(form, form.orders[min(11, len(form.orders) - 1)])
        return form

    def form_named(self, effect: Effect, name: str) -> Form:
        """Return the form of an effect by its name; that of a wave says its order."""
        form = effect.forms[0]
        if isinstance(form, Wave):
            return self.wave_at(form, form.order_of(name))
        if name == DIGITS_SEEN and not self._digits_seen:
            return form  # a planned test has no readings to see digits in: it is rounded
        return super().form_named(effect, name)

    def counterpart(self, form: Form, effect: Effect, part: Effect) -> Form:
        if not isinstance(form, Wave):
            return part.forms[effect.forms.index(form)]
        wave = part.forms[0]
        assert isinstance(wave, Wave)
        return self.wave_at(wave, form.shape.order)

    def wave_at(self, form: Wave, order: float) -> Wave:
        """Return the form of a wave of one order, whose parameters then are known."""
        wave = form.at(order)
        self._modifiers.register(wave.parameters)
        return wave


def likely_orders(form: Wave, experiments: Sequence[Experiment],
                  residuals: Sequence[FloatArray], count: int) -> list[float]:
    """
    Return so many orders that stand out most in residuals, shape (n, c) for each test.

    The first stands out most from its neighbours, which a misfit without a period does not do.
    The second holds most of the energy. The others follow in turn.
    """
    orders = np.array(form.orders)
    energy = np.zeros(orders.size)
    peak = np.zeros(orders.size)
    for experiment, residual in zip(experiments, residuals, strict=True):
        scores = _scores(form, experiment, residual, orders)
        usual = median_filter(scores, _NEIGHBOURS, mode='nearest') + 1e-9
        energy += scores
        # a score is a sum of squares, whose scatter is its square root
        peak += np.maximum(scores - usual, 0.0) / np.sqrt(usual * max(1.0, float(usual.mean())))
    found: list[float] = []
    ranks = [list(np.argsort(by)[::-1]) for by in (peak, energy)]
    while len(found) < count and any(ranks):
        rank = ranks[len(found) % 2] or ranks[0]
        order = float(orders[rank.pop(0)])
        near = form.shape.angle == 'axis' and any(abs(np.log(order / f)) < 0.15 for f in found)
        if order not in found and not near:
            found.append(order)
    return found


def _scores(form: Wave, experiment: Experiment, residual: FloatArray,
            orders: FloatArray) -> FloatArray:
    """Return the power of a residual at each order, shape (m,)."""
    clean = np.nan_to_num(residual / experiment.noise)
    time = experiment.time
    score = np.zeros(orders.size)
    if form.shape.angle == 'axis':
        angle = np.nan_to_num(experiment.measured[:, AT['encoder']])
        if form.shape.stem == 'cyclic_error':
            return _power(clean[:, AT['encoder']], angle, orders)
        rate = np.gradient(angle, time)
        moving = np.abs(rate) > 0.1 * np.abs(rate).max()
        load = clean[:, AT['current_1']] + clean[:, AT['current_2']]
        return _power(load * np.sign(rate) * moving, angle, orders)
    windows = (time / _WINDOW_S).astype(int)
    for path in form.shape.paths:
        m = path.partition('.')[0][-1]
        rate = np.nan_to_num(experiment.measured[:, AT[f'tach_{m}']])
        angle = np.r_[0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))]
        for channel in (AT[f'current_{m}'], AT[f'tach_{m}']):
            for w in range(windows[-1] + 1):
                inside = windows == w
                if np.count_nonzero(inside) >= 10:
                    score += _power(clean[inside, channel], angle[inside], orders)
    return score


def _power(signal: FloatArray, angle: FloatArray, orders: FloatArray) -> FloatArray:
    """Return the power of a signal in waves of an angle, without their means, shape (m,)."""
    wave = np.exp(-1j * np.outer(orders, angle))
    wave -= wave.mean(axis=1, keepdims=True)
    power = np.sum(np.abs(wave) ** 2, axis=1) + 1e-3
    return np.asarray(np.abs(wave @ (signal - signal.mean())) ** 2 / power)
