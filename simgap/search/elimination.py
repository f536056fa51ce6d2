# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Stepwise selection: whether each effect of a hypothesis is needed, and whether another is."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
import math

from simgap.search.full_fits import FullFits
from simgap.search.hypothesis import Hypothesis
from simgap.settings import Settings
from simgap.verdict import verdict


def backward_elimination(fits: FullFits, hypotheses: Sequence[Hypothesis], settings: Settings,
                         ) -> tuple[list[Hypothesis], Hypothesis]:
    """
    Test each doubtful effect of the best hypothesis, until the best has none.

    One effect in all places is tried instead of itself in each, and so is a simpler effect that an
    effect becomes at an end of its range. Return the hypotheses in their order, the nuisances
    alone first, and the best of them, whose fit has converged.
    """
    found = {frozenset(h.effects): h for h in hypotheses}
    tried: set[frozenset[str]] = set()
    best = verdict.best(hypotheses, settings)
    converged = fits.converged(best)
    while True:
        rests = {effect: frozenset(best.effects) - {effect} for effect in best.effects}
        # A hypothesis that is far behind may have stopped early. Then the curvature tells that
        # the effect gains little.
        doubtful = {effect: rest for effect, rest in rests.items() if rest not in tried and min(
            found[rest].cost - best.cost if rest in found else math.inf,
            converged.loss_without(effect)) < settings.search.doubtful * best.cost}
        simplified = [fits.without(converged, effect) for effect in doubtful]
        tried.update(doubtful.values())
        for effect, other in fits.simpler(converged):
            if (key := rests[effect] | {other}) not in tried:
                tried.add(key)
                simplified.append(fits.exchanged(converged, effect, other))
        if (key := frozenset(best.effects)) not in tried and (whole := fits.joined(converged)):
            tried.add(key)
            simplified.append(whole)
        if not simplified:
            return list(found.values()), converged
        for simpler in simplified:
            # all other fits are taken to be as far from convergence as that of the best was
            behind = simpler.cost + best.cost - converged.cost
            rest = frozenset(simpler.effects)
            if rest not in found or behind < found[rest].cost:
                found[rest] = replace(simpler, state=replace(simpler.state, cost=behind))
        leading = verdict.best(list(found.values()), settings)
        if leading is not best:
            best, converged = leading, fits.converged(leading)


def converged_rivals(fits: FullFits, hypotheses: Sequence[Hypothesis], best: Hypothesis,
                     settings: Settings) -> tuple[list[Hypothesis], Hypothesis]:
    """
    Take fits close behind the best to their ends, too: only there can they be distinguished.

    Partners no larger than their tolerance are dropped from rivals and from the best. An effect in
    another place is a rival even where the search gave it up, because its own fit may have got
    stuck: it begins where the best has ended. Signature as `forward_selection`.
    """
    options, price = settings.search, settings.penalty
    found = {frozenset(h.effects): h for h in hypotheses}
    first = found[frozenset(best.effects)]
    behind = first.cost - best.cost
    size = len(best.effects)
    close = max(options.close, options.close_share * first.cost)
    rivals = [h for h in hypotheses if h is not first and len(h.effects) == size > 0
              and h.penalised(price) < first.penalised(price) + close]
    # a member that is no larger than its tolerance only helped the fit of the others along
    helped = [(h, effect) for h in hypotheses for effect in sorted(set(h.effects) - set(h.named))
              if len(h.effects) == size + 1 > 1 and h.cost < first.cost + close]
    ways: list[tuple[float, frozenset[str], Callable[[], Hypothesis]]] = [
        *((h.cost, frozenset(h.effects), partial(fits.converged, h)) for h in rivals),
        *((h.cost, frozenset(h.effects) - {effect}, partial(fits.without, h, effect))
          for h, effect in helped)]
    # several ways may lead to the same effects: only the nearest one is taken
    nearest: dict[frozenset[str], Callable[[], Hypothesis]] = {}
    for _, effects, taken in sorted(ways, key=lambda way: way[0]):
        nearest.setdefault(effects, taken)
    own = frozenset(best.effects)
    others = [effects for effects in nearest if effects != own][:options.rivals]
    ends = [nearest[effects] for effects in (own, *others) if effects in nearest]
    ends += [partial(fits.exchanged, best, effect, other)
             for effect, other in fits.elsewhere(best)
             if (there := found.get(own - {effect} | {other})) is None
             or there.cost < first.cost + close]
    for taken in ends:
        end = taken()
        rival = found.get(frozenset(end.effects))
        if rival is None or end.cost + behind < rival.cost:
            found[frozenset(end.effects)] = replace(
                end, state=replace(end.state.without_jacobian(keep_hessian=True),
                                   cost=end.cost + behind))
        if end.penalised(price) < best.penalised(price):
            best = end
    return list(found.values()), best


def forward_selection(fits: FullFits, hypotheses: Sequence[Hypothesis], best: Hypothesis,
                      settings: Settings) -> tuple[list[Hypothesis], Hypothesis]:
    """Add effects one after the other, until none is worth its price or only noise remains."""
    found = list(hypotheses)
    while (0 < len(best.effects) < settings.search.most_effects
           and (len(best.effects) > 1 or fits.leaves_much(best))):
        # the best as it has converged, so that it does not lose to fits that went further
        found = [best if set(h.effects) == set(best.effects) else h for h in found]
        more = fits.with_another(best)
        if not more:
            break
        found = fits.at_noise_of(min(more, key=lambda h: h.cost), [*found, *more])
        leading = verdict.best(found, settings)
        if len(leading.effects) <= len(best.effects):
            found = fits.at_noise_of(leading, found)
            best = next(h for h in found if set(h.effects) == set(best.effects))
            break
        best = fits.converged(leading)
    return found, best
