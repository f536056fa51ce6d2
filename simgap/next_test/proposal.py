# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What a proposal says: as plain data, as lines of text, and as what a page shows."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

import numpy as np
from simgap.next_test.candidate import Candidate, Proposal
from simgap.next_test.design import DesignEffort, SEPARATE
from simgap.next_test.rivals import known_to
from simgap.next_test.space import TestSpace
from simgap.report.curves import Panel
from simgap.search.rival import Rival
from simgap.settings import DEFAULT

_OTHERS, _SENSORS, _SIZES = 4, 3, 12
# A sensor tells two rivals apart if it reads better than this share of its own signal.
_READABLE = 0.02


def named(rival: Rival) -> str:
    """Return what a rival names, as people read it."""
    return ' + '.join(rival.named) or 'none'


def as_data(proposal: Proposal, space: TestSpace) -> dict[str, Any]:
    """Return a proposal as plain data, for the JSON."""
    rivals = proposal.rivals
    found: dict[str, Any] = {
        'objective': proposal.objective, 'criterion': proposal.criterion,
        'rivals': [{'effects': list(rival.named) or ['none'], 'probability': rival.probability}
                   for rival in rivals],
        'tried': proposal.tried, 'refused': dict(proposal.refused),
        'unnamed': dict(proposal.unnamed), 'limits': dict(space.limits),
        'helps': bool(proposal.tests), 'test': None}
    if proposal.tests:
        best = proposal.tests[0]
        found |= {'family': best.family, 'test': space.as_data(best.test),
                  'limits_used': dict(best.use), **_told(best, rivals)}
        found['others'] = [
            {'family': test.family, 'test': space.as_data(test.test), **_told(test, rivals)}
            for test in proposal.tests[1:1 + _OTHERS]]
    else:
        found['beyond_limits'] = [
            {'family': test.family, 'limit': test.tightest[0], 'share': test.tightest[1],
             **_told(test, rivals)} for test in proposal.beyond]
    found['not_told_apart'] = [
        {'rivals': [named(rivals[i]), named(rivals[j])],
         'sensors': [{'sensor': sensor, 'difference': share}
                     for sensor, share in list(unread.items())[:_SENSORS]
                     if share > _READABLE]} for i, j, unread in proposal.alike]
    return found


def _told(test: Candidate, rivals: Sequence[Rival]) -> dict[str, Any]:
    found: dict[str, Any] = {'score': test.score}
    if test.deviations:
        found['deviations'] = {name: {'before': before, 'after': after}
                               for name, (before, after) in test.deviations.items()}
    told, first = test.separation, test.promised
    if told is not None:
        sure = DEFAULT.planning.sure
        after = told.posterior()
        found['expected'] = {
            'confirmed': test.confirmed is not None,
            'right_before': float(told.prior @ told.prior),
            'right_after': told.expected(),
            'information_nat': told.information(),
            'surely': told.surely(sure), 'sure': sure,
            'each': [{'effects': list(rival.named) or ['none'], 'before': float(told.prior[i]),
                      'after_if_true': float(after[i, i]), 'after': after[i].tolist()}
                     for i, rival in enumerate(rivals)],
            'lack_of_fit': told.lack.tolist()}
        if first is not None:
            found['channels'] = dict(first.channels)
            found['expected']['promised'] = first.expected()
        found['sizes_over_least'] = test.coarseness
    elif test.sizes:
        found['smallest_sizes'] = {
            name: {'size': size if math.isfinite(size) else None, 'unit': unit}
            for name, (size, unit) in test.sizes.items()}
    return found


def lines(data: Mapping[str, Any]) -> list[str]:
    """Return what a proposal says as people read it, from its plain data."""
    found = []
    if not data['helps']:
        found += _nothing(data)
    else:
        limit, share = max(data['limits_used'].items(), key=lambda item: item[1])
        found.append(f'next test: {data["family"]}; it uses {100.0 * share:.0f} % of {limit}, '
                     'the nearest limit')
        found += _promises(data)
    found += [f'  no test of these kinds tells {" from ".join(item["rivals"])}'
              + (f'; a {item["sensors"][0]["sensor"]} would' if item['sensors'] else
                 '; no further sensor that the model knows would') for item in
              data['not_told_apart']]
    if data['refused']:
        found.append('  refused for a limit: ' + ', '.join(
            f'{count} of {data["tried"]} tests for {name}'
            for name, count in sorted(data['refused'].items(), key=lambda item: -item[1])))
    return found


