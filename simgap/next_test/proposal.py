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
    told = [{'family': test.family, 'test': space.as_data(test.test), **_told(test, rivals)}
            for test in proposal.tests[:1 + _OTHERS]]
    if told:
        found |= {**told[0], 'limits_used': dict(proposal.tests[0].use), 'others': told[1:]}
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
    if (told := test.separation) is not None:
        sure, after = DEFAULT.planning.sure, told.posterior()
        found['expected'] = {
            'confirmed': True, 'right_before': float(told.prior @ told.prior),
            'right_after': told.expected(), 'information_nat': told.information(),
            'surely': told.surely(sure), 'sure': sure,
            'each': [{'effects': list(rival.named) or ['none'], 'before': float(told.prior[i]),
                      'after_if_true': float(after[i, i]), 'after': after[i].tolist()}
                     for i, rival in enumerate(rivals)],
            'lack_of_fit': told.lack.tolist()}
        found |= {'channels': dict(told.channels), 'sizes_over_least': test.coarseness}
    elif test.sizes:
        found['smallest_sizes'] = {
            name: {'size': size if math.isfinite(size) else None, 'unit': unit}
            for name, (size, unit) in test.sizes.items()}
    return found


def lines(data: Mapping[str, Any]) -> list[str]:
    """Return what a proposal says as people read it, from its plain data."""
    if data['helps']:
        limit, share = max(data['limits_used'].items(), key=lambda item: item[1])
        found = [f'next test: {data["family"]}; it uses {100.0 * share:.0f} % of {limit}, '
                 'the nearest limit', *_promises(data)]
    else:
        found = ['no test within the limits helps', _why_none(data)]
    found += [f'  no test of these kinds tells {" from ".join(item["rivals"])}'
              + (f'; a {item["sensors"][0]["sensor"]} would' if item['sensors'] else
                 '; no further sensor that the model knows would') for item in
              data['not_told_apart']]
    if data['refused']:
        found.append('  refused for a limit: ' + ', '.join(
            f'{count} of {data["tried"]} tests for {name}'
            for name, count in sorted(data['refused'].items(), key=lambda item: -item[1])))
    return found


def _why_none(data: Mapping[str, Any]) -> str:
    """Say which limit stands in the way of a test."""
    if data['beyond_limits']:
        best = data['beyond_limits'][0]
        return (f'  the limit that costs most is {best["limit"]}: a test '
                f'({best["family"]}) that uses {100.0 * best["share"]:.0f} % of it would')
    if data['objective'] == SEPARATE and len(data['rivals']) < 2:
        return '  there is one answer only, and nothing to tell apart'
    return '  nor does one beyond them, of those that were tried'


def _promises(data: Mapping[str, Any]) -> list[str]:
    found = []
    if expected := data.get('expected'):
        found += [
            f'  if one of {len(expected["each"])} rivals is true, it is expected to get '
            f'{100.0 * expected["right_after"]:.0f} % after it '
            f'({100.0 * expected["right_before"]:.0f} % now; each rival fitted to the others)',
            f'  the answer is then {100.0 * expected["sure"]:.0f} % sure or more with '
            f'probability {expected["surely"]:.2f}',
            *(f'  {100.0 * item["before"]:5.1f} % now, {100.0 * item["after_if_true"]:5.1f} % '
              f'after if true: {" + ".join(item["effects"])}' for item in expected['each']),
            f'  if none of them is true: it shows other effects from '
            f'{data["sizes_over_least"]:.1f} times the least size of all tests that were judged '
            '(in the mean)']
    if parts := sorted(data.get('unnamed', {}).items(), key=lambda item: -item[1]):
        found.append('  what has no name yet may lie in ' + ', '.join(
            f'{part} ({100.0 * share:.0f} %)' for part, share in parts)
            + '; effects there count most')
    sizes = sorted(data.get('smallest_sizes', {}).items())
    found += [f'  {name}: shows from ' + (
        'no size on' if item['size'] is None else f'{item["size"]:.3g} {item["unit"]}')
        for name, item in sizes[:_SIZES]]
    return found + ([f'  and {len(sizes) - _SIZES} more, see the JSON']
                    if len(sizes) > _SIZES else [])


def contents(proposal: Proposal, space: TestSpace) -> dict[str, Any]:
    """Return what the page about a proposal says: what proposal.html lists."""
    data = as_data(proposal, space)
    if not data['helps']:
        return {'title': 'No test within the limits helps', 'lead': lines(data)[1].strip(),
                'data': data, 'panels': ()}
    lead = (f'Chosen among {proposal.tried} simulated tests. Every rival keeps '
            f'{100.0 * DesignEffort.margin:.0f} % of every limit in it.')
    return {'title': f'Next test: {data["family"]}', 'lead': lead, 'data': data,
            'panels': _panels(proposal, space)}


def _panels(proposal: Proposal, space: TestSpace) -> list[Panel]:
    test = proposal.tests[0].test
    machine, command = space.machine(test), space.command(test)
    [experiment] = machine.experiments
    likeliest = sorted(proposal.rivals, key=lambda rival: -rival.probability)[:3]
    readings = {named(rival): machine.predict(known_to(machine, rival), 0)
                for rival in likeliest} or {'model': machine.predict({}, 0)}
    panels: list[Panel] = [] if command is None else [
        ('', 'command', command[2], [('command', *command[:2])])]
    return panels + [
        ('', channel, unit, [(name, experiment.time, np.asarray(values)[:, c])
                             for name, values in readings.items()])
        for c, (channel, unit) in enumerate(zip(experiment.channels, experiment.units,
                                                strict=True))]
