# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Legal input: values of the described ranges, and designs and settings made of them.

Everything comes from one generator, so that a seed tells a whole life.
"""

import dataclasses
import math

from mlmem.physics import CASE_II, Design, DesignError
from mlmem.physics.potential import Potential
from mlmem.schema import find_descriptions
from mlmem.settings import Settings


def number(random, low, high, *, whole=False):
    """Return a number of a range: an end of it, zero, a tiny number, or any magnitude."""
    if random.random() < 0.15:
        ends = [low, high]
        if low <= 0.0 <= high:
            ends += [0] if whole else [0.0, high * 10.0 ** random.uniform(-320.0, -6.0)]
        return random.choice(ends)
    if whole:
        return random.randint(int(low), int(high))
    if low * high < 0.0:
        return math.copysign(number(random, 1e-9, max(-low, high)), random.random() - 0.5)
    if max(abs(low), abs(high)) > 100.0 * max(min(abs(low), abs(high)), 1e-9):
        small, large = sorted(map(abs, (low, high)))
        size = math.exp(random.uniform(math.log(max(small, 1e-6 * large)), math.log(large)))
        return math.copysign(min(max(size, small), large), low + high)
    return random.uniform(low, high)


def value(random, field, description):
    """Return a legal value of a described field."""
    if field.type in ('bool', bool):
        return random.random() < 0.5
    if description.choices:
        return random.choice(description.choices)
    if field.name in ('speeds', 'kinks', 'speed_margins'):
        return ' '.join(f'{number(random, 1e-4, 10.0):g}' for _ in range(random.randint(0, 9)))
    if field.name == 'bad_cells':
        return ''  # a register has none
    if field.name == 'profile':
        return random.choice(('', '0.5', '0.5 0.2 0.5'))
    whole = field.type in ('int', int)
    return number(random, description.low, description.high, whole=whole)


def values(random, owner, share):
    """Return legal values of some described fields of a dataclass, by name: a share of all."""
    return {
        field.name: value(random, field, description)
        for field, description in find_descriptions(owner)
        if random.random() < share
    }


def design(random):
    """Return a legal design of some tens of cells, so that hundreds of runs take seconds: near
    Case II's cells, or far from them.
    """
    while True:
        given = values(random, Design, random.choice((0.0, 0.1, 0.3, 0.6, 1.0)))
        given['N'] = random.randint(3, 60)
        for name, low, high in (('J', 2, 25), ('J_s', 2, 50), ('tail', 0, 20)):
            given[name] = random.randint(low, min(high, given['N'] - 1))
        given['substrate'] = random.choice(('rigid', 'rigid', 'elastic'))
        if stiffness := _stiffest(given):  # so that not nearly all are refused
            least = max(10.0 * stiffness, given.get('s_min', CASE_II.s_min))
            given['s_min'] = least
            given['s_max'] = max(least, given.get('s_max', CASE_II.s_max))
        try:
            drawn = dataclasses.replace(CASE_II, **given)
            drawn.require_memory()
            return drawn
        except DesignError:
            pass


def _stiffest(given):
    """Return the greatest stiffness of a phase and of the coupling; None where there is none."""
    p = dict(dataclasses.asdict(CASE_II), **given)
    c = Potential(*(p[name] for name in ('a', 'b', 'c', 'd')))
    try:
        states = [c.ground_state(p['phase'] + n) for n in (0, 1)]
    except DesignError:
        return None
    plain = 1.0 + abs(p['gamma']) * p['N']
    return max(1.0, *plain * (1.0 + max(0.0, p['beta'])) * c.stiffness(states))


def settings(random):
    """Return legal settings, with few or all of them drawn."""
    share, plain, groups = random.choice((0.0, 0.1, 0.3, 1.0)), Settings(), {}
    for name, group in plain.list_groups().items():
        drawn = values(random, type(group), share)
        if name == 'register':
            drawn['spacing'] = 0  # few designs hold many walls
        if name == 'read':
            drawn['method'] = 'delay'  # a forecast of any carrier may take gigabytes
        groups[name] = dataclasses.replace(group, **drawn)
    limit = groups['actuator'].max_strain
    peaks = ('compression', 'tension', 'start_strain')
    for name in ('write', 'erase'):
        given = {
            each: getattr(groups[name], each) for each in peaks if hasattr(groups[name], each)
        }
        bounded = {each: max(-limit, min(value, limit)) for each, value in given.items()}
        groups[name] = dataclasses.replace(groups[name], **bounded)
    if not groups['actuator'].present:  # nothing else writes without strain
        groups['write'] = dataclasses.replace(groups['write'], method='kick')
    most = min(min(0.5 / groups[p].A, 1.0 / groups[p].v_th) for p in ('probe', 'probe_right'))
    gain = max(1.0, min(groups['read'].kicked_gain, most * (1.0 - 1e-12)))
    groups['read'] = dataclasses.replace(groups['read'], kicked_gain=gain)
    return Settings(**groups)