def _nothing(data: Mapping[str, Any]) -> list[str]:
    """Say that no test helps, and which limit stands in the way."""
    found = ['no test within the limits helps']
    if data['beyond_limits']:
        best = data['beyond_limits'][0]
        found.append(f'  the limit that costs most is {best["limit"]}: a test '
                     f'({best["family"]}) that uses {100.0 * best["share"]:.0f} % of it would')
    elif data['objective'] == SEPARATE and len(data['rivals']) < 2:
        found.append('  there is one answer only, and nothing to tell apart; --objective sharpen '
                     'makes its numbers more certain')
    else:
        found.append('  nor does one beyond them, of those that were tried')
    return found


def _promises(data: Mapping[str, Any]) -> list[str]:
    found = []
    if 'expected' in data:
        expected = data['expected']
        how = ('each rival fitted to the others' if expected['confirmed'] else
               'to first order, not confirmed by fits')
        found.append(f'  if one of {len(expected["each"])} rivals is true, it is expected to get '
                     f'{100.0 * expected["right_after"]:.0f} % after it '
                     f'({100.0 * expected["right_before"]:.0f} % now; {how})')
        found.append(f'  the answer is then {100.0 * expected["sure"]:.0f} % sure or more with '
                     f'probability {expected["surely"]:.2f}')
        found += [f'  {100.0 * item["before"]:5.1f} % now, {100.0 * item["after_if_true"]:5.1f} % '
                  f'after if true: {" + ".join(item["effects"])}' for item in expected['each']]
        found.append('  if none of them is true: it shows other effects from '
                     f'{data["sizes_over_least"]:.1f} times the least size of all tests that were '
                     'judged (in the mean)')
    parts = sorted(data.get('unnamed', {}).items(), key=lambda item: -item[1])
    if parts:
        found.append('  what has no name yet may lie in ' + ', '.join(
            f'{part} ({100.0 * share:.0f} %)' for part, share in parts)
            + '; effects there count most')
    for name, item in list(data.get('deviations', {}).items())[:_SIZES]:
        found.append(f'  {name}: standard deviation {item["before"]:.3g} now, '
                     f'{item["after"]:.3g} after')
    sizes = sorted(data.get('smallest_sizes', {}).items(), key=lambda item: item[0])
    for name, item in sizes[:_SIZES]:
        found.append(f'  {name}: shows from ' + (
            'no size on' if item['size'] is None else f'{item["size"]:.3g} {item["unit"]}'))
    if len(sizes) > _SIZES:
        found.append(f'  and {len(sizes) - _SIZES} more, see the JSON')
    return found


def contents(proposal: Proposal, space: TestSpace) -> dict[str, Any]:
    """Return what the page about a proposal says: what proposal.html lists."""
    data = as_data(proposal, space)
    said = lines(data)
    if not data['helps']:
        return {'title': 'No test within the limits helps', 'lead': said[1].strip(),
                'data': data, 'panels': ()}
    lead = (f'Chosen among {proposal.tried} simulated tests. Every rival keeps '
            f'{100.0 * DesignEffort.margin:.0f} % of every limit in it.')
    return {'title': f'Next test: {data["family"]}', 'lead': lead, 'data': data,
            'panels': _panels(proposal, space)}


def _panels(proposal: Proposal, space: TestSpace) -> list[Panel]:
    machine = space.machine(proposal.tests[0].test)
    shown = sorted(proposal.rivals, key=lambda rival: -rival.probability)[:3]
    readings = machine.simulate([known_to(machine, rival) for rival in shown] or [{}])
    experiment = machine.experiments[0]
    command = space.command(proposal.tests[0].test)
    panels: list[Panel] = [] if command is None else [
        ('', 'command', command[2], [('command', *command[:2])])]
    for c, channel in enumerate(experiment.channels):
        curves = [(named(rival), experiment.time, np.asarray(values[0])[:, c])
                  for rival, values in zip(shown, readings, strict=True)
                  if values[0] is not None] if shown else [
            ('model', experiment.time, np.asarray(readings[0][0])[:, c])]
        panels.append(('', channel, experiment.units[c], curves))
    return panels
